"""Light that differs from frame to frame is the frames' own, and hides neither a lens nor passes for an effect."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch

from tests.fit.camera.test_camera_case import EVERY, FRAMES, SIZE, opened, recorded
from vision_s2r.camera.colour import to_coded, to_linear
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.replay import replay
from vision_s2r.fit.camera.discrepancy import FEW
from vision_s2r.fit.camera.finer import with_finer_warps
from vision_s2r.fit.camera.light import FrameLight, stops
from vision_s2r.fit.camera.reference import pyramid
from vision_s2r.fit.camera.study import open_pictures, worked
from vision_s2r.recording.data import CameraRecording

K1 = -0.25


def photographed() -> CameraRecording:
    """Pairs through a lens, each of its own exposure and lit from a side of its own."""
    recording = recorded(lens_distortion={"k1": K1, "k2": 0.05})
    rng = np.random.default_rng(5)
    gain = np.exp(rng.normal(0, 0.12, FRAMES))[:, None, None, None]
    x = np.linspace(-1, 1, SIZE)
    tilt = 1 + 0.12 * (
        rng.normal(size=(FRAMES, 1, 1, 1)) * x[:, None, None] + rng.normal(size=(FRAMES, 1, 1, 1)) * x[:, None]
    )
    real = np.rint((recording.real * gain * tilt * 0.7).clip(0, 1) * 255) / np.float32(255)
    return replace(recording, real=real.astype(np.float32))


def test_a_lens_is_found_in_light_of_each_frames_own() -> None:
    case = opened(photographed())
    assert case.study.pictures.light.kind == "field" and case.unsteady
    assert {"exposure", "uneven_illumination", "cast_shadow", "vignetting"} <= case.not_excited.keys()
    fitted = case.fit(frozenset({"lens_distortion"}), EVERY, None)
    assert fitted.values["lens_distortion"]["k1"] == pytest.approx(K1, rel=0.05)
    assert case.excess(fitted, EVERY).mean() < 0.2 * case.excess(case.fit(frozenset(), EVERY, None), EVERY).mean()
    light = case.light(fitted)
    assert light is not None and light["spread"] > 0.1
    # What a replay leaves has the simulator's light.
    assert case.error(fitted, EVERY).mean() > 50


def test_a_lens_found_on_small_pictures_is_looked_at_again_on_finer_ones() -> None:
    whole = open_pictures(photographed())
    worked = replace(whole, light=FrameLight("exposure")).half()
    coarse = {"lens_distortion": {"k1": 1.15 * K1, "k2": 0.15}, "vignetting": {"strength": 0.0}}
    found = with_finer_warps(whole, worked, coarse)
    assert found["lens_distortion"]["k1"] == pytest.approx(K1, rel=0.03)
    assert found["vignetting"] == coarse["vignetting"]
    assert with_finer_warps(whole, whole, coarse) == coarse


def test_how_many_photographs_there_are_does_not_decide_at_which_size_they_are_worked_on() -> None:
    grey = np.zeros((13, 480, 640, 1), dtype=np.float32)
    whole = [replace(photographed(), sim=grey[:count], real=grey[:count], intrinsics=None) for count in (3, 13)]
    assert [worked(pyramid(open_pictures(each)))[0].scale for each in whole] == [0.25, 0.25]


def test_steady_light_is_no_frames_own() -> None:
    case = opened(recorded(exposure={"stops": 0.4}, vignetting={"strength": 0.3}))
    assert not case.unsteady and case.light(case.fit(frozenset(), EVERY, None)) is None


def lit_by(gain: np.ndarray, **effects: dict[str, float]) -> CameraRecording:
    """Pairs under effects, in light of so much [N, H or 1] that falls on each frame or its rows."""
    recording = recorded(**effects)
    light = to_linear(torch.from_numpy(recording.real)) * torch.from_numpy(gain).float()[:, :, None, None]
    real = (to_coded(light.clamp(0, 1)) * 255).round() / 255
    return replace(recording, real=real.numpy())


def named(recording: CameraRecording) -> set[str]:
    """A shadow that is larger than the picture would be an exposure as well."""
    found = diagnose(recording, DiagnoseConfig(jobs=1, withhold=["cast_shadow", "lens_distortion"])).to_dict()
    return {effect["name"] for effect in found["effects"]}


def test_an_exposure_of_each_frames_own_is_no_light_of_its_own_and_hides_no_falloff() -> None:
    drifting = lit_by(
        2 ** np.linspace(-0.4, 0.4, FRAMES)[:, None], uneven_illumination={"strength": 0.3, "angle": 20.0}
    )
    case = opened(drifting)
    assert case.study.pictures.light.kind == "exposure" and "uneven_illumination" not in case.not_excited


def test_an_exposure_beside_a_slight_flicker_has_its_name_and_a_flicker_alone_is_none() -> None:
    stops = 0.06 * np.array([1.0, -1.0, 0.5, -0.5, 1.5, -1.5])[:, None]
    assert named(lit_by(2**stops, exposure={"stops": -0.3})) == {"exposure"}
    assert not named(lit_by(2**stops))


def test_what_frames_own_exposures_have_in_common_has_its_name_and_what_they_have_not_has_none(tmp_path) -> None:
    stops = 0.25 * np.array([1.0, -0.5, -1.5, 1.5, 0.5, -1.0])[:, None]
    darker = lit_by(2**stops, exposure={"stops": -0.9})
    assert opened(darker).unsteady
    report = diagnose(darker, DiagnoseConfig(jobs=1)).to_dict()
    (found,) = report["effects"]
    assert found["name"] == "exposure" and found["share"] > 0.7 and found["evidence"] > 3
    low, high = found["parameters"]["stops"]["ci"]
    assert low < -0.9 < high < -0.5 and report["gap"]["after"] < 0.5 * report["gap"]["before"]
    status = {each["name"]: each["status"] for each in report["candidates"]}
    assert status["exposure"] == "present" and abs(np.mean(report["light"]["exposure"])) < 0.1
    values = {found["name"]: {"stops": found["parameters"]["stops"]["value"]}}
    assert replay(darker, values, tmp_path)["gap"]["after"] == pytest.approx(report["gap"]["after"], rel=0.1)
    assert not diagnose(lit_by(2**stops), DiagnoseConfig(jobs=1)).to_dict()["effects"]


def test_what_a_frames_light_is_predicted_wrongly_by_is_no_noise_of_encoded_photographs() -> None:
    rng, recording, x = np.random.default_rng(5), recorded(defocus_blur={"radius": 2.0}), np.linspace(-1, 1, SIZE)
    gain = np.exp(rng.normal(0, 0.15, (FRAMES, 1, 1, 1)))
    rippled = 1 + 0.08 * np.cos(6 * x + rng.uniform(0, 6, (FRAMES, 1)))[:, None, :, None]
    real = (recording.real * gain * rippled * 0.75 * 255).clip(0, 255).astype(np.uint8)
    files = [cv2.imencode(".jpg", each[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 90])[1] for each in real]
    encoded = np.stack([cv2.imdecode(each, cv2.IMREAD_COLOR)[..., ::-1] for each in files])
    case = opened(replace(recording, real=encoded.astype(np.float32) / 255))
    variance, _ = case.study.bins.variance(EVERY)
    assert case.unsteady and "jpeg_compression" in case.certain
    assert np.nanmean(np.sqrt(variance)) < 3.5 / 255


def test_a_frames_light_is_told_from_its_surfaces() -> None:
    mean = torch.from_numpy(recorded().sim).permute(0, 3, 1, 2) * 0.8
    x = torch.linspace(-1, 1, SIZE)
    real = mean * (1.1 + 0.2 * x + 0.1 * x[:, None]) + 0.03
    lit = FrameLight("field").on(mean, real, torch.full_like(mean[:, :1], 255.0**2), "srgb")
    assert (lit.mean - real.clamp(0, 1)).abs().max() < 0.02
    dim = FrameLight("field").on(mean / 2, real / 2, torch.full_like(mean[:, :1], 255.0**2), "srgb")
    edges = (mean > mean.mean()).float()
    brighter, drawn = dim.beside(torch.stack([mean / 2, edges])).abs().amax((1, 2, 3, 4))
    assert brighter < 1e-3 < drawn  # light would make up for the first
    brighter = FrameLight("exposure").on(mean, mean * 1.1, torch.ones_like(mean), "linear")
    assert stops(brighter, "linear") == pytest.approx(np.log2(1.1), abs=0.01)


def test_what_is_wrong_nearly_everywhere_is_no_outlier() -> None:
    case = opened(recorded(exposure={"stops": 1.0}))
    fitted = case.fit(frozenset({"outliers"}), EVERY, None)
    assert fitted.extra["outliers"].coefficients[0] <= FEW
    assert case.excess(fitted, EVERY).mean() > 0.5 * case.excess(case.fit(frozenset(), EVERY, None), EVERY).mean()
