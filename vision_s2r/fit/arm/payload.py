"""A payload as a fit has it: what a point mass puts on the joints is m·(a + b·r + r⊤·C·r), by functions of the motion.

Mass and first moments are fitted, which gravity shows.
"""

from collections.abc import Sequence

import numpy as np

from vision_s2r.arm.effect import PAYLOAD

REACH = 0.1  # m, of the places that are tried
AXES = np.eye(3)
PLACES = np.array([np.zeros(3), *AXES, *-AXES, AXES[0] + AXES[1], AXES[1] + AXES[2], AXES[2] + AXES[0]]) * REACH
FARTHEST = 1.0  # m from the last body's origin, which is far
START, LEAST = 0.05, 1e-5  # kg
NAMES = ("mass", "x", "y", "z")


class PayloadForm:
    """A mass at ten places says what any mass does at any place."""

    name: str = PAYLOAD
    known: Sequence[dict[str, float]] = tuple(
        dict(zip(NAMES, (1.0, *map(float, place)), strict=True)) for place in PLACES
    )
    start: Sequence[float] = (START, 0.0, 0.0, 0.0)
    scale: Sequence[float] = (START, START * REACH, START * REACH, START * REACH)
    low: Sequence[float] = (LEAST, -np.inf, -np.inf, -np.inf)

    def __init__(self) -> None:
        self._inverse = np.linalg.inv(np.array([_monomials(place) for place in PLACES]))

    def values(self, point: np.ndarray) -> dict[str, float]:
        """Mass (kg), and where it is (m)."""
        return dict(zip(NAMES, (float(point[0]), *(float(x) for x in point[1:] / point[0])), strict=True))

    def weights(self, values: dict[str, float]) -> np.ndarray:
        """Of the known places [10]."""
        place = np.array([values[name] for name in NAMES[1:]])
        return np.asarray(values["mass"] * _monomials(place) @ self._inverse)

    def far(self, values: dict[str, float]) -> Sequence[float]:
        """In units of what is far."""
        return [values[name] / FARTHEST for name in NAMES[1:]]

    def change(self, values: dict[str, float]) -> np.ndarray:
        """Of mass and place by mass and moments: dr = (d(m·r) − r·dm)/m."""
        change = np.eye(4) / values["mass"]
        change[:, 0] = [1.0, *(-values[name] / values["mass"] for name in NAMES[1:])]
        return change


def _monomials(place: np.ndarray) -> np.ndarray:
    x, y, z = place
    return np.array([1.0, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x])
