"""A tilted base as a fit has it: what gravity puts on the joints is linear in gravity."""

import math
from collections.abc import Sequence

import numpy as np

from vision_s2r.arm.effect import BASE_TILT, tilted

KNOWN = ((math.pi / 2, 0.0), (0.0, math.pi / 2), (math.pi, 0.0))  # rad: about two axes, and upside down

MUCH = 0.05  # rad


class BaseTiltForm:
    """Weights under gravity in three other directions say what they are in any."""

    name: str = BASE_TILT
    known: Sequence[dict[str, float]] = tuple({"roll": roll, "pitch": pitch} for roll, pitch in KNOWN)
    start: Sequence[float] = (0.0, 0.0)
    scale: Sequence[float] = (MUCH, MUCH)
    low: Sequence[float] = (-math.pi / 2, -math.pi / 2)

    def __init__(self, gravity: np.ndarray) -> None:
        """Of a model with this gravity [3] (m/s²), not zero."""
        self._gravity = gravity
        self._inverse = np.linalg.inv(np.array([tilted(gravity, *angles) - gravity for angles in KNOWN]).T)

    def values(self, point: np.ndarray) -> dict[str, float]:
        """Angles (rad)."""
        return {"roll": float(point[0]), "pitch": float(point[1])}

    def weights(self, values: dict[str, float]) -> np.ndarray:
        """Of the known directions [3]."""
        return np.asarray(self._inverse @ (tilted(self._gravity, values["roll"], values["pitch"]) - self._gravity))

    def far(self, values: dict[str, float]) -> Sequence[float]:
        """In units of what is much."""
        return [angle / MUCH for angle in values.values()]

    def change(self, values: dict[str, float]) -> np.ndarray:
        """The point is the angles."""
        return np.eye(2)
