"""Where the machines of an episode come from."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, Protocol

import numpy as np

from vision_s2r.randomize import AutomaticDomainRandomization, Box, Posterior

Values = Mapping[str, Mapping[str, np.ndarray]]


class Controller(Protocol):
    """From observations of `SpeedTracking` to its actions."""

    history: int

    def begin(self, count: int) -> None:
        """An episode of `count` joints begins: nothing is known of them yet."""
        ...

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Actions [N, 1] in [-1, 1] for observations [N, 2 + 2·history]."""
        ...


Evaluate = Callable[[Controller, Values, int], np.ndarray]


class Machines(Protocol):
    """A source of machines: the environment asks it at the start of an episode, training tells it of the policy."""

    @property
    def described(self) -> dict[str, Any]:
        """Plain values that tell this source from others."""
        ...

    def draw(self, count: int, rng: np.random.Generator) -> Values:
        """Effects of `count` machines: by name, parameters by name, arrays [count]."""
        ...

    def updated(self, policy: Controller) -> None:
        """The policy after an update; what is drawn from now on may depend on it."""
        ...

    def state(self) -> dict[str, Any]:
        """What a training resumes from."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Go on where `state` was taken."""
        ...


class Given:
    """The same machines in every episode: effects by name, parameters by name, each a number or an array [N]."""

    def __init__(self, values: Mapping[str, Mapping[str, Any]]) -> None:
        self.values = values

    @property
    def described(self) -> dict[str, Any]:
        """The values."""
        return {
            name: {key: np.asarray(value).tolist() for key, value in given.items()}
            for name, given in self.values.items()
        }

    def draw(self, count: int, rng: np.random.Generator) -> Values:
        """These, for all of `count`."""
        return {
            name: {key: np.broadcast_to(np.asarray(value, float), (count,)) for key, value in given.items()}
            for name, given in self.values.items()
        }

    def updated(self, policy: Controller) -> None:
        """Nothing changes."""

    def state(self) -> dict[str, Any]:
        """Nothing to keep."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Nothing was kept."""


class DrawnMachines(Given):
    """Machines from ranges or from a posterior, new ones in every episode."""

    def __init__(self, distribution: Box | Posterior) -> None:
        super().__init__({})
        self.distribution = distribution

    @property
    def described(self) -> dict[str, Any]:
        """The ranges, and how often each effect is on; or the posterior's values and covariance."""
        if isinstance(self.distribution, Posterior):
            values = {name: dict(given) for name, given in self.distribution.values.items()}
            return {"values": values, "covariance": self.distribution.covariance.tolist()}
        return {
            name: {"probability": drawn.probability} | {key: list(each) for key, each in drawn.ranges.items()}
            for name, drawn in self.distribution.ranges.items()
        }

    def draw(self, count: int, rng: np.random.Generator) -> Values:
        """`count` draws."""
        return self.distribution.sample(count, rng)


class AdrRanges:
    """Machines of automatic domain randomization.

    `evaluate(policy, machines, seed)` says how many targets a policy reaches on each of the machines [N]; after every
    `every` updates, up to the `last`, it is asked about `count` draws, half of them at a boundary. `history` has a line
    for each time: the `update`, the `entropy` (nats per dimension, minus infinity while a range is a point), the
    `performance` within the ranges, and the `ranges`, by effect and parameter [low, high].
    """

    def __init__(
        self, automatic: AutomaticDomainRandomization, evaluate: Evaluate, count: int, every: int, last: int
    ) -> None:
        self.automatic, self.evaluate, self.count, self.every, self.last = automatic, evaluate, count, every, last
        self.described = {
            "dimensions": [asdict(each) for each in automatic.dimensions],
            "automatic": asdict(automatic.config),
            "evaluations": [count, every, last],
        }
        self.updates = 0
        self.history: list[dict[str, Any]] = []

    def draw(self, count: int, rng: np.random.Generator) -> Values:
        """`count` from within the ranges as they are now."""
        return self.automatic.sample(count, rng)

    def updated(self, policy: Controller) -> None:
        """Move boundaries, now and then."""
        self.updates += 1
        if self.updates % self.every or self.updates > self.last:
            return
        drawn = self.automatic.draw(self.count)
        performance = self.evaluate(policy, drawn.values, self.updates)
        self.automatic.record(drawn.boundary, performance)
        ranges = {
            name: {key: list(each) for key, each in given.items()} for name, given in self.automatic.ranges().items()
        }
        within = float(performance[drawn.boundary < 0].mean())
        line = {"update": self.updates, "entropy": self.automatic.entropy, "performance": within, "ranges": ranges}
        self.history.append(line)

    def state(self) -> dict[str, Any]:
        """All that the future depends on."""
        return {"automatic": self.automatic.state(), "updates": self.updates, "history": self.history}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on where `state` was taken."""
        self.automatic.restore(state["automatic"])
        self.updates, self.history = state["updates"], state["history"]
