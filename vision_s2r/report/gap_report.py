"""A report in memory: typed, and the same as its report.json."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Self, cast, get_args, get_origin, get_type_hints

from vision_s2r.errors import UserError
from vision_s2r.report import words
from vision_s2r.report.page import framed, html
from vision_s2r.report.reading import FORMAT, read_report

Interval = tuple[float, float]  # 95 %


@dataclass(frozen=True)
class GapShare:
    """A share of the gap."""

    share: float
    ci: Interval


@dataclass(frozen=True, kw_only=True)
class GapSize:
    """How large the gap is, on episodes or frames that no parameter was fitted to."""

    metric: str  # velocity_rmse
    unit: str  # rad/s
    described: str | None = None
    before: float  # of the simulator as it came
    refitted: float | None = None  # with its nominal parameters refitted
    after: float  # with the effects found
    floor: float  # measurement noise
    shrink: float  # (before - after) / (before - floor)
    shrink_ci: Interval
    shrink_by_refitting: GapShare | None = None
    shrink_by_effects: GapShare | None = None


@dataclass(frozen=True)
class SourceShare:
    """What one of the sources of the reality gap is to blame for."""

    source: str
    share: float
    ci: Interval


@dataclass(frozen=True)
class Place:
    """Where the gap lies: a bin that holds more of it than of the samples."""

    axis: str
    at: str
    share: float
    ci: Interval | None = None
    samples: float | None = None  # share of the samples
    effect: str | None = None  # the named effect whose place it is: shares are of what it does


@dataclass(frozen=True)
class FoundParameter:
    """A parameter of an effect."""

    value: float
    unit: str
    ci: Interval


@dataclass(frozen=True)
class FoundEffect:
    """An effect that the simulator lacks, or a nominal value that is wrong in it."""

    name: str
    source: str
    share: float
    ci: Interval
    evidence: float  # nats of held-out log-likelihood
    parameters: dict[str, FoundParameter]
    joint: str | None = None  # of an arm's effect
    label: int | None = None  # of an effect of one label
    label_name: str | None = None  # what the recording calls it
    patched: bool | None = None  # False: sure beside something unknown, without which no free run is better for it


@dataclass(frozen=True)
class RefittedValue:
    """What the simulator has without a name: a nominal parameter as the data ask for it, or what closes too little."""

    name: str
    source: str
    parameters: dict[str, FoundParameter]
    joint: str | None = None
    label: int | None = None


@dataclass(frozen=True)
class HeldOut:
    """What a replay of the very recording needs to see it as the report did."""

    recording: str  # its fingerprint
    segments: tuple[tuple[int, int, int, int], ...]  # episode, first row, row behind the last, fold
    folds: tuple[dict[str, dict[str, float]], ...]  # effects with their parameters, from all but each fold
    without: tuple[tuple[int, int, int], ...] | None = None  # rows left out: episode (index), first, behind the last


@dataclass(frozen=True)
class Touches:
    """What an arm's tip touches and its simulator has not, in rows that the diagnosis left out."""

    height: float  # m, of the tip
    follows: float  # of its way below that, by which it stays above the simulated one: 1 of what is rigid
    above: float  # m, the median
    times: int
    share: float  # of all rows
    verdict: str  # of the other rows


@dataclass(frozen=True)
class SizeBounds:
    """Between what a parameter of an effect without a name could be; None: without end."""

    unit: str
    ci: tuple[float | None, float | None]


@dataclass(frozen=True)
class Candidate:
    """What became of an effect that was asked about."""

    name: str
    status: str  # present | absent | not_excited | confusable | undecided
    evidence: float
    confusable_with: tuple[str, ...]
    reason: str | None = None  # why it is not excited, or not named
    could_be: dict[str, SizeBounds] | None = None  # by parameter, how large it could be, where that was asked
    joint: str | None = None
    label: int | None = None


@dataclass(frozen=True)
class Alternative:
    """Another set of effects, with its evidence against the simulator as it came."""

    effects: tuple[str, ...]
    evidence: float


@dataclass(frozen=True)
class Unexplained:
    """What no named effect explains."""

    share: float
    ci: Interval
    where: tuple[Place, ...]
    resembles: tuple[str, ...] | None = None


@dataclass(frozen=True)
class TipShare:
    """What a joint's effects, or the payload, close of the gap of an arm's tip."""

    of: str
    share: float
    ci: Interval


@dataclass(frozen=True)
class TipGap:
    """How far the tip of an arm is off in a free run, root mean square."""

    unit: str  # mm
    before: float
    after: float
    shares: tuple[TipShare, ...] = ()  # of the squared gap, the largest first


@dataclass(frozen=True)
class TorqueFactor:
    """A measured torque beside what is believed of it."""

    factor: float  # measured over believed
    ci: Interval
    explained: float  # of the variance of the measured one


@dataclass(frozen=True)
class JointTorque:
    """What the torque column of an arm's joint is beside the simulator."""

    said: str
    of_bodies: TorqueFactor  # what the model's bodies and friction ask for along the measured motion
    of_law: TorqueFactor  # what the drive's law gives


@dataclass(frozen=True)
class JointPart:
    """What an arm's report says of one joint."""

    verdict: str
    gap: GapSize
    effects: tuple[FoundEffect, ...]


@dataclass(frozen=True)
class UnsteadyLight:
    """Light that photographs do not share: fitted to each frame under every hypothesis."""

    differs_in: str  # exposure: each frame's own; field: and a smooth field of light besides
    exposure: tuple[float, ...]  # of each frame against the simulator's, with the effects named
    spread: float  # standard deviation of these
    unit: str


@dataclass(frozen=True)
class EffectCost:
    """What an effect alone costs a policy."""

    name: str
    strength: float  # 1: its moderate setting
    success: float
    ci: Interval
    lost: float  # of the success without any effect
    sure: bool  # whether the two intervals lie apart
    beyond: bool  # it is stronger than was tried: the cost is that of the strongest that was


@dataclass(frozen=True)
class PolicyCost:
    """What the camera's effects cost a policy, each alone, by curves of success against their strength."""

    row: str  # of the curves
    success: float  # without any effect
    ci: Interval
    effects: tuple[EffectCost, ...]  # the dearest first


@dataclass(frozen=True)
class ContentRival:
    """What may as well be contents that differ between two sets of pictures."""

    name: str  # of an effect; unexplained: what no effect explains
    statistic: str  # that it moves most
    shift: float  # by so many standard deviations between pictures of one place


@dataclass(frozen=True, kw_only=True)
class GapReport:
    """What a diagnosis says. A notebook shows it as its page."""

    format: str
    kind: str  # of the recording
    verdict: str  # no_gap | explained | partly_explained | unexplained
    gap: GapSize
    sources: tuple[SourceShare, ...]
    where: tuple[Place, ...]
    effects: tuple[FoundEffect, ...]  # the largest share first
    candidates: tuple[Candidate, ...]
    alternatives: tuple[Alternative, ...]
    unexplained: Unexplained
    next_experiment: str
    quick: bool | None = None  # whether it looked at a part of the recording, and tried few sets of effects
    refitted: tuple[RefittedValue, ...] | None = None
    withheld: tuple[str, ...] | None = None  # effects that were found, and make held-out data worse
    held_out: HeldOut | None = None  # of a joint
    light: UnsteadyLight | None = None  # of a paired camera's frames, where it differs between them
    contents: tuple[ContentRival, ...] | None = None  # of two sets of pictures without a scene in common
    touches: Touches | None = None  # of an arm, where it touches something
    left_out: dict[str, str] | None = None  # columns of the recording that were not used, and why
    torques: dict[str, JointTorque] | None = None  # of an arm whose log has torques, by joint
    tip: TipGap | None = None  # of an arm
    joints: dict[str, JointPart] | None = None  # of an arm, by name
    policy: PolicyCost | None = None  # of a camera, where the diagnosis was given curves

    @classmethod
    def of(cls, data: Mapping[str, Any], **more: Any) -> Self:
        """From what report.json holds. Raises TypeError for keys and values that a report does not have."""
        hints = get_type_hints(cls)
        return cls(**{str(key): _typed(hints.get(key, Any), each, str(key)) for key, each in data.items()}, **more)

    @classmethod
    def read(cls, path: Path | str) -> Self:
        """The report in a file. Raises UserError for what cannot be one."""
        try:
            return cls.of(read_report(path))
        except TypeError as error:
            raise UserError(f"{path}: {error}, expected a report as format '{FORMAT}' has it") from error

    def to_dict(self) -> dict[str, Any]:
        """What report.json holds."""
        found = {each.name: _plain(getattr(self, each.name)) for each in fields(GapReport)}
        return {name: each for name, each in found.items() if each is not None}

    def summary(self) -> str:
        """The verdict in sentences, and what to record next."""
        return "\n".join(filter(None, [words.verdict(self.to_dict()), self.next_experiment]))

    def _repr_html_(self) -> str:
        return framed(html(self.to_dict(), {}))


def _typed(kind: Any, value: Any, where: str) -> Any:
    """Plain data as this type. Raises TypeError for what is another, and for keys that it does not have."""
    if get_origin(kind) is UnionType:  # with None
        return None if value is None else _typed(get_args(kind)[0], value, where)
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        made = {key: _typed(hints.get(key, Any), each, key) for key, each in _a(dict, value, where).items()}
        return cast(Any, kind)(**made)
    if get_origin(kind) is tuple:
        kinds, values = get_args(kind), _a(list, value, where)
        if kinds[-1] is Ellipsis:
            kinds = (kinds[0],) * len(values)
        if len(kinds) != len(values):
            raise TypeError(f"{where} has {len(values)} values and not {len(kinds)}")
        return tuple(_typed(each, one, where) for each, one in zip(kinds, values, strict=True))
    if get_origin(kind) is dict:
        return {key: _typed(get_args(kind)[1], each, key) for key, each in _a(dict, value, where).items()}
    return value if kind is Any else _a(kind, value, where)


def _a(kind: Any, value: Any, where: str) -> Any:
    """The value, if it is of this kind; whole numbers are numbers too."""
    kinds = (int, float) if kind is float else (list, tuple) if kind is list else (kind,)
    large = isinstance(value, int) and abs(value) > sys.float_info.max
    if not isinstance(value, kinds) or large or (isinstance(value, bool) and kind is not bool):
        raise TypeError(f"{where} is {value!r:.40} and no {kind.__name__}")
    return value


def _plain(value: Any) -> Any:
    """As JSON has it, without what is None."""
    if is_dataclass(value):
        named = {each.name: getattr(value, each.name) for each in fields(value)}
        return {key: _plain(each) for key, each in named.items() if each is not None}
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    return value
