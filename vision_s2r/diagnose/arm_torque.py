"""What the torques of an arm's log say beside its simulator; the fit goes by commands and motion, and uses none.

Two things can be laid beside a torque at the joint: what the model's bodies and the joint's own friction ask for along
the measured motion, and what the drive's law gives, as the simulator believes both. Scales of the two tell a wrong gain
from a wrong weight, and a current without a sign from a torque.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vision_s2r.fit.arm.free_run import FreeRuns, bodies_of, of_whole
from vision_s2r.fit.arm.problems import motions
from vision_s2r.fit.case import Values
from vision_s2r.joint import NominalJoint
from vision_s2r.recording import JointRecording
from vision_s2r.recording.plausible import EXPLAINED, REVERSALS
from vision_s2r.statistics import interval

STRETCHES = 20  # that intervals are bootstrapped over
WHAT = {"of_bodies": "what bodies and friction ask for", "of_law": "what the drive's law gives"}
REST = 0.05  # of a joint's largest speed, below which friction has no direction


@dataclass(frozen=True)
class _Side:
    """A joint's rows [N], of all episodes: what was measured, and what is believed of it."""

    torque: np.ndarray  # N·m or N, as logged
    bodies: np.ndarray  # what bodies and rotor ask for along the measured motion
    law: np.ndarray  # what the drive's law gives
    velocity: np.ndarray


def torques(runs: FreeRuns, found: Values, seed: int) -> dict[str, dict[str, Any]]:
    """As `torques` of a report: of each joint that has a torque column, what that is beside the simulator.

    `found`: effects with which the simulated arm moves as the measured one does.
    """
    if not runs.recording.torque:
        return {}
    return {name: _told(side, runs.recording.joints[name], seed) for name, side in _sides(runs, found).items()}


def _sides(runs: FreeRuns, found: Values) -> dict[str, _Side]:
    recording, moved = runs.recording, motions(runs, found)
    bodies = bodies_of(recording, of_whole(found))
    of_bodies = [bodies.loads(each.position, each.velocity, each.acceleration) for each in moved]
    sides = {}
    for j, (name, joint) in enumerate(recording.joints.items()):
        if name not in recording.torque:
            continue
        rows: list[list[np.ndarray]] = []
        for k, (each, (load, inertia)) in enumerate(zip(moved, of_bodies, strict=True)):
            position, velocity = each.position[:, j], each.velocity[:, j]
            asked = (inertia[:, j] + joint.nominal["inertia"]) * each.acceleration[:, j] - load[:, j]
            law = _law(joint, recording.modes[name], joint.command[k, : len(position)], position, velocity)
            rows.append([recording.torque[name][k, : len(position)], asked, law, velocity])
        sides[name] = _Side(*(np.concatenate(each) for each in zip(*rows, strict=True)))
    return sides


def _law(
    joint: JointRecording, mode: str, command: np.ndarray, position: np.ndarray, velocity: np.ndarray
) -> np.ndarray:
    """What a joint's drive gives [N], as the simulator believes it, where the joint was measured to be."""
    if mode == "torque":
        return command
    if mode == "velocity":
        return np.asarray(joint.nominal["torque_constant"] * (command - velocity))
    return NominalJoint(**joint.nominal).asked(command, position, velocity)


def _told(side: _Side, joint: JointRecording, seed: int) -> dict[str, Any]:
    fast = np.abs(side.velocity) > REST * np.abs(side.velocity).max()
    direction = np.where(fast, np.sign(side.velocity), 0.0)
    constant = np.ones(len(direction))
    found = {
        "of_bodies": _compared(side.torque, side.bodies, np.stack([constant, side.velocity, direction], axis=1), seed),
        "of_law": _compared(side.torque, side.law, constant[:, None], seed),
    }
    turns = int(np.sum(np.diff(direction[direction != 0]) != 0))
    return {"said": _words(side.torque, found, turns, "N·m" if joint.units == "rotary" else "N"), **found}


def _compared(torque: np.ndarray, other: np.ndarray, beside: np.ndarray, seed: int) -> dict[str, Any]:
    """The factor of `other` [N] in a torque [N], beside functions [N, K] of any size, and what all of them explain."""
    size = np.maximum(np.linalg.norm(beside, axis=0), 1e-300)
    basis = np.linalg.qr(beside / size)[0]
    rest, one = torque - basis @ (basis.T @ torque), other - basis @ (basis.T @ other)
    above = np.array([part.sum() for part in np.array_split(rest * one, STRETCHES)])
    below = np.array([part.sum() for part in np.array_split(one**2, STRETCHES)])
    if below.sum() <= 0 or np.ptp(torque) == 0:
        return {"factor": 0.0, "ci": [0.0, 0.0], "explained": 0.0}
    factor = float(above.sum() / below.sum())
    left = np.sum((rest - factor * one) ** 2) / np.sum((torque - torque.mean()) ** 2)
    ends = interval(lambda counts: (counts @ above) / np.maximum(counts @ below, 1e-300), STRETCHES, seed)
    return {"factor": factor, "ci": list(ends), "explained": float(1 - left)}


def _words(torque: np.ndarray, found: Mapping[str, Mapping[str, Any]], turns: int, unit: str) -> str:
    """What the column is, of a joint that reverses so many times."""
    if np.ptp(torque) == 0:
        return f"never changes ({torque[0]:.3g} {unit}): it says nothing"
    told = [
        f"{each['factor']:.3g} times ({each['ci'][0]:.3g} to {each['ci'][1]:.3g}) {WHAT[name]}, which explains "
        f"{each['explained']:.0%} of it"
        for name, each in found.items()
        if each["explained"] >= EXPLAINED and each["factor"] > 0
    ]
    if told:
        return f"is {'; '.join(told)}"
    neither = f"is neither {' nor '.join(WHAT.values())}"
    if turns >= REVERSALS and ((torque >= 0).all() or (torque <= 0).all()):
        return (
            f"never changes its sign while the joint reverses {turns} times, and {neither}: a current without a sign? "
            f"Expected {unit} with the sign of the torque"
        )
    shares = " and ".join(f"{each['explained']:.0%}" for each in found.values())
    return f"{neither}, as the simulator believes them ({shares} of it)"
