"""Shot and read noise are measured: from flat fields, with photon transfer as EMVA 1288 has it for a check."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.fit.camera.test_camera_case import opened
from vision_s2r.camera.colour import to_coded, to_linear
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.fit.camera.flat_fields import noise_of
from vision_s2r.fit.case import Hypothesis
from vision_s2r.recording.data import CameraRecording

FRAMES, SIZE = 10, 80


def flats(
    full_well: float, read: float, bits: int, linear: bool, uneven: float, darkest: float = 0.02
) -> tuple[CameraRecording, np.ndarray]:
    """Grey flat fields of ten exposures, electrons one by one, pixels of gains of their own; and the light [N]."""
    rng = np.random.default_rng(3)
    light = np.linspace(darkest, 0.8, FRAMES)
    own = light[:, None, None] * rng.normal(1, uneven, (SIZE, SIZE))
    seen = rng.poisson(own * full_well) / full_well + rng.normal(0, read, own.shape)

    def stored(values: np.ndarray) -> np.ndarray:
        values = values.clip(0, 1)
        values = values if linear else to_coded(torch.from_numpy(values)).numpy()
        whole = np.rint(values * (2**bits - 1)) / (2**bits - 1)
        return np.broadcast_to(whole[..., None], (FRAMES, SIZE, SIZE, 3)).astype(np.float32)

    sim = np.broadcast_to(light[:, None, None], own.shape)
    names = tuple(f"{k}" for k in range(FRAMES))
    encoding = "linear" if linear else "srgb"
    recording = CameraRecording(
        "paired", encoding, stored(sim), stored(seen), None, None, None, bits, True, names, names
    )
    return recording, light


def transferred(recording: CameraRecording, light: np.ndarray) -> float:
    """The full well by photon transfer: the slope of the variance of differences of neighbors over the light."""
    values = recording.real[..., 0].astype(float)
    if recording.encoding == "srgb":
        values = to_linear(torch.from_numpy(values)).numpy()
    variance = np.diff(values, axis=2)[:, :, ::2].var(axis=(1, 2)) / 2
    return float(1 / np.polyfit(light, variance, 1)[0])


@pytest.mark.parametrize(
    ("full_well", "read", "bits", "linear"),
    [(14_628.0, 0.0, 16, True), (2_000.0, 0.0, 8, False), (2_000.0, 0.01, 8, True)],
)
def test_flat_fields_tell_the_full_well_and_the_read_noise(
    full_well: float, read: float, bits: int, linear: bool
) -> None:
    recording, light = flats(full_well, read, bits, linear, 0.0)
    case = opened(recording)
    names = frozenset({"shot_noise"} | ({"read_noise"} if read else set()))
    assert all(proposal & {"shot_noise", "read_noise"} == names for proposal in case.proposals())
    found = case.fit(names, range(FRAMES), None).values
    assert found["shot_noise"]["full_well"] == pytest.approx(full_well, rel=0.03)
    assert transferred(recording, light) == pytest.approx(full_well, rel=0.06)
    if read:
        assert found["read_noise"]["sigma"] == pytest.approx(read, rel=0.05)


def test_what_pixels_have_in_all_frames_is_no_noise() -> None:
    case = opened(flats(15_000.0, 0.0, 16, True, 0.008)[0])
    found = case.fit(frozenset({"shot_noise"}), range(FRAMES), None).values
    assert found["shot_noise"]["full_well"] == pytest.approx(15_000, rel=0.04)


@pytest.mark.slow
def test_a_sensor_of_uneven_pixels_in_unsteady_light_has_its_full_well_and_read_noise() -> None:
    recording, _ = flats(12_000.0, 0.0009, 16, True, 0.01, darkest=0.005)
    rng = np.random.default_rng(5)
    unsteady = recording.real * rng.normal(1, 0.003, (FRAMES, 1, 1, 1)) + 0.001
    report = diagnose(replace(recording, real=unsteady.astype(np.float32)))
    found = {effect.name: effect for effect in report.effects}
    assert report.verdict == "partly_explained"
    assert found.keys() == {"read_noise", "shot_noise"}
    assert found["shot_noise"].parameters["full_well"].value == pytest.approx(12_000, rel=0.03)
    assert found["read_noise"].parameters["sigma"].value == pytest.approx(0.0009, rel=0.15)  # one dark frame tells it


def test_one_dark_frame_among_bright_ones_has_its_noise() -> None:
    recording, light = flats(12_000.0, 0.0009, 16, True, 0.01, darkest=0.005)
    light = torch.tensor([light[0], *[light[-1]] * (FRAMES - 1)])
    residual = recording.real[[0, *[-1] * (FRAMES - 1)]][..., 0] - light[:, None, None].numpy()
    noise = noise_of(torch.from_numpy(residual)[:, None].float(), light[:, None, None, None].expand(-1, 1, SIZE, SIZE))
    assert float(noise[0].std()) == pytest.approx(np.sqrt(0.005 / 12_000 + 0.0009**2), rel=0.05)


def test_rows_of_a_frame_are_no_read_noise() -> None:
    recording, _ = flats(12_000.0, 0.0, 16, True, 0.0)
    assert opened(recording).measured.keys() == {"shot_noise"}
    rows = np.random.default_rng(6).normal(0, 0.002, (FRAMES, SIZE, 1, 1)).astype(np.float32)
    assert not opened(replace(recording, real=recording.real + rows)).measured


def test_what_noise_leaves_of_black_is_no_light_of_a_frames_own() -> None:
    case = opened(flats(2_000.0, 0.00545, 8, False, 0.0, darkest=0.0)[0])
    assert not case.unsteady
    found = case.fit(frozenset({"shot_noise", "read_noise"}), range(FRAMES), None).values
    assert found["shot_noise"]["full_well"] == pytest.approx(2_000, rel=0.03)
    assert found["read_noise"]["sigma"] == pytest.approx(0.00545, rel=0.03)


@pytest.mark.slow
def test_an_offset_of_black_leaves_shot_noise_its_name() -> None:
    recording, _ = flats(10_000.0, 0.0, 16, True, 0.0, darkest=0.0)
    report = diagnose(replace(recording, real=(recording.real + np.float32(0.016)).clip(0, 1)))
    assert report.verdict == "partly_explained"
    assert [effect.name for effect in report.effects] == ["shot_noise"]
    assert report.effects[0].parameters["full_well"].value == pytest.approx(10_000, rel=0.06)


def test_a_blur_that_only_takes_the_rounding_off_slopes_is_none() -> None:
    rng = np.random.default_rng(4)
    lowest = np.linspace(0.2, 0.6, FRAMES)[:, None, None]
    slopes = np.broadcast_to(lowest + 0.25 * np.linspace(0, 1, SIZE), (FRAMES, SIZE, SIZE))
    noisy = slopes + rng.normal(0, 2 / 255, slopes.shape)
    sim, real = (
        np.broadcast_to(np.rint(each * 255)[..., None] / 255, (FRAMES, SIZE, SIZE, 3)).astype(np.float32)
        for each in (slopes, noisy)
    )
    case = opened(replace(flats(2_000.0, 0.0, 8, False, 0.0)[0], sim=sim, real=real))
    values = {"defocus_blur": {"radius": 2.5}, "shot_noise": {"full_well": 5_000.0}, "read_noise": {"sigma": 0.004}}
    assert case.negligible(Hypothesis(values), "defocus_blur")
