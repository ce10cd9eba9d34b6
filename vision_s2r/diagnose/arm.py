"""An arm, diagnosed joint by joint, with what is common to all joints; and how far its whole free run is off.

Each joint is searched as any joint is, under the load of the others. A payload is tried over all of them at once, and
kept where it leaves fewer joints unexplained, or needs fewer names, than the joints alone.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from vision_s2r.arm.effect import ARM_EFFECTS, PAYLOAD
from vision_s2r.diagnose.borne_out import idle
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import Diagnosis, SavedDiagnosis, diagnose, open_case
from vision_s2r.diagnose.report import ALTERNATIVES
from vision_s2r.diagnose.simulator import is_slight
from vision_s2r.diagnose.tip import tip_gap, tip_shares
from vision_s2r.errors import UserError, nearest
from vision_s2r.fit.arm.free_run import FreeRuns, by_stretch, fingerprint, gap_errors
from vision_s2r.fit.arm.payload import FoundPayload, PayloadFit
from vision_s2r.fit.arm.problems import Problems, motions, problems
from vision_s2r.fit.case import Experiment, Values
from vision_s2r.fit.gap import Gap, Share
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.free_run import free_run as free_run_of_joint
from vision_s2r.fit.joint.free_run import gap_errors as gap_of_joint
from vision_s2r.fit.joint.track import fast_noise
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.recording import ArmRecording, JointRecording
from vision_s2r.report.arm import figures
from vision_s2r.report.drawing import Figures
from vision_s2r.report.reading import FORMAT

NOT_OF_ARMS = ("gravity_torque", "position_offset")  # the bodies' weight is the model's
REMARKABLE = 1.3  # times its noise's variance, that a joint leaves before a payload is tried
LOOKS, NEARER = 2, 0.5  # first looks at a joint, while each takes away this part of its mean squared error
MUCH = 0.3  # of what is over the noise, that a payload explains where it is one
WORDS = (
    "position of all joints in a free run of the whole arm from each episode's first row to its end, "
    "on stretches that no fit has seen"
)


@dataclass(frozen=True, kw_only=True)
class ArmDiagnosis(SavedDiagnosis):
    """A report that knows what it was made from."""

    recording: ArmRecording = field(repr=False)
    parts: dict[str, Diagnosis] = field(repr=False)  # of each joint
    found: Values = field(repr=False)  # by JOINT.EFFECT

    @property
    def patched(self) -> bool:
        """Whether the simulator has anything that it had not."""
        return bool(self.found)

    def plot(self) -> Figures:
        """Figures by caption: the stretch in which the arm is furthest off, and which joints the gap is of."""
        return figures(self.recording, self.found, self.to_dict())


@dataclass(frozen=True)
class _Settled:
    """The joints of an arm, diagnosed under the loads of one payload, or of none."""

    payload: FoundPayload | None
    problems: Problems
    parts: dict[str, Diagnosis]
    idle: frozenset[str] = frozenset()  # effects of joints that the free run of the whole arm does not bear out

    @property
    def cost(self) -> tuple[int, int]:
        """Joints that are not explained, and names that it takes."""
        unsettled = sum(part.verdict not in ("no_gap", "explained") for part in self.parts.values())
        return unsettled, sum(len(part.effects) for part in self.parts.values()) + (self.payload is not None)

    @property
    def named(self) -> list[str]:
        """Effects that the joints' own reports name."""
        return [label(effect.name, name) for name, part in self.parts.items() for effect in part.effects]

    @property
    def found(self) -> dict[str, dict[str, float]]:
        """The effects and refitted values of the whole arm."""
        return self.of_arm({name: part.settled.simulator.hypothesis.values for name, part in self.parts.items()})

    def of_arm(self, parts: Mapping[str, Values]) -> dict[str, dict[str, float]]:
        """Effects of each joint as those of the arm, with the payload."""
        found = {} if self.payload is None else {PAYLOAD: self.payload.values}
        own = {key: given for name in parts for key, given in self.problems.of_arm(name, parts[name]).items()}
        return found | {key: given for key, given in own.items() if key not in self.idle}


def diagnose_arm(recording: ArmRecording, cfg: DiagnoseConfig, jobs: int = 1) -> ArmDiagnosis:
    """Diagnose an arm with `jobs` threads. Raises UserError as `diagnose` does."""
    for name in cfg.withhold:
        if name not in ARM_EFFECTS:
            known = [effect.name for effect in ARM_EFFECTS]
            raise UserError(f"withhold: no effect is called '{name}': {nearest(name, known)}")
    runs = FreeRuns(recording)
    settled = _settle(runs, cfg, jobs)
    least = {name: cfg.joint.relief * part.case.floor([0])[0] for name, part in settled.parts.items()}
    settled = replace(settled, idle=idle(runs, _held_out(recording, settled), settled.named, least, cfg.seed))
    written = _report(runs, settled, cfg)
    experiment = Experiment(written["next_experiment"], _commands(settled.parts))
    return ArmDiagnosis.of(
        written, recording=recording, experiment=experiment, parts=settled.parts, found=settled.found
    )


def _settle(runs: FreeRuns, cfg: DiagnoseConfig, jobs: int) -> _Settled:
    """The joints with the payload that they need, if any."""
    recording = runs.recording
    servos = all(joint.servo for joint in recording.joints.values())
    fit = PayloadFit(recording, motions(runs, {}))
    off = int((fit.before > REMARKABLE).sum())
    if PAYLOAD in cfg.withhold or not off or not servos:
        return _under(None, runs, cfg, jobs)
    payload = fit.fit()
    if payload.share < MUCH:
        return _under(None, runs, cfg, jobs)
    closer = PayloadFit(recording, motions(runs, {PAYLOAD: payload.values}))  # the motion of an arm that has it
    loaded = _under(closer.fit(), runs, cfg, jobs)
    if loaded.cost == (0, 1) and off > 1:
        return loaded
    return min(loaded, _under(None, runs, cfg, jobs), key=lambda settled: settled.cost)


def _under(payload: FoundPayload | None, runs: FreeRuns, cfg: DiagnoseConfig, jobs: int) -> _Settled:
    """The joints, the worst first: what it has is in the motion that loads the others."""
    recording = runs.recording
    withheld = {*NOT_OF_ARMS, *(name for name in cfg.withhold if name in JOINT_EFFECTS)}
    own = replace(cfg, withhold=sorted(withheld))
    weight: Values = {} if payload is None else {PAYLOAD: payload.values}
    near, made = dict(weight), problems(recording, motions(runs, weight), weight)
    parts: dict[str, Diagnosis] = {}
    for _ in recording.joints:
        rest = {name: _excess(joint) for name, joint in made.joints.items() if name not in parts}
        name = max(rest, key=lambda each: rest[each])
        likely = _likely(runs, made, name, near, weight, own)
        if likely != near:
            made = problems(recording, motions(runs, likely), weight)
        parts[name] = diagnose(made.joints[name], own, jobs)
        told = near | made.of_arm(name, parts[name].settled.simulator.hypothesis.values)
        near = min(likely, told, key=lambda each: _off(runs, name, each))
        if near != likely:
            made = problems(recording, motions(runs, near), weight)
    return _Settled(payload, made, {name: parts[name] for name in recording.joints})


def _likely(
    runs: FreeRuns, made: Problems, joint: str, near: Values, weight: Values, cfg: DiagnoseConfig
) -> dict[str, Mapping[str, float]]:
    """Effects with which the arm moves much as it did, those of this joint by a first look at its problem.

    Where a joint is far off, so are the accelerations of those that it shakes, and what measured motion says of them is
    blurred where commands step. Nothing of this is reported.
    """
    best, noise = dict(near), fast_noise(made.joints[joint].position)
    for _ in range(LOOKS):
        if _off(runs, joint, best) < REMARKABLE * noise**2:
            break
        case = open_case(made.joints[joint], cfg.withhold)
        assert isinstance(case, JointCase)
        guess = best | made.of_arm(joint, case.likely.values)
        if _off(runs, joint, guess) > NEARER * _off(runs, joint, best):
            break
        best = guess
        made = problems(runs.recording, motions(runs, best), weight)
    return best


def _off(runs: FreeRuns, joint: str, effects: Values) -> float:
    """Mean squared error (rad² or m²) of a joint in a free run of the whole arm."""
    errors = gap_errors(runs.recording, runs.states(effects))
    return float(np.nanmean(errors[..., list(runs.recording.joints).index(joint)]))


def _excess(joint: JointRecording) -> float:
    """How far the simulator is off, in units of the noise."""
    return float(np.sqrt(np.nanmean(gap_of_joint(joint, free_run_of_joint(joint, {}))))) / max(
        fast_noise(joint.position), 1e-12
    )


@dataclass(frozen=True)
class _Errors:
    """Mean squared errors [S, J] of the whole arm's free run, by segments and joints, and what noise makes of them."""

    before: np.ndarray
    loaded: np.ndarray  # with the payload alone
    after: np.ndarray
    floor: np.ndarray
    tip: dict[str, Any] | None
    seed: int

    def gap(self, joint: int | slice) -> Gap:
        """Of one joint, or the mean over all."""
        before, after, floor = (
            each[:, joint] if isinstance(joint, int) else each.mean(axis=1)
            for each in (self.before, self.after, self.floor)
        )
        return Gap(before, before, after, floor, self.seed)

    def rest(self, joint: int) -> float:
        """What is left of a joint's mean squared error over the noise's variance, in units of that."""
        return float(self.after[:, joint].mean() / self.floor[:, joint].mean() - 1)

    def weight(self, joint: int) -> float:
        """The part of the arm's gap that is this joint's, beside the payload's."""
        over = np.maximum((self.loaded - self.floor).mean(axis=0), 0.0)
        return float(over[joint] / max((self.before - self.floor).mean(axis=0).clip(0).sum(), over.sum(), 1e-300))


def _report(runs: FreeRuns, settled: _Settled, cfg: DiagnoseConfig) -> dict[str, Any]:
    recording, held_out = runs.recording, _held_out(runs.recording, settled)
    errors = _errors(runs, settled, held_out, cfg.seed)
    parts = {name: part.to_dict() for name, part in settled.parts.items()}
    effects, refitted, candidates, alternatives, verdicts = [], [], [], [], {}
    for j, (name, part) in enumerate(parts.items()):
        weight = errors.weight(j)
        slight, named = [], []
        gone = {effect["name"] for effect in part["effects"] if label(effect["name"], name) in settled.idle}
        for effect in (effect for effect in part["effects"] if effect["name"] not in gone):
            share = _weighed(effect, weight)
            if is_slight(share):
                slight.append(effect)
            else:
                named.append(_of_joint(settled, name, effect) | {"share": share.value, "ci": list(share.ci)})
        effects += named
        adequate = errors.rest(j) <= cfg.joint.adequate
        verdicts[name] = _of_run(part["verdict"], bool(named), bool(gone), adequate)
        refitted += [_of_joint(settled, name, each) for each in (*part.get("refitted", []), *map(_value, slight))]
        undecided = {effect["name"] for effect in slight} | gone
        candidates += [_line(each, name, undecided) for each in part["candidates"]]
        alternatives += [
            each | {"effects": [label(effect, name) for effect in each["effects"]]} for each in part["alternatives"]
        ]
    gap = errors.gap(slice(None))
    if settled.payload is not None:
        effects.append(_payload(settled.payload, gap.share(np.asarray((errors.before - errors.loaded).mean(axis=1)))))
    candidates.append(_payload_line(settled, cfg))
    rest = gap.share(gap.after - gap.floor)
    return {
        "format": FORMAT,
        "kind": recording.kind,
        "verdict": _verdict(list(verdicts.values()), bool(effects)),
        "gap": _gap(gap, recording) | {"described": WORDS},
        "tip": errors.tip,
        "sources": _sources(effects),
        "where": [
            {"axis": "joint", "at": name, "share": errors.weight(j)}
            for j, name in sorted(enumerate(parts), key=lambda each: -errors.weight(each[0]))
        ],
        "effects": sorted(effects, key=lambda effect: -effect["share"]),
        "refitted": refitted,
        "withheld": [
            *(label(effect, name) for name, part in parts.items() for effect in part.get("withheld", [])),
            *sorted(settled.idle),
        ],
        "candidates": candidates,
        "alternatives": sorted(alternatives, key=lambda each: -each["evidence"])[:ALTERNATIVES],
        "unexplained": {
            "share": rest.value,
            "ci": list(rest.ci),
            "where": [],
            "resembles": [f"{name}: {each}" for name, part in parts.items() for each in _resembles(part)],
        },
        "next_experiment": _next(parts),
        "held_out": held_out,
        "left_out": recording.left_out,
        "joints": {
            name: {
                "verdict": verdicts[name],
                "gap": _gap(errors.gap(j), recording, name),
                "effects": [each for each in effects if each.get("joint") == name],
            }
            for j, name in enumerate(parts)
        },
    }


def _value(effect: Mapping[str, Any]) -> dict[str, Any]:
    """An effect that is nothing beside the arm's gap, as a value that was refitted: it stays in the simulator."""
    return {key: effect[key] for key in ("name", "source", "parameters")}


def _line(candidate: Mapping[str, Any], joint: str, slight: Collection[str]) -> dict[str, Any]:
    """What a joint's report says of an effect; what is real for the joint alone stays undecided for the arm."""
    undecided = {"status": "undecided"} if candidate["name"] in slight else {}
    return {**candidate, "joint": joint, **undecided}


def label(effect: str, joint: str) -> str:
    """An effect of a joint among those of the arm."""
    return f"{joint}.{effect}"


def _held_out(recording: ArmRecording, settled: _Settled) -> dict[str, Any]:
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


def _errors(runs: FreeRuns, settled: _Settled, held_out: Mapping[str, Any], seed: int) -> _Errors:
    recording, before = runs.recording, runs.states({})
    loaded = before if settled.payload is None else runs.states({PAYLOAD: settled.payload.values})
    after = runs.held_out(held_out)
    noise = [part.case.floor([0])[0] for part in settled.parts.values()]
    one, two, three = (
        by_stretch(recording, gap_errors(recording, states), held_out) for states in (before, loaded, after)
    )
    floor = np.tile(noise, (len(one), 1))
    payload = {} if settled.payload is None else {PAYLOAD: settled.payload.values}
    tip = tip_gap(recording, payload, before, after)
    if tip is not None:
        tip["shares"] = tip_shares(recording, settled.found, seed)
    return _Errors(one, two, three, floor, tip, seed)


def _of_joint(settled: _Settled, joint: str, effect: Mapping[str, Any]) -> dict[str, Any]:
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


def _payload(payload: FoundPayload, share: Share) -> dict[str, Any]:
    units = {parameter.name: parameter.unit for parameter in ARM_EFFECTS[PAYLOAD].parameters}
    return {
        "name": PAYLOAD,
        "source": "dynamics",
        "share": share.value,
        "ci": list(share.ci),
        "evidence": payload.evidence,
        "parameters": {
            name: {"value": value, "unit": units[name], "ci": list(payload.ci[name])}
            for name, value in payload.values.items()
        },
    }


def _payload_line(settled: _Settled, cfg: DiagnoseConfig) -> dict[str, Any]:
    found = settled.payload
    status = "absent" if found is None else "present"
    evidence = 0.0 if found is None else found.evidence
    return {"name": PAYLOAD, "status": status, "evidence": evidence, "confusable_with": []}


def _of_run(verdict: str, named: bool, idle_names: bool, adequate: bool) -> str:
    """A joint's verdict beside the whole arm's free run: where that leaves no more than noise, nothing is left.

    What a joint's own problem leaves may be of the load, which is partly measured.
    """
    if adequate:
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


def _commands(parts: Mapping[str, Diagnosis]) -> dict[str, np.ndarray]:
    """The experiments of all joints, one after the other, while the others are asked to stay."""
    rest = {}
    for name, part in parts.items():
        assert isinstance(part.recording, JointRecording)
        rest[name] = 0.5 * (np.nanmin(part.recording.command) + np.nanmax(part.recording.command))
    columns: dict[str, list[np.ndarray]] = {}
    count = 0
    for name, part in parts.items():
        if not part.experiment.commands:
            continue
        episode, t, command = part.experiment.commands.values()
        held = {f"command.{other}": np.full(len(t), value) for other, value in rest.items()}
        for key, values in ({"episode": episode + count, "t": t} | held | {f"command.{name}": command}).items():
            columns.setdefault(key, []).append(values)
        count += int(episode[-1]) + 1
    return {key: np.concatenate(values) for key, values in columns.items()}
