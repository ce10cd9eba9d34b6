"""An arm, diagnosed joint by joint, with what is common to all joints; and how far its whole free run is off.

Each joint is searched as any joint is, under the load of the others. A payload, a tilted base and each hinge's zero are
tried over all of them at once, alone and together, and kept where they leave fewer joints unexplained, or need fewer
names, than the joints alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from vision_s2r.arm.effect import ARM_EFFECTS, OFFSET
from vision_s2r.arm.model import opened
from vision_s2r.diagnose.arm_commands import commands
from vision_s2r.diagnose.arm_look import REMARKABLE, likely, off
from vision_s2r.diagnose.arm_report import IMPROBABLE, SettledArm, held_out, report
from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.borne_out import idle
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.one_case import Diagnosis, diagnose_one, open_case
from vision_s2r.diagnose.report import OPEN
from vision_s2r.diagnose.saved import SavedDiagnosis
from vision_s2r.diagnose.touched import touching, untouched
from vision_s2r.errors import UserError, nearest
from vision_s2r.fit.arm.base_tilt import BaseTiltForm
from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.arm.payload import PayloadForm
from vision_s2r.fit.arm.position_offset import PositionOffsetForm
from vision_s2r.fit.arm.problems import motions, problems
from vision_s2r.fit.arm.several import fitted_sets, grown_sets, refined
from vision_s2r.fit.arm.touch import TipTouch
from vision_s2r.fit.arm.whole import FoundWhole, RoughWhole, WholeFit, WholeForm, explained, sharpened
from vision_s2r.fit.case import Experiment, Values
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.recording import ArmRecording, JointRecording
from vision_s2r.report.arm import figures, touch_figure
from vision_s2r.report.drawing import Figures

NOT_OF_ARMS = ("gravity_torque", OFFSET)  # of its joints alone: the bodies' weight is the model's
MUCH = 0.3  # of what is over the noise, that an effect of the whole arm explains where it is there
MANY = 100  # parameters, more than any of these has
MOST = 3  # of them at once
SPRINGS = 2  # joints at most, that a spring pulls at
RIVALS = 3  # of these sets that the joints are searched beside
ALIKE = 1.03  # times what the best of them leaves, and another one is not told from it


@dataclass(frozen=True, kw_only=True)
class ArmDiagnosis(SavedDiagnosis):
    """A report that knows what it was made from."""

    recording: ArmRecording = field(repr=False)
    parts: dict[str, Diagnosis] = field(repr=False)  # of each joint
    found: Values = field(repr=False)  # by JOINT.EFFECT
    touch: TipTouch | None = field(repr=False)  # what the tip touches in rows that the recording is without

    @property
    def patched(self) -> bool:
        """Whether the simulator has anything that it had not."""
        return bool(self.found)

    def plot(self) -> Figures:
        """Figures by caption: the stretch in which the arm is furthest off, and which joints the gap is of."""
        drawn = figures(self.recording, self.found, self.to_dict())
        return Figures(drawn | touch_figure(self.touch)) if self.touch else drawn


def diagnose_arm(recording: ArmRecording, cfg: DiagnoseConfig, jobs: int = 1) -> ArmDiagnosis:
    """Diagnose an arm with `jobs` threads. Raises UserError as `diagnose` does."""
    for name in cfg.withhold:
        if name not in ARM_EFFECTS:
            known = [effect.name for effect in ARM_EFFECTS]
            raise UserError(f"withhold: no effect is called '{name}': {nearest(name, known)}")
    runs, touch = untouched(FreeRuns(recording), _of_joints(cfg, IMPROBABLE), jobs)
    free = runs.recording
    settled = _settle(runs, cfg, jobs)
    least = {name: cfg.joint.relief * part.case.floor([0])[0] for name, part in settled.parts.items()}
    settled = replace(settled, idle=idle(runs, held_out(free, settled), settled.named, least, cfg.seed, jobs))
    written = report(runs, settled, cfg)
    written = touching(written, recording, touch) if touch else written
    experiment = Experiment(written["next_experiment"], commands(settled.parts, free))
    return ArmDiagnosis.of(
        written, recording=free, experiment=experiment, parts=settled.parts, found=settled.found, touch=touch
    )


def _settle(runs: FreeRuns, cfg: DiagnoseConfig, jobs: int) -> SettledArm:
    """The joints with the effects of the whole arm that they need, if any.

    Those that explain most are tried first; of several that say the same, those of fewest parameters.
    """
    recording, moved = runs.recording, motions(runs, {})
    servos = all(joint.servo for joint in recording.joints.values())
    fits = {form: WholeFit(runs, moved, form, {}) for form in _forms(recording, cfg) if servos}
    off = max((int((fit.before > REMARKABLE).sum()) for fit in fits.values()), default=0)
    found = _of_whole(runs, fits) if off else []
    least = min((each.left for each in found), default=0.0)
    alike = [each for each in found if each.left <= ALIKE * least]

    def simplest_first(each: RoughWhole) -> tuple[int, float]:
        return each.size if each in alike else MANY, -each.share

    tried = []
    # Beside a set that leaves nothing of the arm, others that leave something are no rivals, and slow to search beside.
    rivals = alike if least < REMARKABLE else found
    for each in sorted(rivals, key=simplest_first)[:RIVALS]:
        settled = _under(sharpened(runs, each), runs, cfg, jobs)
        tried.append(replace(settled, alike=_alike(each, alike)))
        alone = each.left < REMARKABLE or tried[-1].cost == (0, len(each.forms))
        if alone and tried[-1].cost[0] == 0 and off > 1:
            return tried[-1]
    bare = _with_springs(_under((), runs, cfg, jobs), cfg, jobs)
    return min([*tried, bare], key=lambda settled: settled.cost)


def _of_whole(runs: FreeRuns, fits: Mapping[WholeForm, WholeFit]) -> list[RoughWhole]:
    """Effects of the whole arm that explain much, and sets of several while these leave much less."""
    before = float(next(iter(fits.values())).before.mean())
    single = [each for each in (fit.fit() for fit in fits.values()) if each.share >= MUCH]
    found = [refined(runs, each, before) for each in single]
    for size in range(2, min(MOST, len(fits)) + 1):
        least = min((each.left for each in found), default=before)
        if least < REMARKABLE:
            break
        sets = fitted_sets(runs, fits, size)
        if smaller := [each for each in found if len(each.forms) == size - 1]:
            sets += grown_sets(runs, list(fits), min(smaller, key=lambda each: each.left), before)
        sets = [each for each in sets if explained(least, each.left) >= MUCH]
        sets = list({each.names: each for each in sorted(sets, key=lambda each: -each.left)}.values())
        if not sets:
            break
        found += sets
    return found


def _alike(found: RoughWhole, alike: list[RoughWhole]) -> dict[str, tuple[str, ...]]:
    """For each effect of those found, others that say the same in its place."""
    others = [each.names for each in alike if found in alike and each.size >= found.size]
    swaps = [(found.names - names, names - found.names) for names in others]
    return {
        name: tuple(rival for gone, instead in swaps if gone == {name} and len(instead) == 1 for rival in instead)
        for name in found.names
    }


def _forms(recording: ArmRecording, cfg: DiagnoseConfig) -> list[WholeForm]:
    gravity = np.array(opened(recording.model).spec.option.gravity)
    forms: list[WholeForm] = [PayloadForm()]
    if gravity.any():
        forms.append(BaseTiltForm(gravity))
        hinges = [name for name, joint in recording.joints.items() if joint.units == "rotary"]
        forms += [PositionOffsetForm(name) for name in hinges if OFFSET not in cfg.withhold]
    return [form for form in forms if form.name not in cfg.withhold]


def _under(whole: tuple[FoundWhole, ...], runs: FreeRuns, cfg: DiagnoseConfig, jobs: int) -> SettledArm:
    """The joints, the worst first: what it has is in the motion that loads the others."""
    recording = runs.recording
    own = _of_joints(cfg, IMPROBABLE)
    weight = {name: given for each in whole for name, given in each.values.items()}
    near, made = dict(weight), problems(recording, motions(runs, weight), weight)
    parts: dict[str, Diagnosis] = {}
    for _ in recording.joints:
        every = zip(made.joints.items(), runs.noise, strict=True)
        rest = {name: off(joint) / noise for (name, joint), noise in every if name not in parts}
        name = max(rest, key=lambda each: rest[each])
        guess, made, case = likely(runs, made, name, near, weight, own, jobs)
        parts[name] = diagnose_one(made.joints[name], own, jobs, case)
        told = near | made.of_arm(name, parts[name].settled.simulator.hypothesis.values)
        near = min(guess, told, key=lambda each: runs.error(name, each))
        if near != guess:
            made = problems(recording, motions(runs, near), weight)
    return SettledArm(whole, made, {name: parts[name] for name in recording.joints})


def _with_springs(settled: SettledArm, cfg: DiagnoseConfig, jobs: int) -> SettledArm:
    """With constant torques on joints, where there are few of which they explain all that is left.

    Where something is left in any case, a constant torque does the work of a gain, or of a friction under load, in
    postures like those of the recording, and in no others.
    """
    unexplained = [name for name, part in settled.parts.items() if part.verdict in OPEN]
    if IMPROBABLE in cfg.withhold or len(unexplained) > SPRINGS:
        return settled
    pulled = {name: _pulled(settled.problems.joints[name], settled.parts[name], cfg, jobs) for name in unexplained}
    return replace(settled, parts={**settled.parts, **pulled})


def _pulled(joint: JointRecording, found: Diagnosis, cfg: DiagnoseConfig, jobs: int) -> Diagnosis:
    """A joint's diagnosis with a constant torque, where that takes away most of what is left, and all in the end."""
    own = _of_joints(cfg)
    case = open_case(joint, own.withhold, jobs)
    assessor = Assessor(case, cfg.joint, jobs, cfg.seed)
    simulator = found.settled.simulator
    with case.session():
        least = assessor.one(simulator.names, simulator.hypothesis)
        pulled = assessor.one(least.names | {IMPROBABLE}, least.hypothesis)
        if not assessor.most(pulled, least):
            return found
    other = diagnose_one(joint, own, jobs)
    return found if other.verdict in OPEN else other


def _of_joints(cfg: DiagnoseConfig, *names: str) -> DiagnoseConfig:
    """The configuration of a joint's own diagnosis, without these effects.

    Its load is another engine's, and in part measured: what is sure, but faint beside the noise, may be of that.
    """
    withheld = {*NOT_OF_ARMS, *names, *(name for name in cfg.withhold if name in JOINT_EFFECTS)}
    search = replace(cfg.joint, faint=max(cfg.joint.faint, cfg.joint.relief))
    return replace(cfg, joint=search, withhold=sorted(withheld))
