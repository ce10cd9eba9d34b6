"""What was imported, at a glance."""

from collections.abc import Mapping

import numpy as np

from vision_s2r.recording import JointRecording
from vision_s2r.report.drawing import AFTER, BEFORE, INK, canvas, plain, png

SHOWN = 30.0  # s of the longest episode


def picture(recording: JointRecording, columns: Mapping[str, np.ndarray]) -> bytes:
    """Position and command, velocity, and the steps between rows, of the longest episode, as PNG."""
    k = int(np.argmax(recording.lengths))
    t = recording.time[k, : recording.lengths[k]]
    shown = t <= SHOWN
    inside = columns["episode"] == recording.episodes[k]
    length = "rad" if recording.units == "rotary" else "m"
    figure, axes = canvas(3, 1, 7.0, sharex=True)
    top, middle, bottom = axes.flat
    top.plot(t[shown], recording.position[k, : len(t)][shown], color=INK, linewidth=1.2, label="position")
    if recording.servo:
        top.step(t[shown], recording.command[k, : len(t)][shown], where="post", color=BEFORE, lw=1, label="target")
    top.set_ylabel(f"position, {length}")
    top.legend(frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2)
    slope = np.gradient(recording.position[k, : len(t)], t)
    middle.plot(t[shown], slope[shown], color=INK, linewidth=0.8, alpha=0.5, label="slope of the position")
    if "velocity" in columns and inside.sum() == len(t):
        note = " (left out)" if "velocity" in recording.left_out else ""
        middle.plot(t[shown], columns["velocity"][inside][shown], color=AFTER, linewidth=1, label=f"velocity{note}")
    middle.set_ylabel(f"velocity, {length}/s")
    middle.legend(frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2)
    bottom.plot(t[1:][shown[1:]], 1e3 * np.diff(t)[shown[1:]], ".", color=INK, markersize=2)
    bottom.set_ylabel("step, ms")
    bottom.set_xlabel("t, s")
    for axis in axes.flat:
        plain(axis)
    return png(figure)
