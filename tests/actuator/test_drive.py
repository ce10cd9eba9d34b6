"""What a torque sensor between motor and load shows, and drives with a network in the motor's place."""

import numpy as np
import pytest
import torch
from small import ANALYTIC, NOTHING, QUIET, drive, logged, rng

from vision_s2r.actuator.analytic import analytic_torque
from vision_s2r.actuator.drive import MotorDrive, NetworkDrive
from vision_s2r.actuator.log import LooseLoop, record
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.actuator.references import References
from vision_s2r.actuator.training import predict
from vision_s2r.errors import UserError

STILL = References(*np.zeros((3, 2, 400)), np.array([0.1, -0.05]))


def test_the_analytic_model_is_what_a_drive_without_effects_delivers():
    cfg = drive(**QUIET, sample_time=0.0005)  # friction changes within a sample
    log = logged(cfg, 2, 0, ANALYTIC, seconds=0.6)
    missed = np.abs(analytic_torque(cfg, log) - log.torque).mean()
    assert missed < 0.01 * np.abs(log.torque).mean()
    real = logged(cfg, 2, 0, seconds=0.6)
    assert np.abs(analytic_torque(cfg, real) - real.torque).mean() > 0.3 * np.abs(real.torque).mean()


def test_impacts_count_in_full():
    """Without friction, half of what a saturated motor gives is in the load once they touch."""
    cfg = drive(
        **QUIET, viscous_damping=0.0, coulomb_friction=0.0, damping=0.0,
        effects={"backlash": {"width": 0.02}, "torque_saturation": {"limit": 0.7}},
    )  # fmt: skip
    motor = MotorDrive(cfg, np.zeros(1), rng())
    torques = np.array([float(motor.step(torch.full((1,), 50.0))) for _ in range(20)])
    assert torques[0] == 0 and torques.max() > 0.8  # nothing in flight, then more than the 0.35 that lasts
    assert torques.sum() == pytest.approx(20 * 0.7 / 2, rel=1e-9)


def test_a_load_at_rest_is_held_against_its_payload():
    log = record(MotorDrive(drive(**QUIET), STILL.payload, rng()), STILL, NOTHING)
    np.testing.assert_allclose(log.torque[:, -1], [-0.1, 0.05], atol=1e-6)


def test_the_simulated_network_sees_what_a_log_shows_it():
    cfg = drive(torque_noise=0.0)
    torch.manual_seed(0)
    network = ActuatorNetwork((0.0, 0.005, 0.02), cfg.sample_time)
    references = References(*rng(1).normal(size=(3, 2, 50)), STILL.payload)
    log = record(
        NetworkDrive(cfg, STILL.payload, rng(), network), references, LooseLoop(np.full(2, 0.05), np.full(2, 0.05))
    )
    np.testing.assert_allclose(log.torque, predict(network, log), atol=1e-6)


def test_the_network_moves_the_load_alone():
    cfg = drive(**QUIET)
    network = ActuatorNetwork((0.0,), cfg.sample_time)
    network.normalize(np.zeros(2), np.zeros((2, 2)), 1.0)  # blind: one torque whatever happens
    torch.nn.init.zeros_(network.layers[-1].weight)
    torch.nn.init.constant_(network.layers[-1].bias, 0.2)
    simulated = NetworkDrive(cfg, STILL.payload, rng(), network)
    for _ in range(10):
        simulated.step(torch.zeros(2))
    acceleration = (0.2 + STILL.payload) / 0.01
    expected = np.stack([0.5 * acceleration * 0.05**2, acceleration * 0.05], axis=1)
    np.testing.assert_allclose(simulated.true, expected, rtol=1e-6)
    with pytest.raises(UserError, match=r"sample time is 0.005 s, the drive's 0.01 s"):
        NetworkDrive(drive(sample_time=0.01), STILL.payload, rng(), network)


@pytest.mark.parametrize("motor", ["compiled", "network"])
def test_a_drive_says_what_a_command_changes(motor):
    """Against another drive, which is commanded a little more, once."""
    cfg = drive(**QUIET, effects={"latency": {"delay": 0.0125}, "torque_saturation": {"limit": 0.7}})
    torch.manual_seed(0)
    network = ActuatorNetwork((0.0, 0.005, 0.015), cfg.sample_time)
    network.normalize(np.zeros(6), 0.1 * np.eye(6), 1.0)
    more = torch.tensor([0.0, 1e-3], dtype=torch.float64, requires_grad=True)
    made = (cfg, np.full(2, 0.03), rng())
    moved = MotorDrive(*made) if motor == "compiled" else NetworkDrive(*made, network)
    for k in range(12):
        moved.step(torch.full((2,), 0.05, dtype=torch.float64) + (more if k == 2 else 0.0))
    position, other = moved.true[:, 0]
    position.backward()
    assert float(more.grad[0]) == pytest.approx((other - position).item() / 1e-3, rel=0.02)
