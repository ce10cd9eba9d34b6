"""Tangents against differences of whole simulations."""

import numpy as np
import pytest

from vision_s2r.joint import NominalJoint, Tables, pack, simulate
from vision_s2r.joint.simulation import prepared
from vision_s2r.joint.tangent import tangents

SERVO = NominalJoint(
    inertia=0.03, viscous_damping=0.6, coulomb_friction=0.3, torque_constant=1.0, command_limit=3.0,
    proportional_gain=17.8,
)  # fmt: skip
TIME = 0.02 * np.arange(300)
TARGET = (0.5 * np.sin(3 * TIME) + 0.2 * np.sign(np.sin(5 * TIME)))[None]
TABLES = Tables(position=(-1.0, 1.0, 7), velocity=(-3.0, 3.0, 5), time=(0.0, 6.0, 5), torque=(-2.0, 2.0, 5))
STEP = 1e-6


@pytest.mark.parametrize(
    "effects",
    [
        {"stribeck_friction": {"static": 0.5, "velocity": 0.2}, "gravity_torque": {"value": 0.8}},
        {"external_load_friction": {"coefficient": 0.5}, "bias_torque": {"value": 0.4}, "latency": {"delay": 0.013}},
        {"derivative_on_error": {"gain": 0.5, "time_constant": 0.02}, "velocity_limit": {"value": 1.5}},
    ],
)
def test_what_torques_move_is_what_simulations_with_them_differ_by(effects):
    heights = np.random.default_rng(0).normal(0, 0.02, TABLES.width)
    row = np.append(pack(SERVO, effects), heights)
    scale, load = 1 + 0.1 * np.sin(TIME)[None], 0.1 * np.cos(TIME)[None]
    of_drive, of_load = np.sin(2 * TIME), np.cos(4 * TIME)
    given = {"command": TARGET, "first": np.array([[TARGET[0, 0], 0.0]]), "sample_time": 0.02, "tables": TABLES}
    inputs = prepared(row[None], scale=scale, external=load, **given)
    moved = tangents(inputs, (1.0, 1.0, 1.0), of_drive[None, None], of_load[None, None])

    rows = np.repeat(row[None], TABLES.width + 1, axis=0)
    rows[1:, -TABLES.width :] += STEP * np.eye(TABLES.width)
    states = simulate(rows, scale=scale, external=load, **given)[:, 0]
    driven = simulate(row[None], scale=scale + STEP * of_drive, external=load, **given)[:, 0]
    pulled = simulate(row[None], scale=scale, external=load + STEP * of_load, **given)[:, 0]
    expected = (np.concatenate([states[1:], driven, pulled]) - states[0]) / STEP
    for found, each in zip(moved[0].transpose(2, 0, 1), expected, strict=True):
        assert np.linalg.norm(found - each) <= 0.03 * np.linalg.norm(each) + 1e-3
    assert np.linalg.norm(expected) > 10
