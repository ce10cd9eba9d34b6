"""Cameras of other makers: by what kernel one looks between pixels, and by what curve it codes light, is no effect."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.fit.camera.test_camera_case import EVERY, FRAMES, opened, recorded, scenes
from vision_s2r.camera import Camera, CameraParameters
from vision_s2r.fit.camera.resampling import resampled
from vision_s2r.recording.data import CameraRecording


def seen(real: torch.Tensor) -> CameraRecording:
    """Pairs with these real pictures [N, 3, H, W], with half a grey level of noise, rounded."""
    noise = torch.randn(real.shape, generator=torch.Generator().manual_seed(1)) * 0.5 / 255
    pictures = ((real + noise).clamp(0, 1) * 255).round().permute(0, 2, 3, 1).numpy() / np.float32(255)
    return replace(recorded(), real=pictures)


def sim() -> torch.Tensor:
    return (scenes() * 255).round() / 255


@pytest.mark.parametrize("length, angle", [(3.4, -25.0), (1.05, 43.0)])
def test_a_path_between_pixels_by_another_kernel_is_no_defocus(length: float, angle: float) -> None:
    blurred = {"motion_blur": {"length": length, "angle": angle}}
    case = opened(seen(Camera(interpolation="bilinear")(sim(), CameraParameters.of(blurred, FRAMES))))
    fitted = case.fit(frozenset({"motion_blur"}), EVERY, None)
    assert fitted.values["motion_blur"]["length"] == pytest.approx(length, rel=0.02)
    assert case.excess(fitted, EVERY).mean() < 1.1
    both = case.fit(frozenset({"motion_blur", "defocus_blur"}), EVERY, None)
    assert case.negligible(both, "defocus_blur")


def test_a_slight_turn_by_another_kernel_is_no_defocus() -> None:
    turned = {"camera_pose_offset": {"yaw": 0.004, "pitch": 0.005, "roll": 0.002}}
    case = opened(seen(Camera(interpolation="bilinear")(sim(), CameraParameters.of(turned, FRAMES))))
    fitted = case.fit(frozenset({"camera_pose_offset"}), EVERY, None)
    assert fitted.values["camera_pose_offset"]["yaw"] == pytest.approx(0.004, rel=0.02)
    assert case.excess(fitted, EVERY).mean() < 1.1


@pytest.mark.slow
def test_an_interval_holds_for_a_path_that_is_sampled_otherwise() -> None:
    """Both of its ends count in full: it varies by a twentieth more than an even one."""
    length, angle = 1.6, math.radians(-25.0)
    y, x = torch.meshgrid(torch.arange(64.0), torch.arange(64.0), indexing="ij")
    places = [(x + t * math.cos(angle), y + t * math.sin(angle)) for t in np.linspace(-0.5, 0.5, 40) * length]
    blurred = torch.stack([resampled(sim(), to_x[None], to_y[None], "bilinear") for to_x, to_y in places]).mean(0)
    case = opened(seen(blurred))
    fitted = case.fit(frozenset({"motion_blur"}), EVERY, None)
    low, high = case.intervals(fitted)["motion_blur"]["length"]
    assert low < length < high < 1.1 * length


@pytest.mark.parametrize("labelled", [False, True])
def test_light_through_a_plain_power_is_no_second_effect(labelled: bool) -> None:
    y, x = np.mgrid[-1:1:64j, -1:1:64j]
    shade = torch.from_numpy(1 - 0.7 * (x**2 + y**2) / 2).float()
    recording = seen((sim() ** 2.2 * shade) ** (1 / 2.2))
    labels = np.tile(x > 0, (FRAMES, 1, 1)).astype(np.int64)
    case = opened(replace(recording, labels=labels) if labelled else recording)
    fitted = case.fit(frozenset({"vignetting"}), EVERY, None)
    assert fitted.values["vignetting"]["strength"] == pytest.approx(0.7, rel=0.004)
    assert case.excess(fitted, EVERY).mean() < 0.5


def test_what_an_effect_changes_it_may_change_a_little_otherwise() -> None:
    case = opened(recorded(exposure={"stops": 0.8}))
    assert case.allowance > 0.3 and opened(recorded()).allowance < 0.01
