"""Grain: as strong and as coarse as it was drawn, whatever frames take of it with their means."""

import math

import cv2
import numpy as np
import pytest
import torch

from vision_s2r.fit.camera.grain import grain_of

FRAMES, SIZE, SIDE, MARGIN, SCALE = 8, 128, 70, 36, 8.0


def test_coarse_grain_of_a_small_label_is_found_without_bias() -> None:
    rng = np.random.default_rng(2)
    region = torch.zeros(FRAMES, 1, SIZE, SIZE)
    region[:, :, 20 : 20 + SIDE, 20 : 20 + SIDE] = 1
    mean = torch.full((FRAMES, 3, SIZE, SIZE), 0.4)

    def field() -> np.ndarray:
        white = rng.standard_normal((SIZE + 2 * MARGIN, SIZE + 2 * MARGIN))
        whole = cv2.GaussianBlur(white, (0, 0), SCALE / 2) * SCALE * math.sqrt(math.pi)
        return whole[MARGIN:-MARGIN, MARGIN:-MARGIN]

    found = []
    for _ in range(24):
        drawn = torch.from_numpy(np.stack([field() for _ in range(FRAMES)])).float()[:, None]
        grain = grain_of(0.1 * mean * region * drawn, mean, region, torch.ones_like(region, dtype=torch.bool), "linear")
        assert grain is not None
        found.append((grain.amplitude / 0.1, grain.scale / SCALE))
    assert np.mean(found, axis=0) == pytest.approx([1.0, 1.0], abs=0.022)


def test_what_a_filter_takes_of_a_print_is_no_grain() -> None:
    """It lies where the print is, on two thirds of the label; a grain lies everywhere."""
    rng = np.random.default_rng(3)
    whole, counted = torch.ones(FRAMES, 1, SIZE, SIZE), torch.ones(FRAMES, 1, SIZE, SIZE, dtype=torch.bool)

    def field(scale: float) -> np.ndarray:
        drawn = [cv2.GaussianBlur(rng.standard_normal((SIZE, SIZE)), (0, 0), scale) for _ in range(FRAMES)]
        return np.stack(drawn).astype(np.float32)

    printed = 0.4 + 0.3 * field(1.5)
    printed[:, :, 2 * SIZE // 3 :] = 0.4
    filtered = np.stack([cv2.GaussianBlur(each, (0, 0), 1.5) for each in printed])
    mean = torch.from_numpy(printed)[:, None].expand(-1, 3, -1, -1)
    assert grain_of(torch.from_numpy(filtered)[:, None] - mean, mean, whole, counted, "linear") is None
    grain = 0.5 * torch.from_numpy(field(2.0))[:, None]
    found = grain_of(mean * grain, mean, whole, counted, "linear")
    assert found is not None and found.amplitude == pytest.approx(float(grain.std()), rel=0.1)
