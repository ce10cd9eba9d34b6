"""An arm as one problem a joint: the load of all others, and its own inertia, are inputs to each.

The load is that in the simulated arm, step by step, and what measured motion changes of it. Accelerations of that
motion are the simulated ones with what differs between measured and simulated positions, smoothed: what commands cause
at once is in the simulation already.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vision_s2r.fit.arm.free_run import bodies_of, free_runs
from vision_s2r.fit.case import Values
from vision_s2r.fit.joint.slopes import slopes
from vision_s2r.recording import ArmRecording, JointRecording

SMOOTH = 0.015  # s to either side, over which the difference is smoothed, and 2 rows at least
ROTOR = 1e-9  # kg·m², of a rotor at least


@dataclass(frozen=True)
class Motion:
    """How an arm moved in one episode, N rows of J joints: rad (m), rad/s, rad/s²."""

    position: np.ndarray  # [N, J]
    velocity: np.ndarray
    acceleration: np.ndarray
    load: np.ndarray  # [N, J] N·m (N): the simulated arm's on its joints, from row to row, less that at its rows


@dataclass(frozen=True)
class Problems:
    """The joints of an arm as recordings of their own, whose inertia is that of rotor and bodies."""

    joints: dict[str, JointRecording]
    bodies: dict[str, float]  # kg·m² or kg: the bodies' part of each nominal inertia, the least that there is

    def of_arm(self, joint: str, values: Values) -> dict[str, dict[str, float]]:
        """A joint's effects under their names in the arm, where an inertia is the rotor's."""
        return {f"{joint}.{name}": self.of_rotor(joint, name, given) for name, given in values.items()}

    def of_rotor(self, joint: str, name: str, given: Mapping[str, float]) -> dict[str, float]:
        """An effect's values, an inertia's without the bodies."""
        if name != "inertia":
            return dict(given)
        return {key: max(value - self.bodies[joint], ROTOR) for key, value in given.items()}


def motions(recording: ArmRecording, effects: Values) -> list[Motion]:
    """The motion that the recording shows, episode by episode; a simulation with these effects is near."""
    bodies, some, measured = bodies_of(recording, effects), recording.any, recording.position
    half, found = max(2, round(SMOOTH / some.sample_time)), []
    for k, run in enumerate(free_runs(recording, effects)):
        length = run.states.shape[1]
        t, simulated = some.time[k, :length], run.states.transpose(1, 0, 2)
        reach = min(half, (length - 1) // 2)

        def slope(values: np.ndarray, t: np.ndarray = t, reach: int = reach) -> np.ndarray:
            return np.stack([slopes(column, t, reach) for column in values.T], axis=1)

        rest = slope(measured[k, :length] - simulated[..., 0])
        rates = np.gradient(simulated[..., 1], t, axis=0)
        at_rows = _between(bodies.loads(simulated[..., 0], simulated[..., 1], rates)[0])
        found.append(Motion(measured[k, :length], simulated[..., 1] + rest, rates + slope(rest), run.load - at_rows))
    return found


def problems(recording: ArmRecording, moved: list[Motion], payload: Values) -> Problems:
    """The joints of a recording, under the loads that this motion puts on them, with the payload if there is one."""
    return with_loads(recording, moved, loads(recording, moved, payload))


def loads(recording: ArmRecording, moved: list[Motion], payload: Values) -> list[np.ndarray]:
    """Torque and inertia [2, N, J] at the rows of each episode."""
    bodies = bodies_of(recording, payload)
    return [np.array(bodies.loads(each.position, each.velocity, each.acceleration)) for each in moved]


def with_loads(recording: ArmRecording, moved: list[Motion], of_rows: list[np.ndarray]) -> Problems:
    """The joints under these torques and with these inertias."""
    shape = recording.any.position.shape
    joints, least = {}, {}
    for j, (name, joint) in enumerate(recording.joints.items()):
        external, own = np.zeros(shape), np.zeros(shape)
        for k, (each, rows) in enumerate(zip(moved, of_rows, strict=True)):
            torque, inertia = each.load[:, j] + _between(rows[0])[:, j], _between(rows[1])[:, j]
            external[k, : len(torque)], external[k, len(torque) :] = torque, torque[-1]
            own[k, : len(torque)], own[k, len(torque) :] = inertia, inertia[-1]
        least[name] = float(own.min())
        nominal = joint.nominal | {"inertia": joint.nominal["inertia"] + least[name]}
        joints[name] = replace(joint, nominal=nominal, external=external, load_inertia=own - least[name])
    return Problems(joints, least)


def _between(rows: np.ndarray) -> np.ndarray:
    """Of values [N, J] at rows, the means from each row to the next."""
    return np.concatenate([(rows[1:] + rows[:-1]) / 2, rows[-1:]])
