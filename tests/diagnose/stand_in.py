"""A recording that is a sum of known curves: what the search does can be judged against least squares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from vision_s2r.diagnose.case import NOMINAL, Axis, Hypothesis, Names, Samples, Units
from vision_s2r.effects import Effect, Parameter

T = np.linspace(0, 1, 200)
CURVES = {
    "offset": np.ones_like(T),
    "slope": 2 * T - 1,
    "wave": np.sin(6 * np.pi * T),
    "step": np.where(T > 0.6, 1.0, 0.0),
    "late_step": np.where(T > 0.61, 1.0, 0.0),
    "curve": (2 * T - 1) ** 2,
}
DECOYS = {"anything smooth": np.stack([np.cos(np.pi * k * T) for k in range(8)])}


def effect(name: str) -> Effect:
    kind = type(name, (Effect,), {"name": name, "source": "dynamics" if name in ("offset", "slope") else "actuator"})
    kind.parameters = (Parameter("size", "m", -10, 10, neutral=0.0, moderate=1.0),)
    return kind()


@dataclass
class Curves:
    """Units of `y` [units, 200], each the same curves with noise of its own; offset and slope are refitted."""

    y: np.ndarray
    noise: float = 0.1
    withheld: Names = frozenset()
    certain: Mapping[str, float] = field(default_factory=dict)
    silent: Mapping[str, str] = field(default_factory=dict)
    sharp: bool = True
    rough: Names = frozenset()
    kind, metric, unit, described = "joint", "position_rmse", "m", "the curve"
    refitted: Names = frozenset({"offset", "slope"})
    decoys: Mapping[str, str] = field(default_factory=lambda: {"anything smooth": "a smooth curve"})

    def __post_init__(self) -> None:
        self.library = {name: effect(name) for name in CURVES if name not in self.withheld}
        self.units = len(self.y)

    def _columns(self, names: Names) -> list[tuple[str, np.ndarray]]:
        rows = [(name, CURVES[name]) for name in sorted(names & frozenset(CURVES))]
        return rows + [(name, row) for name in sorted(names & frozenset(DECOYS)) for row in DECOYS[name]]

    def _predict(self, hypothesis: Hypothesis) -> np.ndarray:
        known = sum((v["size"] * CURVES[name] for name, v in hypothesis.values.items()), np.zeros_like(T))
        return known + sum((np.asarray(c) @ DECOYS[name] for name, c in hypothesis.extra.items()), np.zeros_like(T))

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's own unit."""
        return parameter.unit

    def fit(self, names: Names, units: Units, start: Hypothesis | None) -> Hypothesis:
        columns = self._columns(names)
        if not columns:
            return NOMINAL
        design = np.stack([row for _, row in columns], 1)
        found = np.linalg.lstsq(design, self.y[list(units)].mean(axis=0), rcond=None)[0]
        extra: dict[str, list[float]] = {}
        values = {}
        for (name, _), value in zip(columns, found, strict=True):
            if name in DECOYS:
                extra.setdefault(name, []).append(float(value))
            else:
                values[name] = {"size": float(value)}
        return Hypothesis(values, extra)

    def loglik(self, hypothesis: Hypothesis, units: Units) -> list[np.ndarray]:
        residual = (self.y[list(units)] - self._predict(hypothesis)) / self.noise
        return list(-0.5 * (residual**2).reshape(len(units), 20, 10).sum(axis=2))

    def error(self, hypothesis: Hypothesis, units: Units) -> np.ndarray:
        return ((self.y[list(units)] - self._predict(hypothesis)) ** 2).mean(axis=1)

    def excess(self, hypothesis: Hypothesis, units: Units) -> np.ndarray:
        return self.error(hypothesis, units) / self.noise**2

    def floor(self, units: Units) -> np.ndarray:
        return np.full(len(units), self.noise**2)

    def samples(self, hypothesis: Hypothesis) -> Samples:
        error = (self.y - self._predict(hypothesis)) ** 2
        thirds = Axis("time", ("early", "middle", "late"), np.tile((T * 2.999).astype(int), self.units))
        units = np.repeat(np.arange(self.units), len(T))
        return Samples(error.ravel(), np.full(error.size, self.noise**2), units, (thirds,))

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        units = range(self.units)
        now = frozenset(hypothesis.values) | frozenset(hypothesis.extra)
        base = sum(b.sum() for b in self.loglik(hypothesis, units))
        return {
            name: float(sum(b.sum() for b in self.loglik(self.fit(now | {name}, units, None), units)) - base)
            for name in names
        }

    def proposals(self) -> Sequence[Names]:
        return []

    def simplify(self, names: Names) -> Sequence[Names]:
        return []

    def twins(self, name: str) -> Names:
        return {"step": frozenset({"late_step"}), "late_step": frozenset({"step"})}.get(name, frozenset())

    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        return abs(hypothesis.values[name]["size"]) < 1e-3

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        return False

    def intervals(self, hypothesis: Hypothesis) -> dict[str, dict[str, tuple[float, float]]]:
        return {n: {"size": (v["size"] - 0.1, v["size"] + 0.1)} for n, v in hypothesis.values.items()}

    def experiment(self, rivals: Sequence[Hypothesis], silent: Sequence[str]) -> str:
        return f"{len(rivals)} rivals, {len(silent)} silent"


def recording(seed: int, noise: float = 0.1, other: np.ndarray | None = None, **sizes: float) -> np.ndarray:
    """[6, 200] of these curves, and of any other."""
    clean = sum((size * CURVES[name] for name, size in sizes.items()), np.zeros_like(T))
    clean = clean + (0 if other is None else other)
    return clean + noise * np.random.default_rng(seed).standard_normal((6, len(T)))
