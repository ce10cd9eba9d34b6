"""What the report of an arm says: what its joints' own reports do, in the terms of the whole arm's free run."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from vision_s2r.arm.effect import ARM_EFFECTS, OFFSET, WHOLE
from vision_s2r.diagnose.arm_torque import torques
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.locate import where
from vision_s2r.diagnose.one_case import Diagnosis
from vision_s2r.diagnose.report import ALTERNATIVES, NEAR_FLOOR, OPEN
from vision_s2r.diagnose.settled import LEAST_SHARE, is_slight
from vision_s2r.diagnose.tip import tip_gap, tip_shares
from vision_s2r.fit.arm.free_run import FreeRuns, by_stretch, fingerprint, gap_errors
from vision_s2r.fit.arm.places import samples
from vision_s2r.fit.arm.problems import Problems
from vision_s2r.fit.arm.whole import FoundWhole
from vision_s2r.fit.case import Values
from vision_s2r.fit.gap import Gap, Share
from vision_s2r.recording import ArmRecording
from vision_s2r.report.reading import FORMAT
from vision_s2r.statistics import shapley

IMPROBABLE = "bias_torque"  # of a joint whose bodies weigh what the model says: what pulls beside them is a spring
WORDS = (
    "position of all joints in a free run of the whole arm from each episode's first row to its end, "
    "on stretches that no fit has seen"
)


@dataclass(frozen=True)
class SettledArm:
    """The joints of an arm, diagnosed beside effects of the whole arm, or none."""

    whole: tuple[FoundWhole, ...]
    problems: Problems
    parts: dict[str, Diagnosis]
    alike: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # by name, what says the same of all joints
    idle: frozenset[str] = frozenset()  # effects of joints that the free run of the whole arm does not bear out

    @property
    def cost(self) -> tuple[int, int]:
        """Joints that are not explained, and names that it takes."""
        unsettled = sum(part.verdict not in ("no_gap", "explained") for part in self.parts.values())
        return unsettled, sum(len(part.effects) for part in self.parts.values()) + len(self.whole)

    @property
    def named(self) -> list[str]:
        """Effects that the joints' own reports name."""
        return [label(effect.name, name) for name, part in self.parts.items() for effect in part.effects]

    @property
    def of_whole(self) -> Values:
        """The effects of the whole arm."""
        return {name: given for each in self.whole for name, given in each.values.items()}

    @property
    def found(self) -> dict[str, Mapping[str, float]]:
        """The effects and refitted values of the whole arm."""
        return self.of_arm({name: part.settled.simulator.hypothesis.values for name, part in self.parts.items()})

    def of_arm(self, parts: Mapping[str, Values]) -> dict[str, Mapping[str, float]]:
        """Effects of each joint as those of the arm, with that of the whole."""
        found = dict(self.of_whole)
        own = {key: given for name in parts for key, given in self.problems.of_arm(name, parts[name]).items()}
        return found | {key: given for key, given in own.items() if key not in self.idle}


def label(effect: str, joint: str) -> str:
    """An effect of a joint among those of the arm."""
    return f"{joint}.{effect}"


def held_out(recording: ArmRecording, settled: SettledArm) -> dict[str, Any]:
    """What a replay of this very recording needs to see it as the report did."""
    parts = settled.parts
    first = next(iter(parts.values()))
    folds = [
        settled.of_arm({name: part.settled.simulator.folds[k].values for name, part in parts.items()})
        for k in range(len(first.settled.simulator.folds))
    ]
    assert first.held_out is not None
    return {
        "recording": fingerprint(recording),
        "segments": [list(each) for each in first.held_out.segments],
        "folds": folds,
    }


@dataclass(frozen=True)
class _Errors:
    """Mean squared errors [S, J] of the whole arm's free run, by segments and joints, and what noise makes of them."""

    before: np.ndarray
    loaded: np.ndarray  # with the effects of the whole arm alone
    after: np.ndarray
    floor: np.ndarray
    tip: dict[str, Any] | None
    seed: int

    @property
    def noise(self) -> np.ndarray:
        """Variance [J] of each joint's positions."""
        return np.asarray(self.floor.mean(axis=0))

    def gap(self, joint: int | slice) -> Gap:
        """Of one joint, or the mean over all."""
        before, after, floor = (
            each[:, joint] if isinstance(joint, int) else each.mean(axis=1)
            for each in (self.before, self.after, self.floor)
        )
        return Gap(before, before, after, floor, self.seed)

    def closed(self, joint: int, adequate: float) -> bool:
        """Whether a joint's gap is closed: what is left is noise, or as little of the gap as a name may not close.

        `adequate` is the excess that passes for noise, in units of its variance.
        """
        before, after, floor = (float(each[:, joint].mean()) for each in (self.before, self.after, self.floor))
        little = after - floor < LEAST_SHARE * (before - floor) and after < NEAR_FLOOR**2 * floor
        return little or after - floor <= adequate * floor

    def weight(self, joint: int) -> float:
        """The part of the arm's gap that is this joint's, beside that of the whole."""
        over = np.maximum((self.loaded - self.floor).mean(axis=0), 0.0)
        return float(over[joint] / max((self.before - self.floor).mean(axis=0).clip(0).sum(), over.sum(), 1e-300))


def report(runs: FreeRuns, settled: SettledArm, cfg: DiagnoseConfig) -> dict[str, Any]:
    """As report.json has it."""
    recording, held = runs.recording, held_out(runs.recording, settled)
    errors = _errors(runs, settled, held, cfg.seed)
    parts = {name: part.to_dict() for name, part in settled.parts.items()}
    told = _told(settled, parts, errors, partial(_has_gap, runs, settled, errors, held, cfg), cfg)
    gap = errors.gap(slice(None))
    closed = _closed_by_whole(runs, settled, held)
    told.effects.extend(_of_whole(each, gap.share(closed[each.name])) for each in settled.whole)
    told.candidates.extend(_whole_line(settled, effect.name) for effect in WHOLE)
    told.candidates.extend(_whole_line(settled, OFFSET, name) for name in parts)
    rest = gap.share(gap.after - gap.floor)
    weights = {name: errors.weight(j) for j, name in enumerate(parts)}
    said = _verdict(list(told.verdicts.values()), bool(told.effects))

    def places(states: np.ndarray) -> list[dict[str, Any]]:
        """Where a free run is off."""
        return where(samples(recording, states, errors.noise, held), cfg.seed)

    return {
        "format": FORMAT,
        "kind": recording.kind,
        "verdict": said,
        "gap": _gap(gap, recording) | {"described": WORDS},
        "tip": errors.tip,
        "sources": _sources(told.effects),
        "where": [
            *({"axis": "joint", "at": name, "share": share} for name, share in sorted(weights.items(), key=_falling)),
            *places(runs.states({})),
        ],
        "effects": sorted(told.effects, key=lambda effect: -effect["share"]),
        "refitted": told.refitted,
        "withheld": [
            *(label(effect, name) for name, part in parts.items() for effect in part.get("withheld", [])),
            *sorted(settled.idle),
        ],
        "candidates": told.candidates,
        "alternatives": sorted(told.alternatives, key=lambda each: -each["evidence"])[:ALTERNATIVES],
        "unexplained": {
            "share": rest.value,
            "ci": list(rest.ci),
            "where": places(runs.held_out(held)) if said in OPEN else [],
            "resembles": [f"{name}: {each}" for name, part in parts.items() for each in _resembles(part)],
        },
        "next_experiment": _next(parts),
        "held_out": held,
        "left_out": recording.left_out,
        "torques": torques(runs, settled.found, cfg.seed) or None,
        "joints": {
            name: {
                "verdict": told.verdicts[name],
                "gap": _gap(errors.gap(j), recording, name),
                "effects": [each for each in told.effects if each.get("joint") == name],
            }
            for j, name in enumerate(parts)
        },
    }


def _falling(share: tuple[str, float]) -> float:
    return -share[1]


@dataclass(frozen=True)
class _Told:
    """What the joints' reports say, in the terms of the arm."""

    effects: list[dict[str, Any]] = field(default_factory=list)
    refitted: list[dict[str, Any]] = field(default_factory=list)
    candidates: list[dict[str, Any]] = field(default_factory=list)
    alternatives: list[dict[str, Any]] = field(default_factory=list)
    verdicts: dict[str, str] = field(default_factory=dict)  # by joint


def _told(
    settled: SettledArm,
    parts: Mapping[str, Mapping[str, Any]],
    errors: _Errors,
    has_gap: Callable[[str], bool],
    cfg: DiagnoseConfig,
) -> _Told:
    """`has_gap`: whether a joint has one without what was refitted for it."""
    told = _Told()
    for j, (name, part) in enumerate(parts.items()):
        slight, named = [], []
        gone = {effect["name"] for effect in part["effects"] if label(effect["name"], name) in settled.idle}
        for effect in (effect for effect in part["effects"] if effect["name"] not in gone):
            share = _weighed(effect, errors.weight(j))
            if is_slight(share):
                slight.append(effect)
            else:
                named.append(_of_joint(settled, name, effect) | {"share": share.value, "ci": list(share.ci)})
        told.effects.extend(named)
        closed = errors.closed(j, cfg.joint.adequate)
        if closed and not named and part["verdict"] in OPEN:
            closed = not has_gap(name)
        told.verdicts[name] = _of_run(part["verdict"], bool(named), bool(gone), closed)
        values = (*part.get("refitted", []), *map(_value, slight))
        told.refitted.extend(_of_joint(settled, name, each) for each in values)
        undecided = {effect["name"] for effect in slight} | gone
        told.candidates.extend(_line(each, name, undecided) for each in [*part["candidates"], *_untried(part, cfg)])
        told.alternatives.extend(
            each | {"effects": [label(effect, name) for effect in each["effects"]]} for each in part["alternatives"]
        )
    return told


def _value(effect: Mapping[str, Any]) -> dict[str, Any]:
    """An effect that is nothing beside the arm's gap, as a value that was refitted: it stays in the simulator."""
    return {key: effect[key] for key in ("name", "source", "parameters")}


def _line(candidate: Mapping[str, Any], joint: str, slight: Collection[str]) -> dict[str, Any]:
    """What a joint's report says of an effect; what is real for the joint alone stays undecided for the arm."""
    undecided = {"status": "undecided"} if candidate["name"] in slight else {}
    return {**candidate, "joint": joint, **undecided}


def _untried(part: Mapping[str, Any], cfg: DiagnoseConfig) -> list[dict[str, Any]]:
    """A line for what a joint was diagnosed without: it is not told from what was found where something is left."""
    status = "undecided" if part["verdict"] in OPEN else "absent"
    known = {*cfg.withhold, *(each["name"] for each in part["candidates"])}
    line = {"name": IMPROBABLE, "status": status, "evidence": 0.0, "confusable_with": []}
    return [] if IMPROBABLE in known else [line]


def _errors(runs: FreeRuns, settled: SettledArm, held_out: Mapping[str, Any], seed: int) -> _Errors:
    recording, before = runs.recording, runs.states({})
    loaded = runs.states(settled.of_whole)
    after = runs.held_out(held_out)
    noise = [part.case.floor([0])[0] for part in settled.parts.values()]
    one, two, three = (
        by_stretch(recording, gap_errors(recording, states), held_out) for states in (before, loaded, after)
    )
    floor = np.tile(noise, (len(one), 1))
    tip = tip_gap(recording, settled.of_whole, before, after)
    if tip is not None:
        tip["shares"] = tip_shares(recording, settled.found, seed)
    return _Errors(one, two, three, floor, tip, seed)


def _has_gap(
    runs: FreeRuns, settled: SettledArm, errors: _Errors, held_out: Mapping[str, Any], cfg: DiagnoseConfig, joint: str
) -> bool:
    """Whether a joint has a gap of its own, which a free run without what was refitted for it shows."""
    recording = runs.recording
    others = {name: part.settled.simulator.hypothesis.values for name, part in settled.parts.items() if name != joint}
    left = by_stretch(recording, gap_errors(recording, runs.states(settled.of_arm(others))), held_out)
    return not replace(errors, after=left).closed(list(recording.joints).index(joint), cfg.joint.adequate)


def _of_joint(settled: SettledArm, joint: str, effect: Mapping[str, Any]) -> dict[str, Any]:
    """An effect of a joint's report as one of the arm's."""
    parameters = {}
    for key, one in effect["parameters"].items():
        value, low, high = (
            settled.problems.of_rotor(joint, effect["name"], {key: x})[key] for x in (one["value"], *one["ci"])
        )
        parameters[key] = {**one, "value": value, "ci": [low, high]}
    return {**effect, "joint": joint, "parameters": parameters}


def _weighed(effect: Mapping[str, Any], weight: float) -> Share:
    """The share of the arm's gap that is an effect's, of a joint that has this part of it."""
    low, high = effect["ci"]
    return Share(weight * effect["share"], (weight * low, weight * high))


def _closed_by_whole(runs: FreeRuns, settled: SettledArm, held_out: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The part [S] of the mean squared error that each effect of the whole arm closes, by Shapley."""

    def closed(on: frozenset[str]) -> np.ndarray:
        states = runs.states({name: given for name, given in settled.of_whole.items() if name in on})
        return -by_stretch(runs.recording, gap_errors(runs.recording, states), held_out).mean(axis=1)

    return shapley(list(settled.of_whole), closed)


def _of_whole(found: FoundWhole, share: Share) -> dict[str, Any]:
    joint, _, name = found.name.rpartition(".")
    units = {parameter.name: parameter.unit for parameter in ARM_EFFECTS[name].parameters}
    return {
        "name": name,
        **({"joint": joint} if joint else {}),
        "source": "dynamics",
        "share": share.value,
        "ci": list(share.ci),
        "evidence": found.evidence,
        "parameters": {
            key: {"value": value, "unit": units[key], "ci": list(found.ci[key])}
            for key, value in found.parameters.items()
        },
    }


def _whole_line(settled: SettledArm, name: str, joint: str | None = None) -> dict[str, Any]:
    own = name if joint is None else label(name, joint)
    found = next((each for each in settled.whole if each.name == own), None)
    rivals = [name for name, others in settled.alike.items() if own in others]
    status = "present" if found else "undecided" if rivals else "absent"
    evidence = 0.0 if found is None else found.evidence
    others = settled.alike.get(own, ()) if found else rivals
    said = {"name": name, "status": status, "evidence": evidence, "confusable_with": list(others)}
    return said if joint is None else said | {"joint": joint}


def _of_run(verdict: str, named: bool, idle_names: bool, closed: bool) -> str:
    """A joint's verdict beside the whole arm's free run: where that leaves next to nothing, nothing is left.

    What a joint's own problem leaves may be of the load, which is partly measured.
    """
    if closed:
        return "explained" if named else "no_gap"
    if verdict in ("no_gap", "explained") and not idle_names:
        return verdict
    return "partly_explained" if named else "unexplained"


def _verdict(joints: list[str], named: bool) -> str:
    """One for the arm, of those of its joints."""
    if not set(joints) - {"no_gap", "explained"}:
        return "explained" if named else "no_gap"
    return "partly_explained" if named else "unexplained"


def _gap(gap: Gap, recording: ArmRecording, joint: str | None = None) -> dict[str, Any]:
    shrink = gap.shrink(gap.after)
    linear = joint is not None and recording.joints[joint].units == "linear"
    return {
        "metric": "position_rmse",
        "unit": "m" if linear else "rad",
        **{key: float(np.sqrt(getattr(gap, key).mean())) for key in ("before", "after", "floor")},
        "shrink": shrink.value,
        "shrink_ci": list(shrink.ci),
    }


def _sources(effects: list[dict[str, Any]]) -> list[dict[str, Any]]:
    found = []
    for source in sorted({effect["source"] for effect in effects}):
        own = [effect for effect in effects if effect["source"] == source]
        ends = [min(sum(effect["ci"][k] for effect in own), 1.0) for k in (0, 1)]
        found.append({"source": source, "share": sum(effect["share"] for effect in own), "ci": ends})
    return sorted(found, key=lambda each: -each["share"])


def _resembles(part: Mapping[str, Any]) -> list[str]:
    return list(part["unexplained"].get("resembles") or [])


def _next(parts: Mapping[str, Mapping[str, Any]]) -> str:
    """What each joint asks for, those of one wish together."""
    wishes: dict[str, list[str]] = {}
    for name, part in parts.items():
        if part["next_experiment"]:
            wishes.setdefault(part["next_experiment"], []).append(name)
    return " ".join(f"{', '.join(names)}: {wish}" for wish, names in wishes.items())
