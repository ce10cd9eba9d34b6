"""Drives that MuJoCo has no attribute for, beside its bodies."""

import mujoco
import numpy as np
import pytest
from recordings import an_arm

from vision_s2r.errors import UserError
from vision_s2r.fit.arm.drives import ArmDrives
from vision_s2r.fit.arm.free_run import free_run
from vision_s2r.patch.arm import mjcf
from vision_s2r.report.reading import ReportedParameter

FOUND = {
    "shoulder": {
        "stribeck_friction": {"static": 1.5, "velocity": 0.1},
        "viscous_damping": {"value": 2.0},
        "bias_torque": {"value": 0.5},
        "derivative_on_error": {"gain": 1.5, "time_constant": 0.01},
    },
    "elbow": {"deadband": {"width": 0.06}, "latency": {"delay": 0.033}, "velocity_limit": {"value": 1.5}},
}
EFFECTS = {f"{joint}.{name}": given for joint, own in FOUND.items() for name, given in own.items()}
STEP = 5e-4  # s


def patched(recording):
    named = {
        name: {key: ReportedParameter(value, value, value) for key, value in given.items()}
        for name, given in EFFECTS.items()
    }
    model = mujoco.MjModel.from_xml_string(mjcf(named, recording))
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    return model


@pytest.mark.slow
def test_beside_mujoco_they_make_the_free_run_that_a_report_speaks_of():
    recording = an_arm(FOUND, seconds=3.0, episodes=1)
    model = patched(recording)
    drives, data = ArmDrives(model, recording, EFFECTS), mujoco.MjData(model)
    commands = np.array([joint.command[0] for joint in recording.joints.values()]).T
    moved = []
    for _ in range(2):  # once more from the start, after a reset
        mujoco.mj_resetData(model, data)
        drives.reset()
        data.joint("shoulder").qpos, data.joint("elbow").qpos = recording.position[0, 0]
        for command in commands:
            moved.append([data.joint(name).qpos[0] for name in recording.joints])
            for _ in range(20):
                drives.act(data, command)
                mujoco.mj_step(model, data)
    once, twice = np.array(moved).reshape(2, len(commands), 2)
    before, after = (free_run(recording, each)[0, ..., 0] for each in ({}, EFFECTS))
    off, gap = (np.sqrt(np.mean((each - after) ** 2, axis=0)) for each in (once, before))
    assert (off < 0.05 * gap).all() and (gap > 0.02).all()
    np.testing.assert_array_equal(once, twice)


def test_a_joint_that_play_divides_is_refused():
    recording = an_arm(seconds=1.0, episodes=1)
    with pytest.raises(UserError, match="elbow: backlash divides a joint in two, of which MuJoCo's is one"):
        ArmDrives(patched(recording), recording, {"elbow.backlash": {"width": 0.02}})
