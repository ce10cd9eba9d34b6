"""A recording that is a sum of known curves: what the search does can be scored_by against least squares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from vision_s2r.effects import Effect, Parameter
from vision_s2r.fit.case import NOMINAL, Axis, Experiment, Hypothesis, Names, Samples, Segments

T = np.linspace(0, 1, 200)
CURVES = {
    "offset": np.ones_like(T),
    "slope": 2 * T - 1,
    "wave": np.sin(6 * np.pi * T),
    "step": np.where(T > 0.6, 1.0, 0.0),
    "late_step": np.where(T > 0.61, 1.0, 0.0),
    "curve": (2 * T - 1) ** 2,
}
DISCREPANCIES = {"anything smooth": np.stack([np.cos(np.pi * k * T) for k in range(8)])}


def effect(name: str) -> Effect:
    kind = type(name, (Effect,), {"name": name, "source": "dynamics" if name in ("offset", "slope") else "actuator"})
    kind.parameters = (Parameter("size", "m", -10, 10, neutral=0.0, moderate=1.0),)
    return kind()


@dataclass
class Curves:
    """Segments of `y` [segments, 200], each the same curves with noise of its own; offset and slope are refitted."""

    y: np.ndarray
    noise: float = 0.1
    reach: float = 0.1  # of intervals
    shown: np.ndarray | None = None  # [segments] how much of the curves each shows; all of them unless given
    withheld: Names = frozenset()
    contradictory: Names = frozenset()
    # By stand-in, others that look wrong where it is not there to do an unknown's work.
    standing: Mapping[str, Names] = field(default_factory=dict)
    certain: Mapping[str, float] = field(default_factory=dict)
    not_excited: Mapping[str, str] = field(default_factory=dict)
    sharp: bool = True
    replaced: Mapping[str, float] = field(default_factory=dict)
    unsteady = ""
    allowance: float = 0.0
    rough: Names = frozenset()
    guessed: Names = frozenset()
    measured: Mapping[str, float] = field(default_factory=dict)
    motions: int = 1
    kind, metric, unit, described = "joint", "position_rmse", "m", "the curve"
    refitted: Names = frozenset({"offset", "slope"})
    discrepancies: Mapping[str, str] = field(default_factory=lambda: {"anything smooth": "a smooth curve"})

    def __post_init__(self) -> None:
        self.library = {name: effect(name) for name in CURVES if name not in self.withheld}
        self.segments = len(self.y)
        self._shown = np.ones(self.segments) if self.shown is None else self.shown

    def _columns(self, names: Names) -> list[tuple[str, np.ndarray]]:
        rows = [(name, CURVES[name]) for name in sorted(names & frozenset(CURVES))]
        return rows + [(name, row) for name in sorted(names & frozenset(DISCREPANCIES)) for row in DISCREPANCIES[name]]

    def _predict(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        known = sum((v["size"] * CURVES[name] for name, v in hypothesis.values.items()), np.zeros_like(T))
        unknown = (np.asarray(c) @ DISCREPANCIES[name] for name, c in hypothesis.extra.items())
        return np.outer(self._shown[list(segments)], sum(unknown, known))

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's own unit."""
        return parameter.unit

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        columns = self._columns(names)
        if not columns:
            return NOMINAL
        design = np.stack([row for _, row in columns], 1)
        shown = self._shown[list(segments)]
        seen = shown @ self.y[list(segments)] / max(shown @ shown, 1e-9)
        found = np.linalg.lstsq(design, seen, rcond=None)[0]
        extra: dict[str, list[float]] = {}
        values = {}
        for (name, _), value in zip(columns, found, strict=True):
            if name in DISCREPANCIES:
                extra.setdefault(name, []).append(float(value))
            else:
                values[name] = {"size": float(value)}
        return Hypothesis(values, extra)

    def loglik(self, hypothesis: Hypothesis, segments: Segments) -> list[np.ndarray]:
        residual = (self.y[list(segments)] - self._predict(hypothesis, segments)) / self.noise
        return list(-0.5 * (residual**2).reshape(len(segments), 20, 10).sum(axis=2))

    def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        return ((self.y[list(segments)] - self._predict(hypothesis, segments)) ** 2).mean(axis=1)

    def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        return self.error(hypothesis, segments) / self.noise**2

    def floor(self, segments: Segments) -> np.ndarray:
        return np.full(len(segments), self.noise**2)

    def samples(self, hypothesis: Hypothesis) -> Samples:
        error = (self.y - self._predict(hypothesis, range(self.segments))) ** 2
        thirds = Axis("time", ("early", "middle", "late"), np.tile((T * 2.999).astype(int), self.segments))
        segments = np.repeat(np.arange(self.segments), len(T))
        return Samples(error.ravel(), np.full(error.size, self.noise**2), segments, (thirds,))

    def moved(self, hypothesis: Hypothesis, name: str) -> Samples | None:
        """None: no effect has axes of its own."""
        return None

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        segments = range(self.segments)
        now = frozenset(hypothesis.values) | frozenset(hypothesis.extra)
        base = sum(b.sum() for b in self.loglik(hypothesis, segments))
        return {
            name: float(sum(b.sum() for b in self.loglik(self.fit(now | {name}, segments, None), segments)) - base)
            for name in names
        }

    def proposals(self) -> Sequence[Names]:
        return []

    def simplify(self, names: Names) -> Sequence[Names]:
        return []

    def confusable(self, name: str) -> Names:
        return {"step": frozenset({"late_step"}), "late_step": frozenset({"step"})}.get(name, frozenset())

    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        return abs(hypothesis.values[name]["size"]) < 1e-3

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether it is a stand-in, or one that it hides is not there."""
        hiding = [hidden for each, hidden in self.standing.items() if each not in hypothesis.values]
        return name in self.standing or name in frozenset().union(*hiding)

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether it was said to be."""
        return name in self.contradictory

    def wavers(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: nothing moves."""
        return False

    def may_vanish(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: all recordings have the same curves."""
        return False

    def intervals(self, hypothesis: Hypothesis) -> dict[str, dict[str, tuple[float, float]]]:
        return {n: {"size": (v["size"] - self.reach, v["size"] + self.reach)} for n, v in hypothesis.values.items()}

    def experiment(self, rivals: Sequence[Hypothesis], not_excited: Sequence[str]) -> Experiment:
        return Experiment(f"{len(rivals)} rivals, {len(not_excited)} not_excited")


def recording(seed: int, noise: float = 0.1, other: np.ndarray | None = None, **sizes: float) -> np.ndarray:
    """[6, 200] of these curves, and of any other."""
    clean = sum((size * CURVES[name] for name, size in sizes.items()), np.zeros_like(T))
    clean = clean + (0 if other is None else other)
    return clean + noise * np.random.default_rng(seed).standard_normal((6, len(T)))
