"""Another recording of the same arm through the simulator, before and after its diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vision_s2r.diagnose.tip import tip_gap
from vision_s2r.fit.arm.free_run import FreeRuns, by_stretch, fingerprint, gap_errors, of_whole
from vision_s2r.fit.case import Values
from vision_s2r.recording import ArmRecording
from vision_s2r.recording.pieces import without


@dataclass(frozen=True)
class Rows:
    """The rows of replay.csv."""

    columns: list[str]
    table: np.ndarray  # [rows, columns]


def replay_arm(
    recording: ArmRecording, effects: Values, held_out: Mapping[str, Any] | None
) -> tuple[Rows, dict[str, Any]]:
    """The rows of replay.csv, and what replay.json holds besides.

    Of the recording that the effects were found in, each stretch is run with parameters that have not seen it; rows
    that the diagnosis left out are left out here, and each stretch between them is an episode.
    """
    same = held_out is not None and held_out["recording"] == fingerprint(recording)
    if same and held_out:
        recording = without(recording, held_out.get("without") or [])
    runs = FreeRuns(recording)
    before = runs.states({})
    after = runs.held_out(held_out) if same and held_out else runs.states(effects)
    errors = {"before": gap_errors(recording, before), "after": gap_errors(recording, after)}

    def root(squared: np.ndarray) -> float:
        """Of all rows, or over stretches, each of which counts the same as in a report."""
        if not (same and held_out):
            return float(np.sqrt(np.nanmean(squared)))
        return float(np.sqrt(by_stretch(recording, squared, held_out).mean(axis=1).mean()))

    joints = {
        name: {
            "unit": "rad" if joint.units == "rotary" else "m",
            **{key: root(each[..., j : j + 1]) for key, each in errors.items()},
        }
        for j, (name, joint) in enumerate(recording.joints.items())
    }
    tip = tip_gap(recording, of_whole(effects), before, after)
    found = {
        "described": "free run of the whole arm from each episode's first row"
        + (", each stretch with parameters that have not seen it" if same else ""),
        "gap": {"metric": "position_rmse", "unit": "rad", **{key: root(each) for key, each in errors.items()}},
        "gaps": {} if tip is None else {"tip": tip},
        "joints": joints,
        "episodes": [
            {"episode": episode, **{key: float(np.sqrt(np.nanmean(each[k]))) for key, each in errors.items()}}
            for k, episode in enumerate(recording.episodes)
        ],
    }
    return Rows(_columns(recording), _table(recording, before, after)), found


def _columns(recording: ArmRecording) -> list[str]:
    kinds = ("measured", "before", "after")
    return ["episode", "t", *(f"position.{name}_{kind}" for name in recording.joints for kind in kinds)]


def _table(recording: ArmRecording, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    blocks, measured = [], recording.position
    for k, length in enumerate(recording.any.lengths):
        three = np.stack([measured[k, :length], before[k, :length, :, 0], after[k, :length, :, 0]], axis=-1)
        stamps = np.stack([np.full(length, recording.episodes[k]), recording.any.time[k, :length]], axis=1)
        blocks.append(np.concatenate([stamps, three.reshape(length, -1)], axis=1))
    return np.concatenate(blocks)
