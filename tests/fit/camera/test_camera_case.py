"""The camera's case: what a recording is said to show, and what not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch

from vision_s2r.appearance import PICTURE_EFFECTS
from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraParameters
from vision_s2r.diagnose.saved import write_next
from vision_s2r.fit.camera import discrepancy
from vision_s2r.fit.camera.case import CameraCase
from vision_s2r.fit.camera.coordinates import pack, unpack
from vision_s2r.fit.camera.discrepancy import FittedDiscrepancy, add
from vision_s2r.fit.camera.effect import CAMERA_FITS
from vision_s2r.fit.camera.ghost import Ghost, find_ghost, shifted
from vision_s2r.fit.camera.noise import Tail
from vision_s2r.fit.camera.quantization import jpeg_quality
from vision_s2r.fit.camera.smoothing import cosines
from vision_s2r.fit.case import Hypothesis
from vision_s2r.recording.data import CameraRecording

FRAMES, SIZE = 6, 64


def scenes(seed: int = 0) -> torch.Tensor:
    """Discs and bars of many colours on slopes, [N, 3, H, W] in [0, 1]."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE
    pictures = []
    for _ in range(FRAMES):
        picture = rng.uniform(0.2, 0.8, 3) + 0.3 * (x[..., None] - 0.5) * rng.uniform(-1, 1, 3)
        for _ in range(14):
            u, v, radius = rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(0.05, 0.2)
            inside = np.clip((radius - np.hypot(x - u, (y - v) * rng.uniform(0.5, 2))) * SIZE + 0.5, 0, 1)[..., None]
            picture = picture * (1 - inside) + inside * rng.uniform(0.03, 0.97, 3)
        pictures.append(picture)
    return torch.from_numpy(np.stack(pictures)).permute(0, 3, 1, 2).float().clamp(0, 1)


def recorded(grey: bool = False, seed: int = 0, **effects: dict[str, float]) -> CameraRecording:
    """Pairs whose real pictures the camera made, with half a grey level of noise, rounded."""
    generator = torch.Generator().manual_seed(seed)
    sim = (scenes(seed) * 255).round() / 255
    if grey:
        sim = sim.mean(1, keepdim=True).mul(255).round().div(255).expand(-1, 3, -1, -1)
    real = Camera()(sim, CameraParameters.of(effects, FRAMES))
    noise = torch.randn(real.shape, generator=generator)[:, : 1 if grey else 3].expand_as(real)
    if "jpeg_compression" not in effects:
        real = (real + 0.5 / 255 * noise).clamp(0, 1)
    real = (real * 255).round() / 255
    names = tuple(f"{k:04d}" for k in range(FRAMES))
    pair = (each.permute(0, 2, 3, 1).numpy() for each in (sim, real))
    return CameraRecording("paired", "srgb", *pair, None, None, None, 8, grey, names, names)


def opened(recording: CameraRecording, *withheld: str) -> CameraCase:
    return CameraCase.open(recording, {effect.name: effect for effect in CAMERA_EFFECTS if effect.name not in withheld})


EVERY = range(FRAMES)


def test_a_black_frame_shows_nothing_and_breaks_nothing() -> None:
    recording = recorded(exposure={"stops": 0.4})
    lit = np.arange(FRAMES)[:, None, None, None] > 0
    case = opened(replace(recording, sim=recording.sim * lit, real=recording.real * lit))
    low, high = case.intervals(case.fit(frozenset({"exposure"}), EVERY, None))["exposure"]["stops"]
    assert low < 0.4 < high and high - low < 0.1


def test_two_effects_are_proposed_fitted_to_the_floor_and_bounded() -> None:
    case = opened(recorded(vignetting={"strength": 0.4}, defocus_blur={"radius": 1.6}))
    names = frozenset({"vignetting", "defocus_blur"})
    assert names in case.proposals()
    fitted = case.fit(names, EVERY, None)
    assert fitted.values["vignetting"]["strength"] == pytest.approx(0.4, rel=0.02)
    assert fitted.values["defocus_blur"]["radius"] == pytest.approx(1.6, rel=0.02)
    assert case.excess(fitted, EVERY).mean() < 1.1
    alone = case.fit(frozenset({"defocus_blur"}), EVERY, None)
    assert case.excess(alone, EVERY).mean() > 2
    assert sum(blocks.sum() for blocks in case.loglik(fitted, EVERY)) > sum(
        blocks.sum() for blocks in case.loglik(alone, EVERY)
    )
    low, high = case.intervals(fitted)["vignetting"]["strength"]
    assert low < 0.4 < high and high - low < 0.1


def test_a_null_is_at_its_floor_and_nothing_is_certain() -> None:
    case = opened(recorded())
    nominal = case.fit(frozenset(), EVERY, None)
    assert case.excess(nominal, EVERY).mean() < 1.1 and not case.certain
    assert case.error(nominal, EVERY) == pytest.approx(case.floor(EVERY), rel=0.15)
    assert case.negligible(case.fit(frozenset({"vignetting"}), EVERY, None), "vignetting")


def test_noise_counts_in_the_gap_and_is_measured_by_brightness() -> None:
    case = opened(recorded(read_noise={"sigma": 0.02}))
    nominal, noisy = (case.fit(frozenset(names), EVERY, None) for names in ((), ("read_noise",)))
    assert noisy.values["read_noise"]["sigma"] == pytest.approx(0.02, rel=0.05)
    assert case.excess(nominal, EVERY).mean() > 1.3 > 1.1 > case.excess(noisy, EVERY).mean()
    assert case.error(nominal, EVERY).mean() > 1.3 * case.error(noisy, EVERY).mean()
    shot = case.fit(frozenset({"shot_noise"}), EVERY, None)
    assert case.excess(shot, EVERY).mean() > case.excess(noisy, EVERY).mean()


def test_the_quality_of_jpeg_is_certain_and_exact() -> None:
    case = opened(recorded(jpeg_compression={"quality": 37.0}))
    assert case.certain["jpeg_compression"] > 100
    assert case.fit(frozenset({"jpeg_compression"}), EVERY, None).values["jpeg_compression"]["quality"] == 37


@pytest.mark.parametrize(("name", "values"), [("shot_noise", {"full_well": 1300.0}), ("read_noise", {"sigma": 0.01})])
def test_noise_behind_jpeg_is_as_strong_as_it_was_before_it(name: str, values: dict[str, float]) -> None:
    case = opened(recorded(jpeg_compression={"quality": 80.0}, **{name: values}))
    quiet, noisy = (case.fit(frozenset({"jpeg_compression", *names}), EVERY, None) for names in ((), (name,)))
    assert noisy.values[name] == pytest.approx(values, rel=0.15)
    assert case.excess(noisy, EVERY).mean() < 1.1 < 1.2 < case.excess(quiet, EVERY).mean()


def test_clean_pictures_have_no_lattice() -> None:
    assert jpeg_quality(recorded(gamma={"gamma": 1.4}).real) is None


@pytest.mark.slow
def test_an_interval_of_read_noise_holds_whatever_else_is_noise() -> None:
    case = opened(recorded(read_noise={"sigma": 0.006}))  # beside half a grey level that has no name
    low, high = case.intervals(case.fit(frozenset({"read_noise"}), EVERY, None))["read_noise"]["sigma"]
    assert low < 0.006 < high < 1.2 * 0.006


def test_grey_pictures_are_silent_about_colour() -> None:
    case = opened(recorded(grey=True, exposure={"stops": -0.5}))
    assert {"white_balance", "chromatic_aberration"} <= case.not_excited.keys()
    assert "colour_mixing" not in case.discrepancies
    fitted = case.fit(frozenset({"exposure"}), EVERY, None)
    assert fitted.values["exposure"]["stops"] == pytest.approx(-0.5, abs=0.01)


def test_an_unknown_is_better_told_by_a_discrepancy_than_by_any_effect() -> None:
    recording = recorded()
    mixed = recording.real @ np.array([[0.8, 0.1, 0.1], [0.2, 0.7, 0.1], [0.0, 0.25, 0.75]], np.float32).T
    changed = CameraRecording(**(recording.__dict__ | {"real": np.round(mixed * 255) / np.float32(255)}))
    case = opened(changed)
    scores = {
        name: sum(blocks.sum() for blocks in case.loglik(case.fit(frozenset({name}), EVERY, None), EVERY))
        for name in (*case.discrepancies, "white_balance", "gamma", "exposure")
    }
    assert max(scores, key=lambda name: scores[name]) == "colour_mixing"


def test_where_finds_a_vignette_at_the_rim() -> None:
    case = opened(recorded(vignetting={"strength": 0.5}))
    samples = case.samples(case.fit(frozenset(), EVERY, None))
    radius = next(axis for axis in samples.axes if axis.name == "radius")
    over = samples.error - samples.floor
    mean = [over[radius.bins == k].mean() for k in range(len(radius.labels))]
    assert mean[-1] > 10 * mean[0]


def test_ghosts_are_found_where_they_are() -> None:
    pictures = scenes(3)
    for turned in (False, True):
        residual = 0.2 * shifted(pictures.flip(-2, -1) if turned else pictures, 9, -4)
        assert find_ghost(residual, pictures, torch.ones(FRAMES, 1, SIZE, SIZE)) == Ghost(9, -4, turned)


@pytest.mark.parametrize("name", ["gain_field", "added_light"])
def test_a_smooth_unknown_adds_what_it_was_fitted_with(name: str) -> None:
    mean = scenes(3)
    carrier = mean if name == "gain_field" else torch.ones_like(mean)
    waves = [carrier * wave for wave in cosines(SIZE, SIZE, 5)]
    coefficients = np.random.default_rng(0).normal(size=len(waves))
    wanted = sum((float(c) * wave for c, wave in zip(coefficients, waves, strict=True)), torch.zeros_like(mean))
    found = add(name, FittedDiscrepancy(coefficients), mean, mean, torch.ones_like(mean))
    torch.testing.assert_close(found, wanted, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize(
    ("name", "count", "size"), [("kernel", 24, 0.01), ("kernel_field", 120, 0.01), ("displacement", 72, 0.1)]
)
def test_an_unknown_is_fitted_with_what_it_adds(name: str, count: int, size: float) -> None:
    mean = scenes(3)
    weight = torch.full_like(mean, 255.0**2)
    coefficients = np.random.default_rng(0).normal(size=count) * size
    wanted = add(name, FittedDiscrepancy(coefficients), mean, mean, weight)
    found = add(name, discrepancy.fit(name, wanted, mean, weight), mean, wanted, weight)
    assert float((found - wanted).square().mean()) < 1e-4 * float(wanted.square().mean())


@pytest.mark.parametrize("name", ["gain_field", "tone_curve", "row_pattern"])
def test_an_unknown_forgives_single_pixels(name: str) -> None:
    """Salt on an otherwise right picture is no field, no curve and no pattern."""
    mean, generator = scenes(3), torch.Generator().manual_seed(0)
    residual = torch.randn(mean.shape, generator=generator) / 255
    residual[torch.rand(mean.shape, generator=generator) < 0.01] = 0.5
    weight = torch.full_like(mean, 255.0**2)
    added = add(name, discrepancy.fit(name, residual, mean, weight), mean, residual, weight)
    assert 255 * added.square().mean().sqrt() < 0.2


@pytest.mark.parametrize(("name", "frames"), [("row_pattern", 0.0), ("row_noise", 1.0)])
def test_rows_have_gains_of_their_own_and_light_that_falls_off_is_none(name: str, frames: float) -> None:
    mean = scenes(3)
    weight, place = torch.full_like(mean, 255.0**2), torch.arange(SIZE)[:, None]
    sign = (-1.0) ** (frames * torch.arange(FRAMES))[:, None, None, None]  # the same rows, or others, in each frame

    def taken(gain: torch.Tensor) -> float:
        residual = gain * mean
        added = add(name, discrepancy.fit(name, residual, mean, weight), mean, residual, weight)
        return 1 - float((residual - added).square().sum() / residual.square().sum())

    assert taken(0.2 * sign * ((place % 16 < 8).float() - 0.5)) > 0.9
    assert taken(0.2 * (place / SIZE - 0.5)) < 0.1


def test_a_tilt_within_what_a_lens_may_do_otherwise_is_none() -> None:
    case = opened(recorded(lens_distortion={"k1": -0.3, "k2": 0.0}))

    def slight(name: str, pitch: float, k1: float = -0.3) -> bool:
        values = {"lens_distortion": {"k1": k1, "k2": 0.0}, "camera_pose_offset": {"yaw": 0, "pitch": pitch, "roll": 0}}
        return case.negligible(Hypothesis(values), name)

    assert slight("camera_pose_offset", 0.001) and not slight("camera_pose_offset", 0.02)
    assert not slight("camera_pose_offset", 0.001, k1=-0.01)
    assert not slight("lens_distortion", 0.02)


def test_rivals_are_told_apart_by_a_target_that_can_be_printed(tmp_path) -> None:
    case = opened(recorded(defocus_blur={"radius": 1.2}))
    rivals = [
        Hypothesis({"defocus_blur": {"radius": 1.2}}),
        Hypothesis({"motion_blur": {"length": 3.0, "angle": 0.0}}),
    ]
    found = case.experiment(rivals, [])
    write_next(found, tmp_path)
    printed = cv2.imread(str(tmp_path / "next_recording.png"), cv2.IMREAD_UNCHANGED)
    assert printed.shape == (8 * SIZE, 8 * SIZE) and np.ptp(printed) > 150
    assert "next_recording.png" in found.sentence
    poses = np.genfromtxt(tmp_path / "next_recording.csv", delimiter=",", names=True)
    assert len(poses) == 16 and len(np.unique(poses[["x", "y", "z", "pitch", "yaw", "roll"]])) == 16
    assert case.experiment(rivals[:1], []).target is None


def test_rivals_that_differ_off_the_middle_ask_for_a_target_that_reaches_there() -> None:
    case = opened(recorded(lens_distortion={"k1": -0.3, "k2": 0.0}))
    rivals = [Hypothesis({"lens_distortion": {"k1": k1, "k2": 0.0}}) for k1 in (-0.3, -0.2)]
    asked = case.experiment(rivals, []).commands
    middle = (asked["x"] == 0) & (asked["y"] == 0)
    assert middle.mean() < 0.3


def test_coordinates_of_every_effect_come_back() -> None:
    for name in [name for name, fit in CAMERA_FITS.items() if fit.chart]:
        values = {name: PICTURE_EFFECTS[name].moderate()}
        back = unpack(pack(values, [name]), [name])
        assert back[name] == pytest.approx(values[name])


def test_torch_keeps_its_threads() -> None:
    before = torch.get_num_threads()
    torch.set_num_threads(before + 1)
    try:
        case = opened(recorded(exposure={"stops": 0.5}))
        with case.session():
            assert torch.get_num_threads() == 1
            case.fit(frozenset({"exposure"}), EVERY, None)
        assert torch.get_num_threads() == before + 1
    finally:
        torch.set_num_threads(before)


def test_the_mean_and_spread_of_noise_are_those_of_its_draws() -> None:
    values = {"read_noise": {"sigma": 0.05}, "gamma": {"gamma": 1.5}, "shot_noise": {"full_well": 200.0}}
    flat = torch.full((1, 3, 200, 200), 0.15)
    tail = Tail.of(values, "srgb", 3)
    mean, variance = tail.mean(flat), tail.variance(flat)
    drawn = Camera()(flat, CameraParameters.of(values, 1))
    assert variance is not None
    assert float(mean.mean()) == pytest.approx(float(drawn.mean()), abs=0.002)
    assert float(variance.mean().sqrt()) == pytest.approx(float(drawn.std()), rel=0.03)
