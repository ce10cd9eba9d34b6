"""The figures of an arm's diagnosis."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vision_s2r.fit.arm.free_run import free_run, gap_errors
from vision_s2r.fit.arm.touch import TipTouch
from vision_s2r.fit.case import Values
from vision_s2r.recording import ArmRecording
from vision_s2r.report import drawing
from vision_s2r.report.drawing import Figures

STRETCH = 500  # rows of an episode that are drawn


def figures(recording: ArmRecording, effects: Values, report: Mapping[str, Any]) -> Figures:
    """By caption: all joints where the arm is furthest off, and the gap of each joint before and after."""
    before, after = free_run(recording, {}), free_run(recording, effects)
    errors = np.nan_to_num(gap_errors(recording, before).sum(axis=-1))
    episode = int(np.argmax(errors.sum(axis=1) / recording.any.lengths))
    length = int(recording.any.lengths[episode])
    size = min(STRETCH, length)
    start = int(np.argmax(np.convolve(errors[episode, :length], np.ones(size), "valid")))
    rows = slice(start, start + size)
    panels = {
        f"{name}, {'rad' if joint.units == 'rotary' else 'm'}": {
            "measured": joint.position[episode, rows],
            "before": before[episode, rows, j, 0],
            "after": after[episode, rows, j, 0],
        }
        for j, (name, joint) in enumerate(recording.joints.items())
    }
    number = recording.episodes[episode]
    caption = f"Where the arm is furthest off: episode {number}, free run of the whole arm from its first row"
    names = list(report["joints"])
    levels = [np.array([report["joints"][name]["gap"][key] for name in names]) for key in ("before", "after", "floor")]
    return Figures(
        {
            caption: drawing.series(recording.any.time[episode, rows], panels),
            "Which joints the gap is of: root mean square, before and after, against measurement noise": drawing.by_bin(
                report["gap"]["unit"], [("joint", names, levels[0], levels[1], levels[2])]
            ),
        }
    )


def touch_figure(touch: TipTouch) -> Figures:
    """By caption: how high the tip is, in the episode in which it touches most."""
    most = max((each[0] for each in touch.rows), key=[each[0] for each in touch.rows].count)
    t = touch.time[most]
    spans = [(t[first], t[end - 1]) for episode, first, end in touch.rows if episode == most]
    heights = {"measured": touch.measured[most], "simulated": touch.simulated[most]}
    caption = "What the tip touches: its height, and the simulator's, which has nothing there; shaded is left out"
    return Figures({caption: drawing.heights(t, heights, touch.height, spans)})
