"""Discrepancy terms: forces and a friction that no effect of the library is, so that combinations need not mimic them.

(Kennedy and O'Hagan, Journal of the Royal Statistical Society B 63, 2001.)
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from vision_s2r.fit.contact.windows import ContactTrack

STRONG = 3.0  # m/s²: a force of a term that would be plainly visible, and as sure as nothing is known of it
UNEVEN = 0.5  # of a friction that depends on direction, likewise
MEANINGS = {
    "force_of_place": "a force that depends on where the body is: its height, or its place on the support",
    "force_of_speed": "a force that depends on the body's speed",
    "force_of_time": "a force that depends on the time since the start of an episode",
    "friction_of_direction": "a friction that depends on the direction of sliding",
}
HEIGHTS, SPEEDS, TIMES = 4, 3, 4  # knots


@dataclass(frozen=True)
class Term:
    """One term: where it stands in `Terms`, and its coefficients."""

    name: str
    part: dict[str, Any]  # arguments of Terms
    scale: np.ndarray  # [size] of a coefficient that would be plainly visible

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return len(self.scale)


def terms_of(track: ContactTrack) -> dict[str, Term]:
    """The terms for a recording, in the order of their coefficients in a machine's row."""
    speed = float(np.nanquantile(np.linalg.norm(track.states.state[..., 7:10], axis=-1), 0.98)) or 1.0
    middle = np.nanmean(track.position[..., :2], axis=(0, 1))
    spread = max(float(np.nanstd(track.position[..., :2])), 1e-3)
    height = max(0.1 * track.shape.depth, 2 * track.states.noise[0])
    duration = float(track.lengths.max()) * track.sample_time
    full = np.full
    return {
        "force_of_place": Term(
            "force_of_place",
            {"height": (height, HEIGHTS), "place": (float(middle[0]), float(middle[1]))},
            np.concatenate([full(HEIGHTS, STRONG), full(4, STRONG / spread)]),
        ),
        "force_of_speed": Term("force_of_speed", {"speed": (speed, SPEEDS)}, full(SPEEDS + 2, STRONG)),
        "force_of_time": Term("force_of_time", {"time": (duration, TIMES)}, full(3 * TIMES, STRONG)),
        "friction_of_direction": Term("friction_of_direction", {"direction": True}, full(4, UNEVEN)),
    }
