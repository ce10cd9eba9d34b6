"""What can be reached at all: the measure that policies are held against."""

import numpy as np
import pytest

from vision_s2r.control import Given, track
from vision_s2r.control.config import CeilingConfig, ControlTaskConfig, JointConfig
from vision_s2r.control.planner import ceiling
from vision_s2r.control.policy import Informed
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


def test_the_informed_controller_is_exact_where_it_knows_everything():
    values = {
        "viscous_damping": {"value": np.array([0.15, 0.3])},
        "coulomb_friction": {"value": np.array([0.05, 0.1])},
        "inertia": {"value": np.array([0.02, 0.04])},
        "torque_constant": {"value": np.array([0.5, 0.4])},
    }
    informed = Informed(NOMINAL, values, TASK)
    errors = track(informed, TASK, NOMINAL, Given(values), np.array([[5.0, -3.0, 1.0], [3.0, -2.0, 8.0]]))
    assert abs(errors.ravel()[:-1]).max() < 1e-6
    assert errors[1, 2] < (4 * 0.4 - 0.1) / 0.3 / 8 - 1  # all that the motor has
