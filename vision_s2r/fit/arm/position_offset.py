"""An encoder's zero in an arm, as a fit has it: all joints feel that its bodies are turned from where they seem.

What bodies put on joints is a sum of five waves in the angle of one hinge: one, its sine and cosine, those of twice it.
"""

from collections.abc import Sequence

import numpy as np

from vision_s2r.arm.effect import OFFSET

KNOWN = (-1.2, -0.5, 0.5, 1.2)  # rad
MUCH = 0.1  # rad


class PositionOffsetForm:
    """Loads with four other zeros of a hinge say what they are with any."""

    known: Sequence[dict[str, float]] = tuple({"value": angle} for angle in KNOWN)
    start: Sequence[float] = (0.0,)
    scale: Sequence[float] = (MUCH,)
    low: Sequence[float] = (-np.pi / 2,)

    def __init__(self, joint: str) -> None:
        self.name = f"{joint}.{OFFSET}"
        self._inverse = np.linalg.inv(np.array([_waves(angle) for angle in KNOWN]))

    def values(self, point: np.ndarray) -> dict[str, float]:
        """By how much the encoder shows more (rad)."""
        return {"value": float(point[0])}

    def weights(self, values: dict[str, float]) -> np.ndarray:
        """Of the known zeros [4]."""
        return np.asarray(_waves(values["value"]) @ self._inverse)

    def far(self, values: dict[str, float]) -> Sequence[float]:
        """In units of what is much."""
        return [values["value"] / MUCH]

    def change(self, values: dict[str, float]) -> np.ndarray:
        """The point is the angle."""
        return np.eye(1)


def _waves(angle: float) -> np.ndarray:
    """What four waves differ by from where there is no offset."""
    return np.array([np.sin(angle), np.cos(angle) - 1, np.sin(2 * angle), np.cos(2 * angle) - 1])
