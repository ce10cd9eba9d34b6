"""Automatic domain randomization: ranges that begin at the nominal point and widen while the policy performs well.

OpenAI et al. 2019, "Solving Rubik's Cube with a Robot Hand" (arXiv:1910.07113), section 5, Algorithm 1. A dimension
is one parameter of an effect. Its boundaries are kept as shares of its limits, on the parameter's scale: 0 is the lower
limit and 1 the upper one, so that one step suits parameters of all units.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vision_s2r.effects import Parameter, Registry
from vision_s2r.errors import UserError
from vision_s2r.randomize.distribution import Samples, Values
from vision_s2r.randomize.ranges import Range

DIGITS = 12  # of positions: so many steps out and back end where they began


@dataclass
class AdrConfig:
    """When ranges widen; the defaults are the paper's."""

    buffer: int = 240  # results at a boundary from which a decision is made
    threshold_high: float = 20.0  # mean performance at a boundary from which on it moves outwards
    threshold_low: float = 10.0  # and down from which it moves inwards
    step: float = 0.02  # of a boundary, as a share of its dimension's limits
    boundary_probability: float = 0.5  # with which a draw lies at a boundary


@dataclass(frozen=True)
class Dimension:
    """A parameter of an effect: where its range begins, and the limits up to which it may widen.

    `nominal` lies within the limits, or is a neutral value beyond the physical bounds (0 or infinity on a log scale):
    that one stands at the nearest limit, which is where the effect is to be as good as absent. `step` replaces the
    configuration's, as a share of the limits too.
    """

    effect: str
    parameter: str
    nominal: float
    low: float
    high: float
    step: float | None = None

    @property
    def name(self) -> str:
        """EFFECT.PARAMETER."""
        return f"{self.effect}.{self.parameter}"


@dataclass(frozen=True)
class AdrSample:
    """Values by effect and parameter [count], and at which boundary each draw lies [count].

    `boundary` is -1 for a draw from within, else 2·(number of the dimension), + 1 where it is the upper one.
    """

    values: Samples
    boundary: np.ndarray


class AutomaticDomainRandomization:
    """The ranges of all dimensions, the performance buffers of their boundaries, and the random state.

    `draw` machines or cameras, let the policy try them, `record` its performance; `state` goes into a checkpoint.
    Raises UserError for dimensions and configurations that cannot be.
    """

    def __init__(
        self,
        dimensions: Sequence[Dimension],
        registry: Registry[Any],
        config: AdrConfig | None = None,
        seed: int = 0,
    ) -> None:
        self.dimensions = tuple(dimensions)
        self.registry = registry
        self.config = config or AdrConfig()
        _check(self.config, self.dimensions)
        self._parameters = [registry[each.effect].parameter(each.parameter) for each in self.dimensions]
        pairs = list(zip(self.dimensions, self._parameters, strict=True))
        self._limits = [_limits(dimension, parameter) for dimension, parameter in pairs]
        self._nominal = np.array([_nominal(*pair, limits) for pair, limits in zip(pairs, self._limits, strict=True)])
        # One that the nominal point leaves no room to move would only cost draws.
        outermost = np.tile([0.0, 1.0], len(pairs))
        self._movable = np.flatnonzero(np.repeat(self._nominal, 2) != outermost)
        self.bounds = np.stack([self._nominal, self._nominal], axis=1)  # [D, 2], shares of the limits
        self._buffers: list[list[float]] = [[] for _ in outermost]
        self._rng = np.random.default_rng(seed)

    def draw(self, count: int) -> AdrSample:
        """`count` draws, uniform within the ranges; with the boundary probability, one dimension is at a boundary."""
        positions = self._within(count, self._rng)
        chosen = self._movable[self._rng.integers(len(self._movable), size=count)]
        boundary = np.where(self._rng.random(count) < self.config.boundary_probability, chosen, -1)
        rows = np.flatnonzero(boundary >= 0)
        dimension, side = np.divmod(boundary[rows], 2)
        positions[rows, dimension] = self.bounds[dimension, side]
        return AdrSample(self._values(positions), boundary)

    def sample(self, count: int, rng: np.random.Generator) -> Samples:
        """`count` draws, uniform within the ranges as they are now."""
        return self._values(self._within(count, rng))

    def record(self, boundary: np.ndarray, performance: np.ndarray) -> None:
        """The `performance` [K] of the policy on draws at these boundaries [K]; draws from within (-1) are ignored.

        A boundary moves once a call at most, however many results there are: all of them were measured where it was.
        Those that come in after a move, of draws from before it, count for the next one.
        """
        boundary, performance = np.asarray(boundary), np.asarray(performance, dtype=float)
        if boundary.shape != performance.shape or boundary.ndim != 1:
            raise UserError(f"performance of shape {performance.shape} at boundaries of shape {boundary.shape}")
        unknown = boundary[(boundary < -1) | (boundary >= len(self._buffers))]
        if len(unknown):
            raise UserError(f"boundary {unknown[0]}: expected -1 to {len(self._buffers) - 1}")
        if not np.isfinite(performance[boundary >= 0]).all():
            raise UserError("performance is not finite")
        for number in np.unique(boundary[boundary >= 0]):
            buffer = self._buffers[number]
            buffer += performance[boundary == number].tolist()
            if len(buffer) >= self.config.buffer:
                self._decide(int(number), float(np.mean(buffer)))
                buffer.clear()

    def _decide(self, number: int, performance: float) -> None:
        """Move a boundary outwards, inwards or not at all; never across the nominal point or the limits."""
        dimension, side = divmod(number, 2)
        if self.config.threshold_low < performance < self.config.threshold_high:
            return
        own = self.dimensions[dimension].step
        step = self.config.step if own is None else own
        outwards = step if side == 1 else -step
        moved = self.bounds[dimension, side] + (outwards if performance >= self.config.threshold_high else -outwards)
        low, high = (self._nominal[dimension], 1.0) if side == 1 else (0.0, self._nominal[dimension])
        self.bounds[dimension, side] = np.clip(round(moved, DIGITS), low, high)

    @property
    def entropy(self) -> float:
        """Mean logarithm of the ranges' widths, in nats per dimension; 0 where all have reached their limits.

        Minus infinity, as the formula has it, while any dimension is still a point.
        """
        with np.errstate(divide="ignore"):
            return float(np.log(self.bounds[:, 1] - self.bounds[:, 0]).mean())

    def ranges(self) -> dict[str, dict[str, Range]]:
        """The ranges of effects and parameters, in the parameters' units; a neutral value may be one of their ends."""
        found: dict[str, dict[str, Range]] = {}
        low, high = (self._values(self.bounds[None, :, side]) for side in (0, 1))
        for each in self.dimensions:
            ends = (float(values[each.effect][each.parameter][0]) for values in (low, high))
            found.setdefault(each.effect, {})[each.parameter] = Range(*ends, where=each.name)
        return found

    def support(self, effect: str) -> list[dict[str, Range]]:
        """Where draws lie, by parameter: what is no dimension is neutral; UserError where it has no neutral value."""
        neutral = {p.name: p.neutral for p in self.registry[effect].parameters}
        found = {key: Range(value, value) for key, value in neutral.items() if value is not None}
        found |= self.ranges().get(effect, {})
        if not found:
            raise UserError(f"{effect}: no dimension, and no nominal value is known")
        return [found]

    def _within(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Uniform positions [count, D] within the boundaries."""
        low, high = self.bounds.T
        return low + (high - low) * rng.random((count, len(self.dimensions)))

    def _values(self, positions: np.ndarray) -> Samples:
        """Values at positions [N, D]: at the nominal point exactly the nominal ones, maybe beyond the limits."""
        samples: Samples = {}
        for k, (each, parameter) in enumerate(zip(self.dimensions, self._parameters, strict=True)):
            values = self._limits[k].at(positions[:, k], parameter.scale)
            values = np.where(positions[:, k] == self._nominal[k], each.nominal, values)
            samples.setdefault(each.effect, {})[each.parameter] = values
        return samples

    def state(self) -> dict[str, Any]:
        """All that the future depends on besides the configuration, for JSON."""
        return {
            "dimensions": self._declared(),
            "bounds": self.bounds.tolist(),
            "buffers": [list(buffer) for buffer in self._buffers],
            "random": self._rng.bit_generator.state,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on exactly where `state` was taken; UserError where it is of other dimensions, or none."""
        try:
            if state["dimensions"] != self._declared():
                raise UserError(f"state of other dimensions: {state['dimensions']}, expected {self._declared()}")
            self._rng.bit_generator.state = state["random"]
            self.bounds = np.array(state["bounds"], dtype=float).reshape(self.bounds.shape)
            self._buffers = [list(buffer) for buffer in state["buffers"]]
        except (KeyError, TypeError, ValueError) as error:
            raise UserError(f"no state of an automatic randomization: {error!r}") from error

    def _declared(self) -> list[list[Any]]:
        """What positions mean: name, lower and upper limit, and where the nominal point lies between them."""
        zipped = zip(self.dimensions, self._nominal, strict=True)
        return [[each.name, float(each.low), float(each.high), float(nominal)] for each, nominal in zipped]


def dimensions(
    limits: Mapping[str, Mapping[str, Any]], registry: Registry[Any], nominal: Values, where: str
) -> list[Dimension]:
    """A dimension for each [low, high] of `limits`, by effect and parameter, from its nominal value on.

    `nominal` is by effect and parameter; what it lacks is neutral. Raises UserError, which begins with `where`, for
    what has neither, and limits that are no pair of the parameter's values.
    """
    found = []
    for name, given in limits.items():
        effect = registry[name]
        for key, pair in given.items():
            value = nominal.get(name, {}).get(key, effect.parameter(key).neutral)
            if value is None:
                raise UserError(f"{where}: {name}.{key} has no neutral value to begin at, expected no limits for it")
            if not isinstance(pair, Sequence) or isinstance(pair, str) or len(pair) != 2:
                raise UserError(f"{where}: {name}.{key} is {pair!r}, expected [low, high]")
            low, high = (effect.parameter(key).check(end, f"{where}: {name}") for end in pair)
            found.append(Dimension(name, key, value, low, high))
    return found


def _check(config: AdrConfig, dimensions: Sequence[Dimension]) -> None:
    names = [each.name for each in dimensions]
    if not names or len(set(names)) < len(names):
        raise UserError(f"dimensions are {', '.join(names) or 'none'}, expected one or more, each once")
    if config.buffer < 1:
        raise UserError(f"buffer is {config.buffer}, expected at least 1 result")
    if not config.threshold_low < config.threshold_high:
        raise UserError(
            f"threshold_low is {config.threshold_low:g} and threshold_high {config.threshold_high:g}, "
            "expected low below high"
        )
    if not 0 < config.boundary_probability <= 1:
        raise UserError(f"boundary_probability is {config.boundary_probability:g}, expected more than 0, at most 1")
    steps = {"step": config.step} | {f"{each.name}: step": each.step for each in dimensions if each.step is not None}
    for name, step in steps.items():
        if not 0 < step <= 1:
            raise UserError(f"{name} is {step:g}, expected more than 0, at most 1: a share of the limits")


def _limits(dimension: Dimension, parameter: Parameter) -> Range:
    limits = Range(dimension.low, dimension.high, where=dimension.name)
    if not parameter.low <= limits.low < limits.high <= parameter.high:
        raise UserError(
            f"{dimension.name}: limits are [{limits.low:g}, {limits.high:g}], "
            f"expected a range within {parameter.low:g} to {parameter.high:g}"
        )
    return limits


def _nominal(dimension: Dimension, parameter: Parameter, limits: Range) -> float:
    """Where the nominal point lies between the limits (0 to 1)."""
    value = dimension.nominal
    if value == parameter.neutral and not parameter.low <= value <= parameter.high:
        return 0.0 if value < limits.low else 1.0
    if not limits.low <= value <= limits.high:
        raise UserError(f"{dimension.name}: nominal is {value:g}, expected {limits.low:g} to {limits.high:g}")
    return round(limits.position(value, parameter.scale), DIGITS)
