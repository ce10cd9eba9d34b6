"""Drives that are commanded positions: the motor itself, and the simulator with a network in its place.

A motor with an inner controller pushes a load: τ = stiffness·(q* − q) − damping·q̇, from what the sensors show, held for
a sample, goes through the joint's effects and its transmission. What reaches the load is *the delivered torque*, that
of a torque sensor between transmission and load: the mean over a sample of the load's inertia times its acceleration,
less the torque that the world puts on it. The mean is the momentum gained over the time, so that impacts, which are
impulses, count in full. The load is half of the joint's inertia, as the effects that divide motor and load have it;
without them the same half is behind the sensor.
"""

import abc

import numpy as np
import torch

from vision_s2r.actuator.config import DriveConfig
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.errors import UserError
from vision_s2r.joint import COLUMNS, Joints, NominalJoint, pack

LOAD = 0.5  # of the joint's inertia
_INERTIA, _BIAS = COLUMNS.index("inertia"), COLUMNS.index("bias_torque")


class Drive(abc.ABC):
    """N drives at rest at 0, each with a constant torque of the world on its load, stepped a sample at a time.

    measured [N, 2]      position (rad) and velocity (rad/s) that the sensors show, with their noise
    load_torque [N]      N·m that the world puts on the load: a payload
    """

    def __init__(
        self, cfg: DriveConfig, load_torque: np.ndarray, load_inertia: float, rng: np.random.Generator
    ) -> None:
        self.cfg = cfg
        self.load_torque = load_torque
        self._load_inertia = load_inertia
        self._rng = rng
        self._noise = np.array([cfg.position_noise, cfg.velocity_noise])
        self.measured = self._look()

    def __len__(self) -> int:
        return len(self.load_torque)

    def step(self, command: np.ndarray) -> np.ndarray:
        """Command positions [N] (rad) for a sample; the delivered torques [N] (N·m) that the sensor shows of it."""
        before = self.true[:, 1]
        self._advance(command - self.measured[:, 0], self.measured[:, 1])
        momentum = self._load_inertia * (self.true[:, 1] - before)
        self.measured = self._look()
        noise = self.cfg.torque_noise * self._rng.standard_normal(len(self))
        return momentum / self.cfg.sample_time - self.load_torque + noise

    @property
    @abc.abstractmethod
    def true(self) -> np.ndarray:
        """Position and velocity [N, 2] of the loads."""

    @abc.abstractmethod
    def _advance(self, error: np.ndarray, velocity: np.ndarray) -> None:
        """Moves on by a sample under measured position errors (command − position) and velocities [N]."""

    def _look(self) -> np.ndarray:
        return self._shown() + self._noise * self._rng.standard_normal((len(self), 2))

    def _shown(self) -> np.ndarray:
        return self.true


class MotorDrive(Drive):
    """The motor: with the effects that it has, or as the analytic model knows it, with its torque limit alone."""

    def __init__(
        self, cfg: DriveConfig, load_torque: np.ndarray, rng: np.random.Generator, analytic: bool = False
    ) -> None:
        machine = pack(nominal(cfg), {"torque_saturation": {"limit": cfg.torque_limit}} if analytic else cfg.effects)
        machines = np.repeat(machine[None], len(load_torque), axis=0)
        machines[:, _BIAS] = -load_torque
        self._joints = Joints(machines, cfg.sample_time)
        super().__init__(cfg, load_torque, LOAD * machine[_INERTIA], rng)

    @property
    def true(self) -> np.ndarray:
        return self._joints.true

    def _shown(self) -> np.ndarray:
        return self._joints.shown

    def _advance(self, error: np.ndarray, velocity: np.ndarray) -> None:
        self._joints.step(self.cfg.stiffness * error - self.cfg.damping * velocity)


class NetworkDrive(Drive):
    """The load alone, driven by the torque that a network says. Raises UserError for one of another sample time."""

    def __init__(
        self, cfg: DriveConfig, load_torque: np.ndarray, rng: np.random.Generator, network: ActuatorNetwork
    ) -> None:
        if network.sample_time != cfg.sample_time:
            raise UserError(
                f"the network's sample time is {network.sample_time:g} s, the drive's {cfg.sample_time:g} s"
            )
        self._network = network
        self._state = np.zeros((len(load_torque), 2))
        self._seen = np.zeros((network.lags[-1] + 1, 2, len(load_torque)), np.float32)  # latest first
        self._fresh = True
        super().__init__(cfg, load_torque, LOAD * cfg.inertia, rng)

    @property
    def true(self) -> np.ndarray:
        return self._state.copy()

    def _advance(self, error: np.ndarray, velocity: np.ndarray) -> None:
        self._seen = np.roll(self._seen, 1, axis=0)
        self._seen[slice(None) if self._fresh else 0] = error, velocity
        self._fresh = False
        inputs = self._seen[list(self._network.lags)].transpose(2, 1, 0).reshape(len(self), -1)
        with torch.no_grad():
            torque = self._network(torch.from_numpy(inputs)).numpy().astype(float)
        step = self.cfg.sample_time
        gained = step * (torque + self.load_torque) / self._load_inertia
        self._state[:, 0] += step * (self._state[:, 1] + 0.5 * gained)
        self._state[:, 1] += gained


def nominal(cfg: DriveConfig) -> NominalJoint:
    """The joint as the simulator knows it, commanded in N·m."""
    return NominalJoint(
        torque_constant=1.0,
        inertia=cfg.inertia,
        viscous_damping=cfg.viscous_damping,
        coulomb_friction=cfg.coulomb_friction,
    )
