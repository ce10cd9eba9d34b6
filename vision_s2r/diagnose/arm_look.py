"""A first look at the joints of an arm: effects with which it moves much as it did, plausible or not."""

from collections.abc import Mapping

import numpy as np

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.one_case import open_case
from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.arm.problems import Problems, motions, problems
from vision_s2r.fit.case import Case, Values
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.free_run import free_run as free_run_of_joint
from vision_s2r.fit.joint.free_run import gap_errors as gap_of_joint
from vision_s2r.recording import ArmRecording, JointRecording

REMARKABLE = 1.3  # times its noise's variance, that a joint leaves before anything is looked for
LOOKS, NEARER = 2, 0.5  # first looks at a joint, while each takes away this part of its mean squared error


def first_look(recording: ArmRecording, cfg: DiagnoseConfig, jobs: int) -> Values:
    """Effects of all joints, the worst looked at first; `cfg` is that of joints."""
    runs, near = FreeRuns(recording), dict[str, Mapping[str, float]]()
    made, left = problems(recording, motions(runs, {}), {}), set(recording.joints)
    while left:
        name = max(sorted(left), key=lambda each: off(made.joints[each]))
        near, made, _ = likely(runs, made, name, near, {}, cfg, jobs)
        left.discard(name)
    return near


def likely(
    runs: FreeRuns, made: Problems, joint: str, near: Values, weight: Values, cfg: DiagnoseConfig, jobs: int
) -> tuple[dict[str, Mapping[str, float]], Problems, Case | None]:
    """Effects with which the arm moves much as it did, those of this joint by a first look at its problem.

    With them the joints' problems, and this one's case where it is open already. Where a joint is far off, so are the
    accelerations of those that it shakes, and what measured motion says of them is blurred where commands step. Nothing
    of this is reported.
    """
    best, noise, case = dict(near), runs.noise[list(made.joints).index(joint)], None
    for _ in range(LOOKS):
        if runs.error(joint, best) < REMARKABLE * noise**2:
            break
        case = open_case(made.joints[joint], cfg.withhold, jobs)
        assert isinstance(case, JointCase)
        guess = best | made.of_arm(joint, case.likely.values)
        if runs.error(joint, guess) > NEARER * runs.error(joint, best):
            break
        best, case = guess, None
        made = problems(runs.recording, motions(runs, best), weight)
    return best, made, None if cfg.quick else case


def off(joint: JointRecording) -> float:
    """How far the simulator is off, root mean square."""
    return float(np.sqrt(np.nanmean(gap_of_joint(joint, free_run_of_joint(joint, {})))))
