"""Where the gap of an arm lies: by its tip's height and distance, by postures, and by whether goals stand still."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vision_s2r.fit.arm.free_run import gap_errors, tips
from vision_s2r.fit.bins import evenly
from vision_s2r.fit.case import Axis, Samples
from vision_s2r.recording import ArmRecording

BINS, ENDS = 5, "{low:.3g} to {high:.3g}"
STILL = 0.2  # s that goals have stood still
LEAST = 1e-3  # rad or m, that a joint is asked to go


def samples(recording: ArmRecording, states: np.ndarray, noise: np.ndarray, held_out: Mapping[str, Any]) -> Samples:
    """Mean squared errors of all joints in a free run [E, T, J, 2], by the stretches of a report's `held_out`.

    `noise` [J] is the variance of each joint's positions.
    """
    stretch = np.full(states.shape[:2], -1)
    for k, (episode, first, end, _) in enumerate(held_out["segments"]):
        stretch[recording.episodes.index(episode), first:end] = k
    errors = gap_errors(recording, states).mean(axis=-1)
    inside = (stretch >= 0) & np.isfinite(errors)
    return Samples(
        error=errors[inside],
        floor=np.full(int(inside.sum()), float(np.mean(noise))),
        segment=stretch[inside],
        axes=tuple(_axes(recording, inside)),
    )


def _axes(recording: ArmRecording, inside: np.ndarray) -> list[Axis]:
    """Of the rows that are inside [E, T]."""
    found = [Axis("goals", ("goals stand still", "goals move"), _moving(recording)[inside])]
    for name, joint in recording.joints.items():
        # What touches an arm moves all of its joints a little: goals do not follow.
        asked = recording.modes[name] == "position"
        values = (joint.command if asked else joint.position)[inside]
        if np.ptp(values) >= LEAST:
            words = f"{ENDS} {'rad' if joint.units == 'rotary' else 'm'}"
            found.append(Axis(f"{'goal' if asked else 'position'} of {name}", *evenly(values, BINS, words)))
    if recording.tip is not None:
        tip = tips(recording, {}, recording.position)[inside]
        out = np.hypot(tip[:, 0], tip[:, 1])
        found += [
            Axis("height of the tip", *evenly(tip[:, 2], BINS, f"{ENDS} m")),
            Axis("distance of the tip from the vertical axis", *evenly(out, BINS, f"{ENDS} m")),
        ]
    time = np.broadcast_to(recording.any.time, inside.shape)
    return [*found, Axis("time", *evenly(time[inside], BINS, f"t {ENDS} s"))]


def _moving(recording: ArmRecording) -> np.ndarray:
    """0 where all goals [E, T] have stood still for a while, else 1."""
    reach = max(round(STILL / recording.any.sample_time), 1)
    goals = np.stack([joint.command for joint in recording.joints.values()])
    changes = (np.diff(goals, axis=-1) != 0).any(axis=0)
    moving = np.zeros(recording.any.command.shape, dtype=int)
    for row, changed in zip(moving, changes, strict=True):
        row[1:] = np.convolve(changed, np.ones(reach))[: len(changed)] > 0
    return moving
