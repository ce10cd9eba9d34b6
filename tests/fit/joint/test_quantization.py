"""The steps of an encoder, from positions alone."""

import numpy as np
import pytest

from vision_s2r.fit.joint.quantization import find_quantization_grid

STEP = 0.000657


def positions(motion: np.ndarray, noise: float) -> np.ndarray:
    """As an encoder counts them [1, T]; motion and noise in steps."""
    shaken = motion + noise * np.random.default_rng(3).normal(size=motion.shape)
    return STEP * (765 + np.round(shaken))[None]


@pytest.mark.parametrize("steps", [3, 40])
def test_a_joint_that_hardly_moves_counts_whole_steps(steps) -> None:
    """Half steps would do for four levels as well, were it not that none is ever passed by half."""
    seen = positions(steps * np.sin(np.linspace(0, 6, 5000)) ** 2, 0.2)
    grid = find_quantization_grid(seen, np.array([seen.shape[1]]))
    assert grid is not None and grid.resolution == pytest.approx(STEP) and grid.offset == 0
