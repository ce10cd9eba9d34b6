"""Distributions over effects: independent ranges (`Box`), and what an identification left open (`Posterior`).

A sample is data: by effect and parameter an array [count], in the units of the parameters.
"""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np
import yaml

from vision_s2r.effects import Parameter, Registry
from vision_s2r.errors import UserError, check_keys, nearest
from vision_s2r.files import write
from vision_s2r.randomize import files
from vision_s2r.randomize.ranges import EffectRange, Range, effect_ranges

Samples: TypeAlias = dict[str, dict[str, np.ndarray]]
Values: TypeAlias = Mapping[str, Mapping[str, float]]  # by effect and parameter

MOST_TRIES = 1000  # proposals of a posterior for each sample that is wanted

log = logging.getLogger(__name__)


class Distribution(Protocol):
    """What effects can be drawn from."""

    def sample(self, count: int, rng: np.random.Generator) -> Samples:
        """`count` independent draws."""


@dataclass(frozen=True)
class Box:
    """Effects that are on with their probability, independently, each parameter uniform in its range on its own scale.

    Where an effect is off, its parameters are at their `nominal` value (by effect and parameter), at the neutral one
    where none is given; a parameter that has neither switches nothing by itself and is drawn all the same. Raises
    UserError for an effect that may be off and has no value to be off at.
    """

    registry: Registry[Any]
    ranges: Mapping[str, EffectRange]
    nominal: Values = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, given in self.nominal.items():
            for key in given:
                self.registry[name].parameter(key)
        for name, drawn in self.ranges.items():
            if drawn.probability < 1 and not self.absent(name):
                raise UserError(
                    f"{name}: probability is {drawn.probability:g}, but no value is known at which it is off"
                )

    @classmethod
    def of(
        cls, effects: Mapping[str, Mapping[str, Any]], registry: Registry[Any], nominal: Values | None = None
    ) -> "Box":
        """The box of a configuration: as `effect_ranges` takes it, and with its errors.

        Logs a warning for each range that is always drawn from and leaves out the nominal value.
        """
        box = cls(registry, effect_ranges(effects, registry), nominal or {})
        for name, drawn in box.ranges.items():
            for key, value in box.absent(name).items():
                low, high = drawn.ranges[key]
                if drawn.probability == 1 and not low <= value <= high:
                    log.warning("%s: %s from %g to %g leaves out the nominal value, %g", name, key, low, high, value)
        return box

    def absent(self, effect: str) -> dict[str, float]:
        """The values at which an effect is off, of the parameters that have one."""
        nominal = self.nominal.get(effect, {})
        values = {p.name: nominal.get(p.name, p.neutral) for p in self.registry[effect].parameters}
        return {key: value for key, value in values.items() if value is not None}

    def sample(self, count: int, rng: np.random.Generator) -> Samples:
        """`count` independent draws."""
        samples: Samples = {}
        for name, drawn in self.ranges.items():
            on = rng.random(count) < drawn.probability
            effect, absent = self.registry[name], self.absent(name)
            samples[name] = {}
            for key, each in drawn.ranges.items():
                value = each.at(rng.random(count), effect.parameter(key).scale)
                samples[name][key] = np.where(on, value, absent[key]) if key in absent else value
        return samples

    def support(self, effect: str) -> list[dict[str, Range]]:
        """Where draws lie, by parameter: with the effect on, and with it off; UserError where that is not known."""
        drawn = self.ranges.get(effect, EffectRange(0.0, {}))
        off = {key: Range(value, value) for key, value in self.absent(effect).items()}
        if not drawn.ranges and not off:
            raise UserError(f"{effect}: no nominal value is known")
        return [drawn.ranges] * (drawn.probability > 0) + [off] * (drawn.probability < 1)

    def write(self, path: Path) -> None:
        """Write as YAML that `load_distribution` reads, whole or not at all; UserError where that cannot be."""
        effects = {
            name: {"probability": drawn.probability}
            | {key: [float(end) for end in each] for key, each in drawn.ranges.items()}
            for name, drawn in self.ranges.items()
        }
        write(path, _yaml({"distribution": "box", "effects": effects}))


@dataclass(frozen=True, eq=False)
class Posterior:
    """A multivariate normal over all parameters of some effects, truncated to their physical bounds.

    `values` holds the mean of each parameter; of a logarithmic one it is the logarithm that is normal, and the value
    is the median. `covariance` [D, D] is that of the parameters in this order, or of their natural logarithms. One
    without variance stays at its value. Raises UserError for values and covariances that cannot be.
    """

    registry: Registry[Any]
    values: Values
    covariance: np.ndarray

    def __post_init__(self) -> None:
        for name, given in self.values.items():
            self.registry[name].check(given)
        wanted = (len(self._parameters), len(self._parameters))
        if self.covariance.shape != wanted:
            raise UserError(f"covariance has shape {self.covariance.shape}, expected {wanted}, as there are parameters")
        if not np.isfinite(self.covariance).all() or not np.allclose(self._correlation, self._correlation.T):
            raise UserError("covariance is not symmetric, or not finite")
        if np.linalg.eigvalsh(self._correlation).min(initial=0.0) < -1e-9:
            raise UserError("covariance has a negative eigenvalue, expected none")
        for k, (name, parameter) in enumerate(self._parameters):
            if self._deviation[k] > 0 and not parameter.low <= self._centre[k] <= parameter.high:
                raise UserError(
                    f"{name}: {parameter.name} is {self._centre[k]:g}, out of the bounds in which it can vary"
                )

    @cached_property
    def _parameters(self) -> list[tuple[str, Parameter]]:
        return [(name, self.registry[name].parameter(key)) for name, given in self.values.items() for key in given]

    @cached_property
    def _centre(self) -> np.ndarray:
        return np.array([self.values[name][parameter.name] for name, parameter in self._parameters], dtype=float)

    @cached_property
    def _deviation(self) -> np.ndarray:
        return np.sqrt(np.diag(self.covariance).clip(0))

    @cached_property
    def _correlation(self) -> np.ndarray:
        """Free of units, which differ by orders of magnitude: what is compared with 0 is compared with 1."""
        scale = np.where(self._deviation > 0, self._deviation, 1)
        return self.covariance / np.outer(scale, scale)

    @cached_property
    def _root(self) -> np.ndarray:
        """[D, D] that makes correlated numbers of independent ones; also where parameters are wholly correlated."""
        eigenvalues, vectors = np.linalg.eigh(self._correlation)
        return vectors * np.sqrt(eigenvalues.clip(0))

    def sample(self, count: int, rng: np.random.Generator) -> Samples:
        """`count` independent draws; UserError where hardly any lies within the bounds."""
        drawn = np.empty((0, len(self._parameters)))
        for _ in range(MOST_TRIES):
            if len(drawn) == count:
                break
            drawn = np.concatenate([drawn, self._within_bounds(self._propose(count, rng))])[:count]
        else:
            raise UserError(f"posterior: fewer than 1 in {MOST_TRIES} draws lies within the effects' physical bounds")
        samples: Samples = {name: {} for name in self.values}
        for (name, parameter), column in zip(self._parameters, drawn.T, strict=True):
            samples[name][parameter.name] = column.copy()
        return samples

    def _propose(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draws [count, D] without bounds."""
        values = rng.standard_normal((count, len(self._parameters))) @ self._root.T * self._deviation
        for k, (_, parameter) in enumerate(self._parameters):
            if parameter.scale == "log":
                with np.errstate(over="ignore"):  # infinite is out of bounds as well
                    values[:, k] = self._centre[k] * np.exp(values[:, k])
            else:
                values[:, k] += self._centre[k]
        return values

    def _within_bounds(self, values: np.ndarray) -> np.ndarray:
        """The rows of [N, D] that lie within the bounds; a fixed parameter may lie at a neutral value beyond them."""
        inside = np.ones(len(values), dtype=bool)
        for k, (_, parameter) in enumerate(self._parameters):
            if self._deviation[k] > 0:
                inside &= Range(parameter.low, parameter.high).holds(values[:, k])
        return values[inside]

    def write(self, path: Path) -> None:
        """Write as YAML that `load_distribution` reads, whole or not at all; UserError where that cannot be."""
        values = {name: {key: float(value) for key, value in given.items()} for name, given in self.values.items()}
        write(path, _yaml({"distribution": "posterior", "values": values, "covariance": self.covariance.tolist()}))


def sample_at(distribution: Distribution, seed: int, indices: Iterable[int]) -> Samples:
    """A draw for each of `indices` [K]: a function of (seed, index) alone, whatever is drawn beside it or by whom."""
    drawn = [distribution.sample(0, np.random.default_rng())]  # which names the parameters where there are no indices
    for index in indices:
        drawn.append(distribution.sample(1, np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,)))))
    return {
        name: {key: np.concatenate([one[name][key] for one in drawn]) for key in given}
        for name, given in drawn[0].items()
    }


def load_distribution(path: Path, registry: Registry[Any], nominal: Values | None = None) -> Box | Posterior:
    """The distribution in a YAML file, over the effects of `registry`; `nominal` as `Box.of` takes it.

    Raises UserError, with the file's name, where it cannot be.
    """
    content, where = files.read(path, "distribution"), f"distribution {path}"
    keys = {"box": ("effects",), "posterior": ("values", "covariance")}
    kind = str(content.pop("distribution", "missing"))
    if kind not in keys:
        raise UserError(f"{where}: distribution is {kind}, {nearest(kind, keys)}")
    check_keys(content, keys[kind], where)
    for key in keys[kind]:
        if key not in content:
            raise UserError(f"{where}: missing {key}")
    try:
        if kind == "box":
            return Box.of(content["effects"], registry, nominal)
        return Posterior(registry, _mappings(content["values"]), _matrix(content["covariance"]))
    except UserError as error:
        raise UserError(f"{where}: {error}") from error


def _mappings(values: Any) -> Values:
    if not isinstance(values, dict) or not all(isinstance(given, dict) for given in values.values()):
        raise UserError("values: expected the parameters of each effect")
    return {str(name): {str(key): value for key, value in given.items()} for name, given in values.items()}


def _matrix(rows: Any) -> np.ndarray:
    try:
        return np.array(rows, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise UserError("covariance: expected rows of numbers, all of one length") from error


def _yaml(content: dict[str, Any]) -> str:
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None)
