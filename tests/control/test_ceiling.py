"""What can be reached at all: the measure that policies are held against."""

import numpy as np
import pytest

from vision_s2r.control import Given
from vision_s2r.control.config import CeilingConfig, ControlTaskConfig, JointConfig
from vision_s2r.control.planner import ceiling
from vision_s2r.control.teacher import regulator, taught
from vision_s2r.joint import JOINT_EFFECTS, NominalJoint

NOMINAL, TASK = NominalJoint(**vars(JointConfig())), ControlTaskConfig()
TRUTH = {"viscous_damping": {"value": 0.15}, "coulomb_friction": {"value": 0.05}}
QUICK = CeilingConfig(samples=60, elites=8, iterations=12)


@pytest.mark.parametrize("effect", ["latency", "backlash", "compliance", "encoder_quantization"])
def test_whoever_knows_a_machine_turns_it_at_every_speed_that_it_can_reach(effect):
    machine = Given({**TRUTH, effect: JOINT_EFFECTS[effect].moderate()})
    errors = ceiling(TASK, NOMINAL, machine, np.array([[5.0, -3.0, 1.5]]), QUICK)
    assert abs(errors).max() < TASK.tolerance


def test_and_at_no_other():
    machine = Given({**TRUTH, "torque_saturation": {"limit": 0.5}})
    errors = ceiling(TASK, NOMINAL, machine, np.array([[8.0, 2.5]]), QUICK)
    assert errors[0, 0] < -0.5  # (0.5 - 0.05) / 0.15 is 3 rad/s
    assert abs(errors[0, 1]) < TASK.tolerance


@pytest.mark.parametrize("effect", ["latency", "backlash", "compliance", "encoder_quantization", "cogging", "inertia"])
def test_the_teacher_leads_every_machine_to_its_speeds(effect):
    machine = {**TRUTH, effect: JOINT_EFFECTS[effect].moderate() if effect != "inertia" else {"value": 0.04}}
    errors = taught(TASK, NOMINAL, Given(machine), np.array([[5.0, -3.0, 1.5]]), 0.1, 0)
    assert abs(errors).max() < TASK.tolerance


def test_a_machine_that_no_command_holds_has_gains_that_are_numbers():
    runs_away, nothing = np.array([[[2.0]]]), np.array([[[0.0]]])
    assert np.isfinite(regulator(runs_away, nothing, 0.1)).all()
    np.testing.assert_allclose(regulator(runs_away, np.array([[[1.0]]]), 1e-9), 2.0, rtol=1e-6)  # deadbeat
