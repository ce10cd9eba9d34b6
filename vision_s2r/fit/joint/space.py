"""The coordinates that a fit moves in: parameters of effects and discrepancies, each in the measure that suits it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.joint.discrepancy import DISCREPANCIES, Discrepancy
from vision_s2r.fit.joint.track import Scales, Track
from vision_s2r.joint import COLUMNS, DYNAMICS, SERVO, Nominal, Tables, pack

INDEX = {column: k for k, column in enumerate(COLUMNS)}
UNFITTED = frozenset({*SERVO, "position_offset", "load_dependent_stribeck"})  # they are simulated, but not yet fitted


@dataclass(frozen=True)
class Coordinate:
    """A parameter as the fit sees it: its logarithm or itself, its range here, and a step that changes it little."""

    effect: str
    parameter: str
    low: float
    high: float
    step: float
    log: bool = False
    prior: float = math.inf  # standard deviation about where it starts; keeps what nothing shows where it was
    above: int | None = None  # column of the machine that this parameter is measured from

    @property
    def column(self) -> int:
        """In a machine's row."""
        return INDEX[self.effect if self.effect in DYNAMICS else f"{self.effect}.{self.parameter}"]

    def coded(self, value: float) -> float:
        """The coordinate of a value."""
        return math.log(max(value, 1e-300)) if self.log else value


def _nominal_of(name: str) -> Callable[[Nominal], float]:
    return lambda nominal: float(getattr(nominal, name))


def coordinates(name: str, nominal: Nominal, scales: Scales, sample_time: float, noise: float) -> list[Coordinate]:
    """Those of one effect, in the order of its parameters; `noise` is the position's."""
    s, damping = scales, scales.torque / scales.speed

    def log(parameter: str, low: float, high: float, step: float = 0.003, prior: float = math.inf) -> Coordinate:
        return Coordinate(name, parameter, math.log(low), math.log(high), step, True, prior)

    def linear(
        parameter: str, low: float, high: float, scale: float, prior: float = math.inf, above: int | None = None
    ) -> Coordinate:
        return Coordinate(name, parameter, low, high, 0.003 * scale, False, prior, above)

    inertia, slow = nominal.inertia, 2 * math.pi * 0.3
    fast = 2 * math.pi * 0.4 / sample_time
    table: dict[str, Callable[[], list[Coordinate]]] = {
        "torque_constant": lambda: [log("value", nominal.torque_constant / 10, nominal.torque_constant * 10)],
        "inertia": lambda: [log("value", inertia / 20, inertia * 20, prior=2.0)],
        "viscous_damping": lambda: [
            linear("value", 0.0, 20 * (damping + nominal.viscous_damping), damping, 3 * damping)
        ],
        "coulomb_friction": lambda: [linear("value", 0.0, 2 * s.peak_torque, s.torque, s.peak_torque)],
        "gravity_torque": lambda: [linear("value", -3 * s.peak_torque, 3 * s.peak_torque, s.torque, s.peak_torque)],
        "bias_torque": lambda: [linear("value", -s.peak_torque, s.peak_torque, s.torque, s.peak_torque)],
        "stribeck_friction": lambda: [
            linear("static", 0.0, 2 * s.peak_torque, s.torque, above=INDEX["coulomb_friction"]),
            log("velocity", 2e-3 * s.peak_speed, 1.5 * s.peak_speed, 0.02),
        ],
        "load_dependent_friction": lambda: [linear("coefficient", 0.0, 0.95, 0.5)],
        "backlash": lambda: [log("width", max(1e-5 * s.span, 0.5 * noise, 1e-7), max(s.span, 1e-6), 0.02)],
        "torque_saturation": lambda: [log("limit", 0.02 * s.peak_torque, 1.02 * s.peak_torque, 0.005)],
        "torque_speed_limit": lambda: [
            log("stall", 0.1 * s.peak_torque, 30 * s.peak_torque, 0.005),
            log("no_load_speed", 0.2 * s.peak_speed, 30 * s.peak_speed, 0.005),
        ],
        "latency": lambda: [linear("delay", 0.0, max(20 * sample_time, 0.1), 10 * sample_time)],
        "cogging": lambda: [
            linear("amplitude", 0.0, 2 * s.peak_torque, s.torque),
            log("teeth", 0.5, 1e5, 1e-3 / max(1.0, s.span)),
        ],
        "thermal_drift": lambda: [linear("rate", -1 / s.duration, 10 / s.duration, 1 / s.duration)],
        "asymmetric_friction": lambda: [
            linear("viscous", -5 * damping, 5 * damping, damping),
            linear("coulomb", -s.peak_torque, s.peak_torque, s.torque),
        ],
        "compliance": lambda: [
            log("stiffness", inertia / 4 * slow**2, inertia / 4 * fast**2 * 4, 0.005),
            log("damping", 1e-3 * inertia * slow, 10 * inertia * fast, 0.02, 3.0),
        ],
    }
    return table[name]()


class Space:
    """The coordinates of a set of names on a track."""

    def __init__(self, names: frozenset[str], track: Track, noise: float) -> None:
        self.track = track
        scales = track.scales
        self.effects = sorted((name for name in names if name not in DISCREPANCIES), key=_order)
        # The resolution is the grid's: nothing of it is fitted.
        moving = [name for name in self.effects if name != "encoder_quantization"]
        self.coordinates = [
            c for name in moving for c in coordinates(name, track.nominal, scales, track.sample_time, noise)
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

    @property
    def tables(self) -> Tables | None:
        """Of the discrepancies that are torques."""
        found = {discrepancy.axis: discrepancy.knots for discrepancy in self.discrepancies if discrepancy.axis}
        return Tables(**found) if found else None

    def start(self, hypothesis: Hypothesis) -> np.ndarray:
        """The point [D] at this hypothesis; a dynamics parameter that it has not is nominal. KeyError for others."""
        nominal = self.track.nominal
        values: dict[str, Mapping[str, float]] = {
            n: {"value": float(getattr(nominal, n))} for n in DYNAMICS if n not in UNFITTED
        }
        values |= hypothesis.values
        point = []
        for c in self.coordinates:
            value = values[c.effect][c.parameter]
            if c.above is not None:
                value -= values[COLUMNS[c.above]]["value"]
            point.append(c.coded(value))
        for discrepancy in self.discrepancies:
            point += list(hypothesis.extra.get(discrepancy.name, np.zeros(discrepancy.size)))
        return np.clip(np.array(point), self.low, self.high)

    def differences(self, point: np.ndarray, stride: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """A point [D] and one step along each axis from it [1 + D, D]; the steps [D], back from an upper bound.

        Each is `stride` times as long as its coordinate's own.
        """
        step = self.step * stride
        steps = np.where(point + step > self.high, -step, step)
        return np.concatenate([point[None], point + np.diag(steps)]), steps

    def machines(self, points: np.ndarray) -> np.ndarray:
        """Rows [C, P] of the simulator for points [C, D], the heights of tables behind."""
        rows = np.repeat(self.base[None], len(points), axis=0)
        for k, c in enumerate(self.coordinates):
            rows[:, c.column] = np.exp(points[:, k]) if c.log else points[:, k]
        for c in self.coordinates:
            if c.above is not None:
                rows[:, c.column] += rows[:, c.above]
        heights = [
            self.part(points, discrepancy)
            for axis in ("position", "velocity", "time")
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

    def hypothesis(self, point: np.ndarray, resolution: float | None, extra: Mapping[str, object]) -> Hypothesis:
        """The hypothesis at a point."""
        row = self.machines(point[None])[0]
        values: dict[str, dict[str, float]] = {name: {} for name in self.effects}
        for c in self.coordinates:
            values[c.effect][c.parameter] = float(row[c.column])
        if resolution is not None and "encoder_quantization" in values:
            values["encoder_quantization"] = {"resolution": resolution}
        discrepancies = {discrepancy.name: self.part(point[None], discrepancy)[0] for discrepancy in self.discrepancies}
        return Hypothesis(values, {**discrepancies, **extra})


def _order(name: str) -> tuple[bool, str]:
    return name not in DYNAMICS, name
