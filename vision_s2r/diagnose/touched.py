"""An arm that touches something: what is left of its recording where it does not, and what the report says of it."""

from collections.abc import Mapping
from typing import Any

from vision_s2r.diagnose.arm_look import first_look
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.fit.arm.free_run import FreeRuns, fingerprint
from vision_s2r.fit.arm.touch import TipTouch, suspected, touched
from vision_s2r.recording import ArmRecording
from vision_s2r.recording.pieces import without


def untouched(runs: FreeRuns, cfg: DiagnoseConfig, jobs: int) -> tuple[FreeRuns, TipTouch | None]:
    """Runs of what is left where the tip touches nothing, and what it touches, if anything; `cfg` is of joints.

    Where the simulator as it came suggests a touch, it is looked for beside one that moves much as the arm does where
    it touches nothing. All rows stay where those without a touch would be too few.
    """
    recording = runs.recording
    found = suspected(recording, runs.states({})[..., 0])
    if found is None:
        return runs, None
    near = first_look(without(recording, found.left_out), cfg, jobs)
    found = touched(recording, runs.states(near)[..., 0])
    return (FreeRuns(without(recording, found.left_out)), found) if found else (runs, None)


def touching(report: Mapping[str, Any], recording: ArmRecording, found: TipTouch) -> dict[str, Any]:
    """The report of what is left of a recording, as one of all of it."""
    named, rest = bool(report["effects"]), report["unexplained"]
    raised = f"Play the motion so that the tip stays above {found.height:.2g} m, or take away what it touches there."
    if recording.by_goals:
        raised += " The commands of next_recording.csv bring it no lower than it has been."
    return {
        **report,
        "verdict": "partly_explained" if named else "unexplained",
        "unexplained": {**rest, "resembles": [found.described(), *rest["resembles"]]},
        "next_experiment": " ".join(filter(None, [raised, report["next_experiment"]])),
        "held_out": {
            **report["held_out"],
            "recording": fingerprint(recording),
            "without": [list(each) for each in found.left_out],
        },
        "touches": {
            "height": found.height,
            "follows": found.follows,
            "above": found.above,
            "times": len(found.rows),
            "share": found.share,
            "verdict": report["verdict"],
        },
    }
