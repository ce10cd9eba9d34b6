"""Surfaces and light: what pictures and depth tell of them, and what a recording with labels is said to show."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
import yaml
from recordings import QUICK

from vision_s2r.appearance import APPEARANCE_EFFECTS
from vision_s2r.appearance.lamp import lamp_of
from vision_s2r.appearance.normals import normals
from vision_s2r.camera.colour import to_coded
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.one_case import open_case
from vision_s2r.diagnose.replay import ReplayConfig, replay_all
from vision_s2r.errors import UserError
from vision_s2r.fit.camera.case import CameraCase
from vision_s2r.fit.camera.grain import grain_of
from vision_s2r.fit.camera.surfaces import library_of, surfaces_of
from vision_s2r.gapbench.generate.appearance_scenes import (
    BALL,
    BOX,
    TABLE,
    THING,
    Bullet,
    Look,
    Solid,
    cast,
    grain,
    pinhole,
    shaded,
    solids,
)
from vision_s2r.recording import CameraRecording, from_pictures, read
from vision_s2r.recording.write import write
from vision_s2r.report.reading import library

FRAMES, SIZE, FOCAL = 5, 64, 70.0
TOWARDS = np.array([0.48, -0.36, 0.8])


def scenes(look: Look, real: Look, seed: int = 0, more: tuple[Solid, ...] = ()) -> CameraRecording:
    """Tables with solids, as rendered and as they are: half a grey level of noise, rounded, depth in whole mm.

    `more`: what stands in every real scene, and in no rendered one.
    """
    rng = np.random.default_rng(seed)
    camera = pinhole(SIZE, FOCAL, rng)
    parts = []
    for _ in range(FRAMES):
        things = solids(rng)
        labels, depth, _ = cast(camera, things)
        both = (things, look), ([*things, *more], real)
        pair = [to_coded(torch.from_numpy(shaded(camera, *each, rng))).numpy() for each in both]
        noisy = np.clip(pair[1] + rng.normal(0, 0.5 / 255, pair[1].shape), 0, 1)
        parts.append((*(np.round(each * 255).astype(np.uint8) for each in (noisy, pair[0])), labels, depth))
    real_pictures, sim, labels, depth = (np.stack(each) for each in zip(*parts, strict=True))
    centre = (SIZE - 1) / 2
    return from_pictures(
        real_pictures, sim, labels=labels, depth=np.round(depth, 3), intrinsics=(FOCAL, FOCAL, centre, centre)
    )


def plain() -> Look:
    colours = {1: (0.4, 0.35, 0.3), 2: (0.2, 0.3, 0.25), 3: (0.5, 0.2, 0.2), 4: (0.2, 0.4, 0.55)}
    return Look({label: np.array(colour) for label, colour in colours.items()}, TOWARDS, 0.35)


def test_a_darker_label_is_named_with_its_gains_and_replays(tmp_path) -> None:
    gains = np.array([0.6, 0.75, 0.7])
    darker = replace(plain(), colours=plain().colours | {BOX: plain().colours[BOX] * gains})
    recording = replace(scenes(plain(), darker), label_names={BOX: "small box"})
    found = diagnose(recording, DiagnoseConfig(camera=QUICK))
    (effect,) = found.effects
    assert (effect.name, effect.label, effect.source) == ("albedo", BOX, "appearance")
    assert [each.value for each in effect.parameters.values()] == pytest.approx(gains, rel=0.03)
    assert found.verdict == "explained" and [each.source for each in found.sources] == ["appearance"]
    assert "the small box is of another colour" in found.summary()
    found.save(tmp_path / "report")
    patch = yaml.safe_load((tmp_path / "report" / "patch" / "appearance.yaml").read_text())
    assert patch["labels"][BOX]["albedo"]["green"] == pytest.approx(0.75, rel=0.03)
    assert yaml.safe_load((tmp_path / "report" / "patch" / "camera.yaml").read_text())["effects"] == {}
    write(recording, tmp_path / "recording")
    assert read(tmp_path / "recording").label_names == {BOX: "small box"}
    (path,) = replay_all(
        ReplayConfig(str(tmp_path / "recording"), str(tmp_path / "report" / "report.json"), str(tmp_path / "replay"))
    )
    gap = json.loads(path.read_text())["gap"]
    assert gap["after"] < 0.4 * gap["before"]
    bare = replace(recording, labels=None, depth=None)
    write(bare, tmp_path / "bare")
    with pytest.raises(UserError, match="no labels"):
        replay_all(ReplayConfig(str(tmp_path / "bare"), str(tmp_path / "report" / "report.json"), str(tmp_path / "no")))


def test_a_thing_hides_what_is_behind_it_and_not_what_is_beside_it_in_its_rectangle() -> None:
    bare, detail = scenes(plain(), plain()), np.random.default_rng(1).normal(0, 0.05, (FRAMES, SIZE, SIZE, 3))
    rows, columns = np.indices((SIZE, SIZE))
    beside = (np.abs(rows - 30) + np.abs(columns - 34) > 14)[..., None]  # a thing that stands on its corner
    sim, real = bare.sim + detail, np.where(beside, bare.real + detail, 0.9)
    sim, real = ((np.round(each.clip(0, 1) * 255) / 255).astype(np.float32) for each in (sim, real))
    case = open_case(replace(bare, sim=sim, real=real))
    found = case.fit(frozenset({"missing_object"}), range(case.segments), None)
    assert found.values["missing_object"]["width"] == 27
    assert not case.suspicious(found, "missing_object") and not case.contradicted(found, "missing_object")


@pytest.mark.slow
def test_what_was_not_rendered_is_found_beside_a_darker_picture_and_replays(tmp_path) -> None:
    thing = Solid(THING, np.array([0.02, 0.09, 0.04]), np.full(3, 0.04), 0.3)
    red = replace(
        plain(), colours={label: 0.8 * each for label, each in plain().colours.items()} | {THING: [0.6, 0, 0]}
    )
    recording = scenes(plain(), red, more=(thing,))
    at = (cast(pinhole(SIZE, FOCAL, np.random.default_rng(0)), [thing])[0] == THING).nonzero()
    found = diagnose(recording)
    effects = {each.name: each for each in found.effects}
    assert effects.keys() == {"missing_object", "exposure"} and effects["missing_object"].source == "appearance"
    values = {key: each.value for key, each in effects["missing_object"].parameters.items()}
    ends = [values["y"], values["y"] + values["height"], values["x"], values["x"] + values["width"]]
    assert ends == pytest.approx([at[0].min(), at[0].max() + 1, at[1].min(), at[1].max() + 1], abs=2)
    assert effects["exposure"].parameters["stops"].value == pytest.approx(np.log2(0.8), abs=0.02)
    assert "show something that was not rendered" in found.summary()
    assert found.gap.after < 1.3 * found.gap.floor
    found.save(tmp_path / "report")
    write(recording, tmp_path / "recording")
    (path,) = replay_all(
        ReplayConfig(str(tmp_path / "recording"), str(tmp_path / "report" / "report.json"), str(tmp_path / "replay"))
    )
    gap = json.loads(path.read_text())["gap"]
    assert gap["after"] < 0.2 * gap["before"]


def test_depth_tells_normals_and_pictures_the_light() -> None:
    rng = np.random.default_rng(3)
    camera = pinhole(2 * SIZE, 2 * FOCAL, rng)
    drawn = [solids(rng) for _ in range(FRAMES)]
    labels, depth, facing = (np.stack(each) for each in zip(*(cast(camera, each) for each in drawn), strict=True))
    ids, centre = torch.from_numpy(labels.astype(np.int64)), (2 * SIZE - 1) / 2
    found = normals(torch.from_numpy(depth.round(3)), ids, torch.tensor([2 * FOCAL, 2 * FOCAL, centre, centre]))
    true = torch.from_numpy(facing @ camera.rotation.T).permute(0, 3, 1, 2)
    off = torch.rad2deg((found * true).sum(1).clamp(-1, 1).arccos())
    assert all(float(off[ids == label].median()) < limit for label, limit in ((TABLE, 1.0), (BOX, 1.0), (BALL, 4.0)))
    assert float(off[ids == BALL].quantile(0.9)) < 9  # beside its rim too
    colours = np.stack([np.zeros(3), *(plain().colours[label] for label in sorted(plain().colours))])[labels]
    shading = 0.35 + 0.65 * np.maximum(facing @ TOWARDS, 0)
    pictures = torch.from_numpy(colours * shading[..., None]).permute(0, 3, 1, 2)
    for coded in (False, True):  # renderers that shade light, and those that shade coded values
        shown = pictures if coded else to_coded(pictures)
        lamp = lamp_of(shown.float(), ids, found, "srgb")
        assert lamp.coded == coded and lamp.ambient == pytest.approx(0.35, abs=0.03)
        assert float(np.dot(lamp.direction, camera.rotation @ TOWARDS)) > 0.99


def test_the_renderer_s_light_is_read_off_its_pictures() -> None:
    rng = np.random.default_rng(5)
    camera = pinhole(2 * SIZE, 2 * FOCAL, rng)
    shown = []
    for _ in range(FRAMES):
        with Bullet(camera, solids(rng)) as bullet:
            shown.append(bullet.picture(plain()))
    pictures, labels, depth = (torch.from_numpy(np.stack(each)) for each in zip(*shown, strict=True))
    centre = (2 * SIZE - 1) / 2
    ids, intrinsics = labels.long(), torch.tensor([2 * FOCAL, 2 * FOCAL, centre, centre])
    facing = normals((depth * 1000).round() / 1000, ids, intrinsics)
    lamp = lamp_of(pictures.permute(0, 3, 1, 2) / 255, ids, facing, "srgb")
    assert lamp.coded and lamp.ambient == pytest.approx(0.35, abs=0.03)
    assert float(np.dot(lamp.direction, camera.rotation @ TOWARDS)) > 0.999


def test_how_well_the_renderer_s_light_is_known_is_in_the_intervals_of_another() -> None:
    towards = np.array([-0.2, 0.6, 0.77]) / np.linalg.norm([-0.2, 0.6, 0.77])
    recording = scenes(plain(), replace(plain(), towards=towards))
    case = CameraCase.open(recording, {name: APPEARANCE_EFFECTS[name] for name in ("light_direction", "ambient")})
    with case.session():
        found = case.fit(frozenset({"light_direction"}), range(FRAMES), None)
        low, high = case.intervals(found)["light_direction"]["elevation"]
    away = (pinhole(SIZE, FOCAL, np.random.default_rng(0)).rotation @ towards)[2]
    assert low < -np.arcsin(away) < high
    assert 0.03 < high - low < 0.2


@pytest.mark.slow
def test_surfaces_that_meet_in_a_pixel_or_bend_do_not_brighten_the_renderer_s_light() -> None:
    found = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        camera = pinhole(2 * SIZE, 2 * FOCAL, rng)
        drawn = [solids(rng) for _ in range(FRAMES)]
        labels, depth, _ = (np.stack(each) for each in zip(*(cast(camera, each) for each in drawn), strict=True))
        light = torch.from_numpy(np.stack([shaded(camera, each, plain(), rng) for each in drawn]))
        ids, centre = torch.from_numpy(labels.astype(np.int64)), (2 * SIZE - 1) / 2
        facing = normals(torch.from_numpy(depth.round(3)), ids, torch.tensor([2 * FOCAL, 2 * FOCAL, centre, centre]))
        pictures = (to_coded(light).permute(0, 3, 1, 2) * 255).round() / 255
        found.append(lamp_of(pictures.float(), ids, facing, "srgb").ambient)
    assert np.mean(found) == pytest.approx(0.35, abs=0.005)


def test_a_share_of_even_light_is_as_uncertain_as_the_share_that_it_is_measured_against() -> None:
    recording = scenes(plain(), replace(plain(), ambient=0.85))
    case = CameraCase.open(recording, {name: APPEARANCE_EFFECTS[name] for name in ("light_direction", "ambient")})
    with case.session():
        low, high = case.intervals(case.fit(frozenset({"ambient"}), range(FRAMES), None))["ambient"]["share"]
    assert low < 0.85 < high and high - low < 0.2


def test_labels_decide_what_is_asked() -> None:
    recording = scenes(plain(), plain())
    known = {effect.name: effect for effect in library("camera")}
    with_labels = library_of(recording, known)
    assert {"1.albedo", "4.albedo", "light_direction"} <= with_labels.keys()
    without = library_of(replace(recording, labels=None), known)
    assert not [name for name in without if name.rpartition(".")[2] in APPEARANCE_EFFECTS]
    assert surfaces_of(replace(recording, labels=None)) is None


def test_grain_is_measured_and_is_no_blur() -> None:
    rng = np.random.default_rng(5)
    light = np.full((4, 96, 96), 0.4)
    light[:, :, 64:] = 0.1
    label = np.zeros((4, 1, 96, 96), np.float32)
    label[..., :64] = 1
    field = np.stack([grain((96, 96), 5.0, rng) for _ in range(4)])
    real = to_coded(torch.from_numpy(light * (1 + 0.12 * field * label[:, 0]))).float()[:, None]
    mean = to_coded(torch.from_numpy(light)).float()[:, None]
    noisy = real - mean + torch.from_numpy(rng.normal(0, 0.01, real.shape)).float()
    region, counted = torch.from_numpy(label), torch.ones(real.shape, dtype=torch.bool)
    found = grain_of(noisy, mean, region, counted, "srgb")
    assert found is not None
    assert found.amplitude == pytest.approx(0.12, rel=0.1) and found.scale == pytest.approx(5.0, rel=0.15)
    assert grain_of(noisy, mean, 1 - region, counted, "srgb") is None  # noise alone
    lines = torch.zeros_like(mean)
    lines[..., ::12] = 0.1
    assert grain_of(lines, mean, region, counted, "srgb") is None  # something in few places
