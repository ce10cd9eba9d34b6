"""Two sets of pictures of different scenes: what is named, how large it is, and what is kept silent about."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from tests.fit.unpaired.scenes import of, recording, scenes
from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.report import report
from vision_s2r.diagnose.search import Search
from vision_s2r.diagnose.settle import settle
from vision_s2r.errors import UserError
from vision_s2r.fit.case import NOMINAL, Hypothesis
from vision_s2r.fit.unpaired.case import UnpairedCase
from vision_s2r.recording import CameraRecording
from vision_s2r.report import figures

LIMITS = DiagnoseConfig().unpaired


def case_of(pictures: CameraRecording, without: Sequence[str] = ()) -> UnpairedCase:
    return UnpairedCase.open(pictures, {e.name: e for e in CAMERA_EFFECTS if e.name not in without})


def diagnosed(pictures: CameraRecording, without: Sequence[str] = ()) -> dict[str, Any]:
    case = case_of(pictures, without)
    assessor = Assessor(case, LIMITS, 1, 0)
    with case.session():
        return report(case, assessor, settle(case, assessor, Search(case, assessor).run()))[0]


def parameters(result: dict[str, Any], name: str) -> dict[str, Any]:
    return next(each["parameters"] for each in result["effects"] if each["name"] == name)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_different_scenes_are_no_gap(seed: int) -> None:
    result = diagnosed(recording({}, seed))
    assert result["verdict"] == "no_gap" and result["effects"] == []
    assert result["gap"]["before"] == pytest.approx(result["gap"]["floor"], rel=0.05)


@pytest.mark.parametrize(
    ("name", "values", "axes"),
    [
        ("defocus_blur", {"radius": 1.8}, {"frequency"}),
        pytest.param("read_noise", {"sigma": 0.02}, {"brightness"}, marks=pytest.mark.slow),
        pytest.param("white_balance", {"red": 1.2, "blue": 0.85}, {"channel", "brightness"}, marks=pytest.mark.slow),
        pytest.param("vignetting", {"strength": 0.6}, {"region"}, marks=pytest.mark.slow),
        pytest.param("jpeg_compression", {"quality": 40.0}, {"frequency", "brightness", ""}, marks=pytest.mark.slow),
    ],
)
def test_names_one_effect_its_size_and_its_place(name: str, values: dict[str, float], axes: set[str]) -> None:
    result = diagnosed(recording({name: values}, 3))
    assert [each["name"] for each in result["effects"]] == [name]
    assert result["verdict"] == "explained"
    for key, found in parameters(result, name).items():
        assert found["value"] == pytest.approx(values[key], rel=0.1)
    assert result["gap"]["shrink"] > 0.9
    first = next(iter(result["where"]), {"axis": ""})
    assert first["axis"] in axes and ("" in axes or first["effect"] == name)


def test_every_axis_is_drawn_though_two_are_of_brightness() -> None:
    pictures = recording({"read_noise": {"sigma": 0.02}}, 3)
    samples = case_of(pictures).samples(NOMINAL)
    looks = figures(pictures, {}, samples, samples, "1")
    panels = next(figure for caption, figure in looks.items() if caption.startswith("Where the gap lies")).axes
    assert sorted(each.get_title(loc="left") for each in panels) == sorted(axis.name for axis in samples.axes)


@pytest.mark.slow
def test_names_two_effects_which_share_the_gap() -> None:
    result = diagnosed(recording({"defocus_blur": {"radius": 1.5}, "read_noise": {"sigma": 0.015}}, 4))
    assert {each["name"] for each in result["effects"]} == {"defocus_blur", "read_noise"}
    assert sum(each["share"] for each in result["effects"]) > 0.9


@pytest.mark.slow
def test_is_silent_about_what_needs_pairs() -> None:
    result = diagnosed(recording({}, 5))
    not_excited = {each["name"] for each in result["candidates"] if each["status"] == "not_excited"}
    assert not_excited == {"camera_pose_offset", "lens_distortion", "chromatic_aberration", "cast_shadow"}
    assert "pairs" in result["next_experiment"]
    sim, real = (scenes(6, seed).mean(-1, keepdims=True).repeat(3, -1) for seed in (0, 1))
    assert "white_balance" in case_of(of(sim, real, grey=True)).not_excited


@pytest.mark.slow
def test_a_tone_that_no_effect_gives_stays_without_a_name() -> None:
    sim, real = scenes(16, 0), scenes(16, 1)
    posterized = real + 0.12 * np.sin(4 * np.pi * real)
    result = diagnosed(of(sim, posterized))
    assert result["verdict"] in ("unexplained", "partly_explained")
    assert not {each["name"] for each in result["effects"]} & {"defocus_blur", "vignetting", "jpeg_compression"}


@pytest.mark.slow
def test_what_does_not_do_all_of_its_part_has_no_name_beside_something_unknown() -> None:
    real = scenes(16, 1)
    soft = np.stack([cv2.GaussianBlur(picture, (0, 0), 1.5) for picture in real])
    result = diagnosed(of(scenes(16, 0), real + 1.5 * (real - soft)))  # sharpened: as if noise were there
    assert result["verdict"] == "unexplained" and result["effects"] == []


@pytest.mark.slow
def test_withheld_blur_is_unknown_or_its_twin() -> None:
    blurs = {"defocus_blur", "motion_blur", "low_resolution"}
    result = diagnosed(recording({"defocus_blur": {"radius": 2.5}}, 6), without=sorted(blurs))
    assert result["effects"] == [] and result["verdict"] == "unexplained"
    assert result["where"][0]["axis"] == "frequency"


@pytest.mark.slow
def test_twice_the_same() -> None:
    pictures = recording({"shot_noise": {"full_well": 300.0}}, 7, count=3)
    first, second = (case_of(pictures).fit(frozenset({"shot_noise"}), range(3), None) for _ in range(2))
    assert first == second


@pytest.mark.slow
def test_bands_of_an_interval_hold_the_truth_and_shrink_with_pictures() -> None:
    widths = []
    for count in (8, 32):
        case = case_of(recording({"vignetting": {"strength": 0.5}}, 8, count))
        fitted = case.fit(frozenset({"vignetting"}), range(count), NOMINAL)
        low, high = case.intervals(fitted)["vignetting"]["strength"]
        assert low - 0.05 < 0.5 < high + 0.05
        widths.append(high - low)
    assert widths[1] < widths[0]


def test_a_mask_that_leaves_too_little_is_an_error() -> None:
    pictures = recording({}, 9, count=4)
    mask = np.zeros(pictures.sim.shape[:3], dtype=bool)
    mask[:, :10, :10] = True
    with pytest.raises(UserError, match="mask/"):
        case_of(replace(pictures, mask=mask))


def test_an_effect_that_is_no_more_than_scenes_differ_by_may_be_contents() -> None:
    case = case_of(recording({}, 10, count=24))
    slight, strong = Hypothesis({"exposure": {"stops": 0.1}}), Hypothesis({"read_noise": {"sigma": 0.05}})
    assert [each["name"] for each in case.contents(slight, frozenset({"exposure"}), False)] == ["exposure"]
    assert case.contents(strong, frozenset({"read_noise"}), False) == []
    (left,) = case.contents(NOMINAL, frozenset(), True)
    assert left["name"] == "unexplained" and left["shift"] < 1
