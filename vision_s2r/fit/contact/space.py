"""The coordinates that a fit moves in: every parameter of a set of effects and terms, in the measure that suits it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vision_s2r.contact import COEFFICIENTS, CONTACT_EFFECTS, Terms, column_of, pack
from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.contact import effects as _effects  # noqa: F401  (fills CONTACT_FITS)
from vision_s2r.fit.contact.discrepancy import MEANINGS, Term, scales_of
from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactScales
from vision_s2r.fit.coordinates import Coordinates, ParameterRange

GRAIN = 2**-20  # of a coordinate's step: points as near as that are one machine, and are run once


@dataclass(frozen=True, kw_only=True)
class ContactCoordinate(ParameterRange):
    """The range of one effect's parameter."""

    effect: str

    @property
    def column(self) -> int:
        """In a machine's row."""
        return column_of(self.effect, self.parameter)


class ContactSpace(Coordinates):
    """The coordinates of a set of names on a track."""

    def __init__(self, names: frozenset[str], scales: ContactScales, terms: Mapping[str, Term]) -> None:
        self.effects = sorted(names - MEANINGS.keys(), key=lambda name: (name not in COEFFICIENTS, name))
        self.coordinates: list[ContactCoordinate] = [
            ContactCoordinate(effect=name, **vars(each.within(CONTACT_EFFECTS[name].parameter(each.parameter))))
            for name in self.effects
            for each in CONTACT_FITS[name].ranges(scales)
        ]
        self.parts = [term for name, term in terms.items() if name in names]
        self.terms = Terms(**{key: value for term in self.parts for key, value in term.part.items()})
        self.nominal, self.base = scales.nominal, pack(scales.nominal, {})
        self.owner = [c.effect for c in self.coordinates] + [t.name for t in self.parts for _ in range(t.size)]
        self.size = len(self.owner)
        scale = scales_of(self.parts, self.effects)

        def column(name: str, of_terms: np.ndarray) -> np.ndarray:
            return np.concatenate([[getattr(c, name) for c in self.coordinates], of_terms])

        self.low, self.high = column("low", -10 * scale), column("high", 10 * scale)
        self.step, self.prior = column("step", 0.03 * scale), column("prior", scale)
        self.centre, self.repeats = np.full(self.size, np.nan), np.ones(self.size)
        # A power of two, so that bounds such as 0 and 1 are on the grid.
        self._grain = np.array([2.0 ** math.floor(math.log2(step * GRAIN)) for step in self.step])

    def of(self, effect: str) -> list[int]:
        """Which coordinates are this effect's parameters."""
        return [k for k, c in enumerate(self.coordinates) if c.effect == effect]

    def start(self, hypothesis: Hypothesis) -> np.ndarray:
        """The point [D] at this hypothesis; a coefficient that it has not is nominal. KeyError for others."""
        values: dict[str, Mapping[str, float]] = {n: {"value": float(getattr(self.nominal, n))} for n in COEFFICIENTS}
        values |= hypothesis.values
        point = [c.coded(values[c.effect][c.parameter]) for c in self.coordinates]
        for term in self.parts:
            point += list(hypothesis.extra.get(term.name, np.zeros(term.size)))
        return np.clip(np.array(point), self.low, self.high)

    def machines(self, points: np.ndarray) -> np.ndarray:
        """Rows [C, P] of the simulator for points [C, D], the coefficients of terms behind; points by their grain."""
        points = np.rint(points / self._grain) * self._grain
        rows = np.repeat(self.base[None], len(points), axis=0)
        for k, c in enumerate(self.coordinates):
            rows[:, c.column] = np.exp(points[:, k]) if c.log else points[:, k]
        return np.concatenate([rows, points[:, len(self.coordinates) :]], axis=1)

    def hypothesis(self, point: np.ndarray, extra: Mapping[str, Any]) -> Hypothesis:
        """The hypothesis at a point."""
        row = self.machines(point[None])[0]
        values: dict[str, dict[str, float]] = {name: {} for name in self.effects}
        for c in self.coordinates:
            values[c.effect][c.parameter] = float(row[c.column])
        coefficients, at = {}, len(self.coordinates)
        for term in self.parts:
            coefficients[term.name] = point[at : at + term.size]
            at += term.size
        return Hypothesis(values, {**coefficients, **extra})
