"""What the diagnosis needs to know of a recording beside its simulator, whatever its kind."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from vision_s2r.effects import Effect, Parameter

Values = Mapping[str, Mapping[str, float]]  # by effect, its parameters by name
Intervals = dict[str, dict[str, tuple[float, float]]]  # likewise
Names = frozenset[str]
Segments = Sequence[int]


@dataclass(frozen=True)
class Hypothesis:
    """A simulator: the effects that it has. What it does not name is absent, or nominal."""

    values: Values = field(default_factory=dict)
    # What the case fits besides, its own affair: a noise level, an interpolation kernel, coefficients of discrepancies.
    # A discrepancy that is on has a key of its name here.
    extra: Mapping[str, Any] = field(default_factory=dict)

    def only(self, names: Iterable[str]) -> "Hypothesis":
        """The hypothesis with what it has of these names, and nothing else."""
        kept = {name: value for name, value in self.values.items() if name in names}
        return Hypothesis(kept, {key: value for key, value in self.extra.items() if key in names})

    def without(self, effect: str) -> "Hypothesis":
        """The hypothesis without one of its effects."""
        return Hypothesis({name: value for name, value in self.values.items() if name != effect}, self.extra)


NOMINAL = Hypothesis()  # the simulator as it came


@dataclass(frozen=True)
class Axis:
    """One way of dividing the samples of a recording: by speed, by radius, by colour channel."""

    name: str
    labels: tuple[str, ...]  # of its bins, such as "|θ̇| < 0.4 rad/s"
    bins: np.ndarray  # [samples] int: the bin of each, -1 where it has none
    # Share of a gap that each bin would hold if it were nowhere in particular; None: that of the samples.
    usual: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Samples:
    """Squared errors of a hypothesis, sample by sample, for saying where the gap lies."""

    error: np.ndarray  # [samples] squared error, in the square of the gap's unit
    floor: np.ndarray  # [samples] what measurement noise alone would leave
    segment: np.ndarray  # [samples] int: the stretch or frame it belongs to, which are taken as exchangeable
    axes: tuple[Axis, ...]


@dataclass(frozen=True)
class Experiment:
    """A recording to make."""

    sentence: str  # with numbers
    # Of the table that a person can run, columns [N] by name, t (s) among them; empty where there is none to run.
    commands: Mapping[str, np.ndarray] = field(default_factory=dict)
    target: np.ndarray | None = None  # uint8 [H, W]: of a camera, what to print and photograph
    open: bool = True  # it settles what was left open; else it shows more than a recording that settled everything


class Case(Protocol):
    """A recording beside its simulator: predict it under effects, and score the prediction.

    Segments are its episodes or frames, taken as exchangeable; a single long episode is cut into stretches. All
    methods are deterministic, and called from several threads.
    """

    kind: str  # joint | camera
    segments: int
    metric: str  # of the gap: velocity_rmse
    unit: str  # of the gap: rad/s
    described: str  # which quantity is compared, over which horizon, in a sentence
    unsteady: str  # what the real thing does otherwise in each segment, in a few words; no effect is to blame for it
    allowance: float  # share of the noise that segments are measured by, that is for effects unlike their definitions
    rough: Names  # effects whose form is only roughly the same on any two machines: how hard a contact is
    guessed: Names  # nominal parameters that nobody measured, and that are causes even beside something unknown
    measured: Mapping[str, float]  # effects, with evidence in nats, that show apart from everything that is predicted
    motions: int  # episodes, where stretches of one are alike and another may be another motion
    replaced: Mapping[str, float]  # by effect, the nominal value that its `value` takes the place of
    sharp: bool  # whether the likelihood takes residuals for noise of known size, however large they are

    @property
    def library(self) -> Mapping[str, Effect]:
        """The effects that may be named; withheld ones are not there."""

    @property
    def refitted(self) -> Names:
        """Effects refitted under every hypothesis: nominal parameters that may merely be wrong (none of a camera's)."""

    @property
    def discrepancies(self) -> Mapping[str, str]:
        """Flexible unknowns that no effect of the library is, fitted by name as effects are.

        By name ("torque of velocity"), what they mean, for people: "a torque that depends on velocity".
        """

    @property
    def certain(self) -> Mapping[str, float]:
        """Effects that a signature proves by itself (a grid): evidence in nats."""

    @property
    def not_excited(self) -> Mapping[str, str]:
        """Effects that this recording could not have shown, and why, in a few words."""

    def session(self) -> AbstractContextManager[None]:
        """To be held while the methods below are called."""
        ...

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's unit in this recording."""
        ...

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        """The most likely parameters of these effects and discrepancies on these segments; `start` is near, or None."""
        ...

    def loglik(self, hypothesis: Hypothesis, segments: Segments) -> list[np.ndarray]:
        """Of each segment, the log-likelihood [blocks] (nats) of its blocks: the same blocks for every hypothesis.

        Tempered by the residual's effective sample size, so that blocks may be taken as independent.
        """
        ...

    def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared residual [segments] that the search looks at, in units of its noise: 1 at the floor.

        The noise includes the simulator's own tolerance, so that a very quiet recording names nothing that is
        only a step size. Effects that are noise themselves count by the noise that they leave unpredicted.
        """
        ...

    def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared error [segments] of the gap's metric.

        A difference in the amount of noise is part of it: with noise of standard deviation s in the recording and p
        predicted, (s - p)² counts beside the squared error of the mean and the floor.
        """
        ...

    def floor(self, segments: Segments) -> np.ndarray:
        """The same [segments] for a perfect simulator: measurement noise alone, estimated from the recording."""
        ...

    def samples(self, hypothesis: Hypothesis) -> Samples:
        """What `error` averages, sample by sample (or a fair subset), over all segments."""
        ...

    def moved(self, hypothesis: Hypothesis, name: str) -> Samples | None:
        """What an effect of the hypothesis does, sample by sample and squared, along the axes of its definition.

        None where it has none: `samples` say where its gap lies.
        """
        ...

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats adding each of these names to the hypothesis would gain, all segments; cheap."""
        ...

    def proposals(self) -> Sequence[Names]:
        """Sets of effects (without the refitted ones) that signatures suggest; may be empty."""
        ...

    def simplify(self, names: Names) -> Sequence[Names]:
        """Sets that may say the same with fewer effects: a torque constant for everything scaled."""
        ...

    def confusable(self, name: str) -> Names:
        """Effects known to be hard to tell from this one."""
        ...

    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the effect, at these parameters, is smaller than this simulator's own tolerance."""
        ...

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the parameters betray a stand-in for something else: at a bound, or not constant over segments."""
        ...

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether parts of the recording ask for other sizes of it, as of no true one even where all is explained."""
        ...

    def wavers(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether most of what is left is its doing, at sizes that differ from instant to instant."""
        ...

    def may_vanish(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether another recording may show none of it, where something is left."""
        ...

    def intervals(self, hypothesis: Hypothesis) -> Intervals:
        """95 % of every parameter of `values`, from all segments, honest where residuals depend on each other."""
        ...

    def experiment(self, rivals: Sequence[Hypothesis], not_excited: Sequence[str]) -> Experiment:
        """The recording to make next; its sentence is empty where none is needed.

        It tells the rivals apart: the candidate whose predictions under them differ most. And it excites the
        `not_excited` effects. Where no candidate does, it shows most of all other effects, of joints and tosses.
        """
        ...


@runtime_checkable
class BesideUnknown(Case, Protocol):
    """A case whose discrepancies, all at once, are integrated out: what fits them has its `evidence` in `extra`."""

    disturbance: Names  # a name that is fitted beside them: what is of its own instants, no function. None: it has none

    def starts_beside(self, hypothesis: Hypothesis, names: Sequence[str]) -> Mapping[str, tuple[float, Hypothesis]]:
        """About how many nats each effect would gain beside the unknown of a hypothesis, and where its fit begins."""
        ...

    def unbounded(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether a limit that an effect is may as well be beyond all that is tried, as another motion would tell."""
        ...


@runtime_checkable
class Elsewhere(Case, Protocol):
    """A case that knows how far values hang on this recording where a hypothesis lacks something."""

    def intervals_elsewhere(self, hypothesis: Hypothesis) -> Intervals:
        """95 % intervals of what another recording would say, where the hypothesis lacks something."""
        ...


class Fit(Protocol):
    """What fitting needs of an effect, as far as it is the same for all kinds."""

    @property
    def confusable(self) -> Names:
        """Effects that may pass for this one; one side of a pair is enough."""
        ...


def intervals_of(case: Case, hypothesis: Hypothesis, elsewhere: bool) -> Intervals:
    """A hypothesis' intervals; those of what another recording would say where that is asked and the case knows it."""
    if elsewhere and isinstance(case, Elsewhere):
        return case.intervals_elsewhere(hypothesis)
    return case.intervals(hypothesis)


def confusable(name: str, fits: Iterable[tuple[str, Fit]]) -> Names:
    """Effects that may pass for this one, by either side's record; none for what is no effect."""
    records = dict(fits)
    own = records[name].confusable if name in records else frozenset()
    return own | {other for other, fit in records.items() if name in fit.confusable}
