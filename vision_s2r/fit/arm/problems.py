"""An arm as one problem a joint: the load of all others, and its own inertia, are inputs to each.

The load is that in the simulated arm, step by step, and what measured motion changes of it. Accelerations of that
motion are the simulated ones with what differs between measured and simulated positions, smoothed: what commands cause
at once is in the simulation already. Loads change within a row, where a command steps: they are those of the
simulation's steps.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vision_s2r.fit.arm.free_run import FreeRuns, bodies_of
from vision_s2r.fit.case import Values
from vision_s2r.fit.joint.slopes import slopes
from vision_s2r.recording import ArmRecording, JointRecording

SMOOTH = 0.015  # s to either side, over which the difference is smoothed at least, and 2 rows …
WIDER = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)  # … and times it, as far as the difference allows
CERTAIN = 3.0  # standard deviations of noise, within which the accelerations of a narrow and a wide window agree
ROTOR = 1e-9  # kg·m², of a rotor at least


@dataclass(frozen=True)
class Motion:
    """How an arm moved in one episode, N rows of J joints: rad (m), rad/s, rad/s²."""

    position: np.ndarray  # [N, J]
    velocity: np.ndarray
    acceleration: np.ndarray
    load: np.ndarray  # [N·S, J] N·m (N): the simulated arm's on its joints in S parts of each row, less that at rows


@dataclass(frozen=True)
class Problems:
    """The joints of an arm as recordings of their own, whose inertia is that of rotor and bodies."""

    joints: dict[str, JointRecording]

    def of_arm(self, joint: str, values: Values) -> dict[str, dict[str, float]]:
        """A joint's effects under their names in the arm, where an inertia is the rotor's."""
        return {f"{joint}.{name}": self.of_rotor(joint, name, given) for name, given in values.items()}

    def of_rotor(self, joint: str, name: str, given: Mapping[str, float]) -> dict[str, float]:
        """An effect's values, an inertia's without the bodies."""
        if name != "inertia":
            return dict(given)
        return {key: max(value - self.joints[joint].least_inertia, ROTOR) for key, value in given.items()}


def motions(runs: FreeRuns, effects: Values) -> list[Motion]:
    """The motion that a recording shows, episode by episode; a simulation with these effects is near."""
    recording = runs.recording
    bodies, some, measured = bodies_of(recording, effects), recording.any, recording.position
    found = []
    for k, run in enumerate(runs.run(effects, k) for k in range(len(some.lengths))):
        length = run.states.shape[1]
        t, simulated = some.time[k, :length], run.states.transpose(1, 0, 2)
        rest = measured[k, :length] - simulated[..., 0]
        faster, more = np.stack([_derivatives(*each, t) for each in zip(rest.T, runs.noise, strict=True)], axis=-1)
        rates = np.gradient(simulated[..., 1], t, axis=0)
        at_rows = bodies.loads(simulated[..., 0], simulated[..., 1], rates)[0]
        load = run.load - _between(at_rows, len(run.load) // length)
        found.append(Motion(measured[k, :length], simulated[..., 1] + faster, rates + more, load))
    return found


def _derivatives(values: np.ndarray, noise: float, t: np.ndarray) -> np.ndarray:
    """First and second derivative [2, N] of values [N] with noise of this standard deviation.

    By local parabolas, at each row of the widest window whose acceleration agrees with those of all narrower ones
    (the intersection of confidence intervals; Goldenshluger and Nemirovski, Mathematical Methods of Statistics 6,
    1997): next to nothing where there is nothing but noise, and sharp where there is a jump.
    """
    sample_time = float(np.median(np.diff(t)))
    narrowest, most = max(2, round(SMOOTH / sample_time)), (len(t) - 1) // 2
    out = np.zeros((2, len(t)))
    low, high = np.full(len(t), -np.inf), np.full(len(t), np.inf)
    for half in dict.fromkeys(min(round(narrowest * wider), most) for wider in WIDER):
        slope = slopes(values, t, half)
        bend = slopes(slope, t, half)
        reach = CERTAIN * noise * _spread(half, sample_time)
        low, high = np.maximum(low, bend - reach), np.minimum(high, bend + reach)
        agrees = low <= high
        out[:, agrees] = slope[agrees], bend[agrees]
    return out


def _spread(half: int, sample_time: float) -> float:
    """Standard deviation of the acceleration that white noise of variance 1 seems to have."""
    impulse, t = np.zeros(8 * half + 1), np.arange(8 * half + 1) * sample_time
    impulse[4 * half] = 1.0
    return float(np.linalg.norm(slopes(slopes(impulse, t, half), t, half)))


def problems(recording: ArmRecording, moved: list[Motion], whole: Values) -> Problems:
    """The joints of a recording, under the loads that this motion puts on them, with effects of the whole arm."""
    return with_loads(recording, moved, loads(recording, moved, whole))


def loads(recording: ArmRecording, moved: list[Motion], whole: Values) -> list[np.ndarray]:
    """Torque and inertia [2, N, J] at the rows of each episode."""
    bodies = bodies_of(recording, whole)
    return [np.array(bodies.loads(each.position, each.velocity, each.acceleration)) for each in moved]


def with_loads(recording: ArmRecording, moved: list[Motion], of_rows: list[np.ndarray]) -> Problems:
    """The joints under these torques and with these inertias."""
    shape = recording.any.position.shape
    parts = len(moved[0].load) // len(moved[0].position)
    loaded = [
        (each.load + _between(torque, parts), _between(inertia, parts))
        for each, (torque, inertia) in zip(moved, of_rows, strict=True)
    ]
    joints = {}
    for j, (name, joint) in enumerate(recording.joints.items()):
        external, own = (np.zeros((shape[0], shape[1] * parts)) for _ in range(2))
        for k, (torque, inertia) in enumerate(loaded):
            external[k, : len(torque)], external[k, len(torque) :] = torque[:, j], torque[-1, j]
            own[k, : len(torque)], own[k, len(torque) :] = inertia[:, j], inertia[-1, j]
        least = float(own.min())
        nominal = joint.nominal | {"inertia": joint.nominal["inertia"] + least}
        own -= least
        joints[name] = replace(joint, nominal=nominal, external=external, load_inertia=own, least_inertia=least)
    return Problems(joints)


def _between(rows: np.ndarray, parts: int) -> np.ndarray:
    """Of values [N, J] at rows, the means [N·S, J] of S parts of the way from each row to the next."""
    share = (np.arange(parts)[:, None] + 0.5) / parts
    following = np.concatenate([rows[1:], rows[-1:]])
    return np.asarray((rows[:, None] * (1 - share) + following[:, None] * share).reshape(-1, rows.shape[1]))
