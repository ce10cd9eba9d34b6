"""Drives that are commanded positions: the motor itself, and the simulator with a network in its place.

A motor with an inner controller pushes a load: τ = stiffness·(q* − q) − damping·q̇, from what the sensors show, held for
a sample, goes through the joint's effects and its transmission. What reaches the load is *the delivered torque*, that
of a torque sensor between transmission and load: the mean over a sample of the load's inertia times its acceleration,
less the torque that the world puts on it. The mean is the momentum gained over the time, so that impacts, which are
impulses, count in full. The load is half of the joint's inertia, as the effects that divide motor and load have it;
without them the same half is behind the sensor.
"""

import abc
from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from vision_s2r.actuator.config import DriveConfig
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.errors import UserError
from vision_s2r.joint import COLUMNS, Joints, NominalJoint, pack
from vision_s2r.joint.differentiable import DifferentiableJoints

LOAD = 0.5  # of the joint's inertia
_INERTIA, _BIAS = COLUMNS.index("inertia"), COLUMNS.index("bias_torque")


class Drive(abc.ABC):
    """N drives at rest at 0, each with a constant torque of the world on its load, stepped a sample at a time.

    measured [N, 2]      position (rad) and velocity (rad/s) that the sensors show, with their noise
    load_torque [N]      N·m that the world puts on the load: a payload

    What is measured has the gradient of the commands that led to it, as far back as `detach`, where torch keeps any.
    """

    def __init__(
        self, cfg: DriveConfig, load_torque: np.ndarray, load_inertia: float, rng: np.random.Generator
    ) -> None:
        self.cfg = cfg
        self.load_torque = torch.from_numpy(load_torque)
        self._load_inertia = load_inertia
        self._rng = rng
        self._noise = torch.tensor([cfg.position_noise, cfg.velocity_noise], dtype=torch.float64)
        self.measured = self._look()

    def __len__(self) -> int:
        return len(self.load_torque)

    def step(self, command: Tensor) -> Tensor:
        """Command positions [N] (rad) for a sample; the delivered torques [N] (N·m) that the sensor shows of it."""
        before = self.true[:, 1]
        self._advance(command - self.measured[:, 0], self.measured[:, 1])
        momentum = self._load_inertia * (self.true[:, 1] - before)
        self.measured = self._look()
        noise = self.cfg.torque_noise * torch.from_numpy(self._rng.standard_normal(len(self)))
        return momentum / self.cfg.sample_time - self.load_torque + noise

    def detach(self) -> None:
        """From here on no gradient goes further back."""
        self.measured = self.measured.detach()

    @property
    @abc.abstractmethod
    def true(self) -> Tensor:
        """Position and velocity [N, 2] of the loads."""

    @abc.abstractmethod
    def _advance(self, error: Tensor, velocity: Tensor) -> None:
        """Moves on by a sample under measured position errors (command − position) and velocities [N]."""

    def _look(self) -> Tensor:
        return self._shown() + self._noise * torch.from_numpy(self._rng.standard_normal((len(self), 2)))

    def _shown(self) -> Tensor:
        return self.true


class MotorDrive(Drive):
    """The motor, with effects: its own by default, or those that a simulator has of it."""

    def __init__(
        self,
        cfg: DriveConfig,
        load_torque: np.ndarray,
        rng: np.random.Generator,
        effects: Mapping[str, Mapping[str, float]] | None = None,
    ) -> None:
        machine = pack(nominal(cfg), cfg.effects if effects is None else effects)
        machines = np.repeat(machine[None], len(load_torque), axis=0)
        machines[:, _BIAS] -= load_torque
        self._joints = Joints(machines, cfg.sample_time)
        self._ahead = DifferentiableJoints(self._joints)
        self._state = torch.from_numpy(self._joints.moving)
        super().__init__(cfg, load_torque, LOAD * machine[_INERTIA], rng)

    @property
    def true(self) -> Tensor:
        return self._state[:, :2]

    def detach(self) -> None:
        super().detach()
        self._ahead.detach()
        self._state = self._state.detach()

    def _shown(self) -> Tensor:
        return self.true + (torch.from_numpy(self._joints.shown) - self.true).detach()  # what rounds has no gradient

    def _advance(self, error: Tensor, velocity: Tensor) -> None:
        torque = self.cfg.stiffness * error - self.cfg.damping * velocity
        if torch.is_grad_enabled():
            self._state = self._ahead.foreseen(torque)
        self._joints.step(torque.detach().numpy())
        if not torch.is_grad_enabled():
            self._state = torch.from_numpy(self._joints.moving)


class NetworkDrive(Drive):
    """The load alone, driven by the torque that a network says. Raises UserError for one of another sample time."""

    def __init__(
        self, cfg: DriveConfig, load_torque: np.ndarray, rng: np.random.Generator, network: ActuatorNetwork
    ) -> None:
        if network.sample_time != cfg.sample_time:
            raise UserError(
                f"the network's sample time is {network.sample_time:g} s, the drive's {cfg.sample_time:g} s"
            )
        self._network = network.requires_grad_(False)
        self._state = torch.zeros(len(load_torque), 2, dtype=torch.float64)
        self._seen: list[Tensor] = []  # errors and velocities [N, 2], the latest first
        super().__init__(cfg, load_torque, LOAD * cfg.inertia, rng)

    @property
    def true(self) -> Tensor:
        return self._state

    def detach(self) -> None:
        super().detach()
        self._state = self._state.detach()
        self._seen = [each.detach() for each in self._seen]

    def _advance(self, error: Tensor, velocity: Tensor) -> None:
        now = torch.stack([error, velocity], dim=1).float()
        known = self._network.lags[-1] + 1
        self._seen = [now, *self._seen[: known - 1]] if self._seen else [now] * known
        inputs = torch.stack([self._seen[lag] for lag in self._network.lags], dim=2)  # [N, 2, H]
        torque = self._network(inputs.flatten(1)).double()
        step = self.cfg.sample_time
        gained = step * (torque + self.load_torque) / self._load_inertia
        position, speed = self._state.T
        self._state = torch.stack([position + step * (speed + 0.5 * gained), speed + gained], dim=1)


def nominal(cfg: DriveConfig) -> NominalJoint:
    """The joint as the simulator knows it, commanded in N·m."""
    return NominalJoint(
        torque_constant=1.0,
        inertia=cfg.inertia,
        viscous_damping=cfg.viscous_damping,
        coulomb_friction=cfg.coulomb_friction,
    )
