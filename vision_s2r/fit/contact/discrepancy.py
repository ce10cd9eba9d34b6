"""Discrepancy terms: forces and a friction that no effect of the library is, so that combinations need not mimic them.

(Kennedy and O'Hagan, Journal of the Royal Statistical Society B 63, 2001.)
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vision_s2r.fit.contact.windows import ContactTrack

STRONG = 3.0  # m/s²: a force of a term that would be plainly visible, and as sure as nothing is known of it
UNEVEN = 0.5  # of a friction that is not the same everywhere, likewise
KNOWN = 1e-4  # of a coefficient that does what an effect does which is there itself
MEANINGS = {
    "force_of_place": "a force that depends on where the body is: its height, or its place on the support",
    "force_of_speed": "a force that depends on the body's speed",
    "force_of_time": "a force that depends on the time since the start of an episode",
    "friction_of_direction": "a friction that depends on the direction of sliding",
    "friction_of_place": "a friction that depends on where the body is on the support",
    "friction_of_speed": "a friction that depends on the speed of sliding",
    "friction_of_time": "a friction that depends on the time since the start of an episode",
}
HEIGHTS, SPEEDS, TIMES, AGES = 4, 3, 4, 3  # knots


@dataclass(frozen=True)
class Term:
    """One term: where it stands in `Terms`, and its coefficients."""

    name: str
    part: dict[str, Any]  # arguments of Terms
    scale: np.ndarray  # [size] of a coefficient that would be plainly visible
    alike: tuple[str, tuple[int, ...]] = ("", ())  # an effect that some of the coefficients do the work of

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
    full, field = np.full, np.array([1, *[1 / spread] * 2, *[1 / spread**2] * 3])
    at, friction = (float(middle[0]), float(middle[1])), ("lateral_friction", (0,))
    terms = (
        Term(
            "force_of_place",
            {"height": (height, HEIGHTS), "place": at},
            STRONG * np.concatenate([np.ones(HEIGHTS), field, field]),
            ("support_tilt", (HEIGHTS, HEIGHTS + len(field))),
        ),
        Term("force_of_speed", {"speed": (speed, SPEEDS)}, full(SPEEDS + 2, STRONG)),
        Term("force_of_time", {"time": (duration, TIMES)}, full(3 * TIMES, STRONG)),
        Term("friction_of_direction", {"direction": True}, full(5, UNEVEN), friction),
        Term("friction_of_place", {"area": at}, UNEVEN * field, friction),
        Term("friction_of_speed", {"sliding": (speed, SPEEDS)}, full(SPEEDS, UNEVEN), friction),
        Term("friction_of_time", {"age": (duration, AGES)}, full(AGES, UNEVEN), friction),
    )
    return {term.name: term for term in terms}


def scales_of(terms: Sequence[Term], effects: Collection[str]) -> np.ndarray:
    """Of the coefficients [size] of terms beside these effects, whose work they leave to them."""
    out = []
    for term in terms:
        scale = term.scale.copy()
        effect, which = term.alike
        if effect in effects:
            scale[list(which)] *= KNOWN
        out.append(scale)
    return np.concatenate([np.zeros(0), *out])
