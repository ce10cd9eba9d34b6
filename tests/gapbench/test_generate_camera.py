"""The generator's camera obeys the contract, owes nothing to the project's own, and writes what it says it writes."""

import ast
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from vision_s2r.camera import CAMERA_EFFECTS, Camera
from vision_s2r.camera.parameters import CameraParameters
from vision_s2r.fit.camera import poses
from vision_s2r.gapbench import generate
from vision_s2r.gapbench.generate import camera, camera_next
from vision_s2r.gapbench.generate.camera_effects import (
    EFFECTS,
    NOISE,
    Geometry,
    Sensor,
    disk,
    optics,
    path,
    photograph,
    read_out,
)
from vision_s2r.gapbench.generate.camera_unknown import UNKNOWN
from vision_s2r.recording import CameraRecording, read

GEOMETRY = Geometry(64, 48, 70.0, 72.0, 31.0, 24.5, margin=12)
PINHOLE = np.array([[70.0, 0, 31.0], [0, 72.0, 24.5], [0, 0, 1]])


def scene(count: int = 2) -> np.ndarray:
    """Smooth colourful noise on the canvas of GEOMETRY, as whole numbers of 8 bits have it."""
    rng = np.random.default_rng(0)
    noise = rng.random((count, 20, 24, 3))
    wide = [cv2.resize(n, GEOMETRY.shape[::-1], interpolation=cv2.INTER_CUBIC) for n in noise]
    return np.round(np.clip(np.stack(wide), 0.05, 0.95) * 255) / 255


def spot(x: float, y: float) -> np.ndarray:
    columns, rows = GEOMETRY.pixels()
    return np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 4.5)[None, :, :, None] * np.ones(3)


def centroid(canvas: np.ndarray, channel: int = 1) -> tuple[float, float]:
    columns, rows = GEOMETRY.pixels()
    weight = canvas[0, :, :, channel]
    return float((weight * columns).sum() / weight.sum()), float((weight * rows).sum() / weight.sum())


@pytest.mark.parametrize("module", sorted(Path(generate.__file__).parent.glob("camera*.py")), ids=lambda p: p.stem)
def test_it_shares_nothing_with_the_project(module: Path) -> None:
    tree = ast.parse(module.read_text())
    imported = [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
    imported += [alias.name for n in ast.walk(tree) if isinstance(n, ast.Import) for alias in n.names]
    ours = [name for name in imported if name.startswith("vision_s2r")]
    assert all(name.startswith("vision_s2r.gapbench.generate") for name in ours)
    assert not {"torch", "kornia"} & {name.split(".")[0] for name in imported}


@pytest.mark.parametrize("name", [name for name in EFFECTS if name not in NOISE])
def test_two_implementations_of_an_effect_agree(name: str) -> None:
    values = {name: CAMERA_EFFECTS[name].moderate()}
    ours = photograph(scene(), values, GEOMETRY, Sensor(kernel="cubic75"), None)
    tensors = {name: {key: torch.full((2,), v, dtype=torch.float64) for key, v in values[name].items()}}
    images = torch.from_numpy(scene()).permute(0, 3, 1, 2)
    intrinsics = torch.tensor([[70.0, 72.0, 31.0, 24.5]], dtype=torch.float64).expand(2, 4)
    project = Camera()(images, CameraParameters(tensors, torch.zeros(2, dtype=torch.int64)), 12, intrinsics)
    theirs = 255 * project.permute(0, 2, 3, 1).numpy()
    plain = photograph(scene(), {}, GEOMETRY, Sensor(), None)
    difference = math.sqrt(np.mean((ours - theirs) ** 2))
    assert difference < 0.6, f"{difference:.2f} grey levels apart"  # rounding alone is 0.29
    assert math.sqrt(np.mean((ours.astype(float) - plain) ** 2)) > 2


def test_rays_go_where_opencv_says() -> None:
    x, y, turn = 40.0, 15.0, np.array([0.05, -0.06, 0.1])  # pitch, yaw, roll
    ray = np.array([[(x - 31.0) / 70.0, (y - 24.5) / 72.0, 1.0]])
    canvas = optics(
        spot(x, y), {"camera_pose_offset": {"pitch": 0.05, "yaw": -0.06, "roll": 0.1}}, GEOMETRY, Sensor(linear=True)
    )
    expected = cv2.projectPoints(ray, turn, np.zeros(3), PINHOLE, None)[0][0, 0]
    assert centroid(canvas) == pytest.approx(tuple(expected), abs=0.05)
    canvas = optics(spot(x, y), {"lens_distortion": {"k1": -0.3, "k2": 0.1}}, GEOMETRY, Sensor(linear=True))
    lens = np.array([-0.3, 0.1, 0, 0])
    expected = cv2.projectPoints(ray, np.zeros(3), np.zeros(3), PINHOLE, lens)[0][0, 0]
    assert centroid(canvas) == pytest.approx(tuple(expected), abs=0.05)


def test_kernels_have_the_moments_of_their_shapes() -> None:
    for radius in (2.5, 5.2):
        kernel = disk(radius)
        reach = np.arange(len(kernel)) - len(kernel) // 2
        assert kernel.sum() == pytest.approx(math.pi * radius**2, rel=0.01)
        spread = (kernel * (reach[:, None] ** 2 + reach**2)).sum() / kernel.sum()
        assert spread == pytest.approx(radius**2 / 2 + 1 / 6, rel=0.04)  # a disk's, and a pixel's
    kernel = path(9.0, 30.0, "cubic")
    kernel = kernel / kernel.sum()
    reach = np.arange(len(kernel)) - len(kernel) // 2
    along = reach * math.cos(math.radians(30)) + reach[:, None] * math.sin(math.radians(30))
    across = reach[:, None] * math.cos(math.radians(30)) - reach * math.sin(math.radians(30))
    assert (kernel * along**2).sum() == pytest.approx(81 / 12, rel=0.01)
    assert abs((kernel * across**2).sum()) < 0.05


@pytest.mark.parametrize("form", ["soft", "hexagon"])
def test_another_maker_s_disk_is_as_wide(form: str) -> None:
    even, other = disk(4.0), disk(4.0, form)
    reach = np.arange(len(even)) - len(even) // 2
    second = [(kernel * (reach[:, None] ** 2 + reach**2)).sum() / kernel.sum() for kernel in (even, other)]
    assert second[1] == pytest.approx(second[0], rel=0.03)
    assert np.abs(even / even.sum() - other / other.sum()).sum() > 0.02


def test_noise_has_the_contract_s_size() -> None:
    grey = np.full((4, 64, 64, 3), 0.5)
    light = ((0.5 + 0.055) / 1.055) ** 2.4
    slope = 1 / (2.4 / 1.055 * ((0.5 + 0.055) / 1.055) ** 1.4)  # of the coded value by light
    rng = np.random.default_rng(1)
    read_noise = read_out(grey, {"read_noise": {"sigma": 0.01}}, Sensor(), rng)
    assert read_noise.std() == pytest.approx(0.01 * slope, rel=0.03)
    shot_noise = read_out(grey, {"shot_noise": {"full_well": 2000.0}}, Sensor(), rng)
    assert shot_noise.std() == pytest.approx(math.sqrt(light / 2000) * slope, rel=0.03)
    assert read_out(grey, {"read_noise": {"sigma": 0.01}}, Sensor(linear=True), rng).std() == pytest.approx(
        0.01, rel=0.03
    )


def test_a_finer_drawing_of_the_scene_shows_the_same_picture() -> None:
    fine = Geometry(64, 48, 70.0, 72.0, 31.0, 24.5, margin=12, scale=2)
    canvas = np.stack([cv2.resize(p, fine.shape[::-1], interpolation=cv2.INTER_CUBIC) for p in scene()])
    values = {"lens_distortion": {"k1": -0.2, "k2": 0.05}, "defocus_blur": {"radius": 2.0}}
    both = [photograph(c, values, g, Sensor(), None) for c, g in ((scene(), GEOMETRY), (canvas, fine))]
    assert math.sqrt(np.mean((both[0].astype(float) - both[1]) ** 2)) < 1.5


def test_tuning_and_reporting_know_other_unknown_effects() -> None:
    tuning, reporting = ({kind.__name__ for kind in UNKNOWN[split]} for split in ("tuning", "reporting"))
    assert len(tuning | reporting) >= 40 and len(tuning) >= len(reporting) >= 20
    assert not (tuning & reporting)
    assert not ((tuning | reporting) & set(EFFECTS))


FAST = ("null", "single", "pair", "unknown", "known_unknown")


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=() if case in FAST else pytest.mark.slow) for case in camera.CASES if case != "sensor"],
)
def test_a_generated_camera(case: str, tmp_path: Path) -> None:
    machine = camera.machine(case, 3, "tuning", np.random.default_rng(5))
    machine.write(tmp_path)
    recording = read(tmp_path)
    assert isinstance(recording, CameraRecording)
    assert recording.sim.shape[1:3] == (128, 128)
    answer = machine.answer
    expected = {"null": 0, "single": 1, "pair": 2, "triple": 3, "known_unknown": 1, "confusable": 1}
    assert len(answer.effects) == expected.get(case, 0)
    if case == "confusable":
        (visible,) = answer.notes["visible"].values()
        assert visible < camera.SEVERE and answer.shrink is None
    assert bool(answer.unknown) == (case in ("unknown", "known_unknown"))
    assert bool(answer.withhold) == (case == "left_out")
    assert recording.pairing == "paired"
    if case == "confusable":
        return
    gap = 255 * math.sqrt(np.mean((recording.sim - recording.real) ** 2))
    if case in ("null", "weak"):
        assert gap < 0.75 and 0.98 < answer.severity < 1.1
    else:
        assert gap > 1.4
    if case in ("single", "pair", "triple"):
        assert answer.shrink > 0.9  # what is drawn finer than sim/, 16 bits show as well
    assert all(shown >= 1.5 for shown in answer.notes["visible"].values()) or case == "weak"


def test_a_generated_sensor_has_the_noise_that_it_says(tmp_path: Path) -> None:
    machine = camera.machine("sensor", 0, "tuning", np.random.default_rng(4))
    machine.write(tmp_path)
    recording = read(tmp_path)
    assert isinstance(recording, CameraRecording) and machine.answer.unknown == "sensor"
    chip = machine.answer.notes
    assert recording.bits == (8 if chip["bits"] == 8 else 16) and not chip["coded"]
    light = recording.sim.mean((1, 2, 3))
    (one, other) = np.flatnonzero(np.isclose(light, light.max()))[:2]
    left = (recording.real[one] - recording.real[other])[..., 0]  # what a pixel has in both frames is gone
    rise = left - left.mean(1, keepdims=True)
    assert rise.var() / 2 == pytest.approx(light.max() / chip["full_well"], rel=0.1)
    assert machine.answer.effects["shot_noise"]["full_well"] == chip["full_well"]


def test_a_camera_photographs_what_a_report_asks_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(camera, "PAIRS", 4)
    machine = camera.machine("confusable", 0, "tuning", np.random.default_rng(6))
    (tmp_path / "before").mkdir()
    machine.write(tmp_path / "before")
    before, answer = read(tmp_path / "before"), machine.answer.to_dict()
    target = np.kron(np.random.default_rng(0).random((16, 16)), np.ones((64, 64)))
    cv2.imwrite(str(tmp_path / "next_recording.png"), np.round(255 * target).astype(np.uint8))
    held = poses.candidates(before.intrinsics[0] / 128)[[0, 3, 10]]
    columns = poses.table(held)
    rows = np.stack(list(columns.values()), axis=1)
    np.savetxt(tmp_path / "next_recording.csv", rows, delimiter=",", header=",".join(columns), comments="")
    asked = camera_next.asked(tmp_path, tmp_path / "before", answer)
    camera_next.continued(tmp_path / "before", tmp_path / "after", answer, asked, np.random.default_rng(1))
    after = read(tmp_path / "after")
    assert isinstance(after, CameraRecording) and len(after.sim) == len(before.sim) + 3
    assert np.array_equal(after.real[: len(before.real)], before.real)
    print_ = cv2.resize(target, (128, 128), interpolation=cv2.INTER_AREA).astype(np.float32)
    for picture, pose in zip(after.sim[-3:], held, strict=True):
        ideal = poses.seen(print_, pose, before.intrinsics)
        assert np.abs(picture[..., 0] - ideal).mean() < 0.03 < ideal.std()
    scenes = camera_next.at_random(tmp_path / "before", answer, asked, np.random.default_rng(2))
    assert scenes.shape == asked.shape


@pytest.mark.slow
def test_the_same_seed_seals_the_same_camera(tmp_path: Path) -> None:
    answers = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        machine = camera.machine("single", 10, "tuning", np.random.default_rng(2))
        machine.write(tmp_path / name)
        answers.append(machine.answer)
    assert answers[0] == answers[1]
    for file in sorted((tmp_path / "a" / "real").iterdir()):
        assert file.read_bytes() == (tmp_path / "b" / "real" / file.name).read_bytes()


@pytest.mark.parametrize("split", ["tuning", "reporting"])
def test_every_unknown_effect_is_seen(split: str) -> None:
    setting = camera._setting((), np.random.default_rng(3), common=True)
    for kind in UNKNOWN[split]:
        truth = camera.with_unknown(setting, camera.CameraTruth(), kind, np.random.default_rng(4))
        assert camera._difference(setting, truth, camera.CameraTruth()) >= 2 * camera.MILD, kind.__name__
