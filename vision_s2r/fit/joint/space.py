"""The coordinates that a fit moves in: parameters of effects and discrepancies, each in the measure that suits it."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.coordinates import Coordinates, ParameterRange
from vision_s2r.fit.joint import effects as _effects  # noqa: F401  (fills JOINT_FITS)
from vision_s2r.fit.joint.discrepancy import DISCREPANCIES, Discrepancy
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.track import JointTrack
from vision_s2r.joint import COLUMNS, DYNAMICS, JOINT_EFFECTS, Tables, pack

INDEX = {column: k for k, column in enumerate(COLUMNS)}


@dataclass(frozen=True, kw_only=True)
class JointCoordinate(ParameterRange):
    """The range of one effect's parameter."""

    effect: str

    @property
    def column(self) -> int:
        """In a machine's row."""
        return INDEX[self.effect if self.effect in DYNAMICS else f"{self.effect}.{self.parameter}"]


class JointSpace(Coordinates):
    """The coordinates of a set of names on a track."""

    def __init__(
        self,
        names: frozenset[str],
        track: JointTrack,
        noise: float,
        grid: Mapping[str, float] | None = None,  # of the encoder: parameters of encoder_quantization
        repeats: float = 1.0,  # samples that say what one says: nominal parameters are believed that much more
    ) -> None:
        self.track, self._grid = track, grid
        scales = track.scales
        self.effects = sorted((name for name in names if name not in DISCREPANCIES), key=_order)
        self.coordinates: list[JointCoordinate] = [
            JointCoordinate(effect=name, **vars(each.within(JOINT_EFFECTS[name].parameter(each.parameter))))
            for name in self.effects
            for each in JOINT_FITS[name].ranges(track, noise)
        ]
        self.discrepancies: list[Discrepancy] = [
            DISCREPANCIES[name](track, scales) for name in DISCREPANCIES if name in names
        ]
        self.base = pack(track.nominal, {})
        # The name that each coordinate belongs to.
        self.owner = [c.effect for c in self.coordinates] + [d.name for d in self.discrepancies for _ in range(d.size)]
        self.size = len(self.coordinates) + sum(discrepancy.size for discrepancy in self.discrepancies)
        self.low, self.high, self.step, self.prior = (
            np.array(
                [
                    *(getattr(c, what) for c in self.coordinates),
                    *(x for d in self.discrepancies for x in getattr(d, what)),
                ]
            )
            for what in ("low", "high", "step", "prior")
        )
        if repeats > 1:
            for k, c in enumerate(self.coordinates):
                self.prior[k] = min(self.prior[k], c.firmer)
        nominal = [
            c.coded(getattr(track.nominal, c.effect)) if c.effect in DYNAMICS else np.nan for c in self.coordinates
        ]
        self.centre = np.append(nominal, np.full(self.size - len(nominal), np.nan))
        self.repeats = np.where(np.isnan(self.centre), 1.0, repeats)  # [D]
        self.prior /= np.sqrt(self.repeats)

    @property
    def tables(self) -> Tables | None:
        """Of the discrepancies that are torques."""
        found = {discrepancy.axis: discrepancy.knots for discrepancy in self.discrepancies if discrepancy.axis}
        return Tables(**found) if found else None

    def start(self, hypothesis: Hypothesis) -> np.ndarray:
        """The point [D] at this hypothesis; a dynamics parameter that it has not is nominal. KeyError for others."""
        nominal = self.track.nominal
        values: dict[str, Mapping[str, float]] = {
            n: {"value": float(getattr(nominal, n))} for n in DYNAMICS if getattr(nominal, n) is not None
        }
        values |= hypothesis.values
        point = []
        for c in self.coordinates:
            value = values[c.effect][c.parameter]
            if c.above is not None:
                value -= values[c.above]["value"]
            point.append(c.coded(value))
        for discrepancy in self.discrepancies:
            point += list(hypothesis.extra.get(discrepancy.name, np.zeros(discrepancy.size)))
        return np.clip(np.array(point), self.low, self.high)

    def machines(self, points: np.ndarray) -> np.ndarray:
        """Rows [C, P] of the simulator for points [C, D], the heights of tables behind."""
        rows = np.repeat(self.base[None], len(points), axis=0)
        for k, c in enumerate(self.coordinates):
            rows[:, c.column] = np.exp(points[:, k]) if c.log else points[:, k]
        for c in self.coordinates:
            if c.above is not None:
                rows[:, c.column] += rows[:, INDEX[c.above]]
        heights = [
            self.part(points, discrepancy)
            for axis in (field.name for field in fields(Tables))
            for discrepancy in self.discrepancies
            if discrepancy.axis == axis
        ]
        return np.concatenate([rows, *heights], axis=1)

    def row(self, point: np.ndarray) -> dict[str, float]:
        """The machine at a point [D], by column."""
        return {column: float(x) for column, x in zip(COLUMNS, self.machines(point[None])[0], strict=False)}

    def part(self, points: np.ndarray, discrepancy: Discrepancy) -> np.ndarray:
        """The coordinates [C, K] of one discrepancy."""
        at = len(self.coordinates)
        for each in self.discrepancies:
            if each is discrepancy:
                break
            at += each.size
        return points[:, at : at + discrepancy.size]

    def hypothesis(self, point: np.ndarray, extra: Mapping[str, Any]) -> Hypothesis:
        """The hypothesis at a point."""
        row = self.machines(point[None])[0]
        values: dict[str, dict[str, float]] = {name: {} for name in self.effects}
        for c in self.coordinates:
            values[c.effect][c.parameter] = float(row[c.column])
        if self._grid is not None and "encoder_quantization" in values:
            values["encoder_quantization"] = dict(self._grid)
        discrepancies = {discrepancy.name: self.part(point[None], discrepancy)[0] for discrepancy in self.discrepancies}
        return Hypothesis(values, {**discrepancies, **extra})


def _order(name: str) -> tuple[bool, str]:
    return name not in DYNAMICS, name
