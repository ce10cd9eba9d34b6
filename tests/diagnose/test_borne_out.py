"""Names of an arm's joints, held against the free run of the whole arm."""

from recordings import an_arm

from vision_s2r.diagnose.borne_out import idle
from vision_s2r.fit.arm.free_run import FreeRuns


def test_a_name_that_the_whole_arm_runs_as_well_without_is_no_name():
    recording = an_arm({"elbow": {"latency": {"delay": 0.02}}}, seconds=1.0)
    found = {
        "elbow.latency": {"delay": 0.02},
        "elbow.viscous_damping": {"value": 1.3},  # as false names are: it only makes up for what is not there
        "shoulder.inertia": {"value": 1e-9},  # what the rotor has anyhow
    }
    held_out = {"segments": [[e, k, k + 20, 0] for e in (0, 1) for k in range(0, 100, 20)], "folds": [found]}
    least = dict.fromkeys(("shoulder", "elbow"), 0.03 * 2e-4**2)
    gone = idle(FreeRuns(recording), held_out, list(found), least, seed=0)
    assert gone == {"elbow.viscous_damping", "shoulder.inertia"}
