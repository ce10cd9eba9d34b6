"""Policies that command a drive, and how they learn: by the gradient through a simulator, whatever its motor is.

Every simulator can be gone back through, a network by itself, a compiled motor numerically. The learner is thus the
same in all of them, and a policy costs seconds where trying things out (PPO, or the TRPO of Hwangbo et al. 2019)
takes minutes; what policies reach then tells simulators apart, not learners.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from vision_s2r.actuator.config import ActuatorTaskConfig, DriveConfig, DrivePolicyConfig
from vision_s2r.actuator.drive import Drive
from vision_s2r.actuator.log import DriveLog, followed, record
from vision_s2r.actuator.references import References, tasks
from vision_s2r.control.policy import Network
from vision_s2r.control.schedule import fall
from vision_s2r.threads import one_thread
from vision_s2r.training import checkpoint

KIND = "drive policy"
ERROR, SPEED, ACCELERATION, MORE = 0.05, 3.0, 30.0, 0.2  # rad, rad/s, rad/s², rad: units of what a network sees, says
SUMMED = 40  # errors of ERROR, a sample each, to which their sum is held: the integral's unit
SETTLE = 0.2  # s from rest that do not count

# A simulator, or reality: loads with these payloads [N] (N·m), whose sensors' noise comes from the generator.
World = Callable[[np.ndarray, np.random.Generator], Drive]


class DrivePolicy:
    """Commands what is wanted, and what a network adds.

    It sees the wanted velocity and acceleration, the error, its integral (a payload shows in little else) and the
    velocity as measured, and of each of the `history` samples before errors, velocities and what it added.
    """

    def __init__(self, history: int, hidden: list[int]) -> None:
        self.history = history
        self.network = Network(5 + 3 * history, hidden, straight=True)
        self.begin(0)

    def begin(self, count: int) -> None:
        """A motion of so many drives begins."""
        self._past = torch.zeros(count, 3 * self.history)
        self._total = torch.zeros(count)

    def detach(self) -> None:
        """From here on no gradient goes further back."""
        self._past, self._total = self._past.detach(), self._total.detach()

    def command(self, wanted: Tensor, measured: Tensor) -> Tensor:
        """See `PositionController`."""
        error, speed = (wanted[:, 0] - measured[:, 0]) / ERROR, measured[:, 1] / SPEED
        ahead = wanted[:, 1:] / torch.tensor([SPEED, ACCELERATION])
        now = torch.stack([error, speed], dim=1)
        self._total = (self._total + error / SUMMED).clamp(-1, 1)
        seen = torch.cat([ahead, now, self._total[:, None], self._past], dim=1)
        more = self.network(seen.float())
        self._past = torch.cat([now, more, self._past[:, :-3]], dim=1)[:, : 3 * self.history]
        return wanted[:, 0] + MORE * more[:, 0]

    def save(self, path: Path) -> None:
        """Write the network."""
        tensors = {f"network.{name}": value for name, value in self.network.state_dict().items()}
        shape = {"history": self.history, "hidden": self.network.hidden}
        checkpoint.save(path, checkpoint.Checkpoint(KIND, shape, {}, {}, tensors))

    @classmethod
    def load(cls, path: Path) -> "DrivePolicy":
        """What `save` wrote. Raises UserError for another file."""
        loaded = checkpoint.load(path, KIND)
        policy = cls(int(loaded.configuration["history"]), list(loaded.configuration["hidden"]))
        loaded.restore("network", policy.network)
        return policy


@one_thread()
def learn(world: World, task: ActuatorTaskConfig, cfg: DrivePolicyConfig, drive: DriveConfig, seed: int) -> DrivePolicy:
    """A policy that follows tasks in this world; the same seed gives the same policy.

    It begins as the inverse of the nominal drive. What it costs is the RMS error (rad), plus `roughness` times the RMS
    change of the command between samples (rad).
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        policy = _inverse(cfg, drive)
    optimizer = torch.optim.Adam(policy.network.parameters(), cfg.learning_rate)
    rng = np.random.default_rng([seed, 0])
    for episode in range(cfg.episodes):
        fall(optimizer, cfg.learning_rate, episode / cfg.episodes)
        references = tasks(task, cfg.drives, drive, rng)
        _episode(world(references.payload, rng), references, policy, optimizer, task.roughness, cfg.window)
    return policy


def _inverse(cfg: DrivePolicyConfig, drive: DriveConfig) -> DrivePolicy:
    """A policy that commands what the nominal drive, but for dry friction, would need to be where it should."""
    policy = DrivePolicy(cfg.history, cfg.hidden)
    action = policy.network.action
    nn.init.zeros_(action.weight)
    nn.init.zeros_(action.bias)
    ahead = [(drive.damping + drive.viscous_damping) * SPEED, drive.inertia * ACCELERATION]
    with torch.no_grad():
        action.weight[0, cfg.hidden[-1] :][:2] = torch.tensor(ahead) / drive.stiffness / MORE
    return policy


def _episode(
    drive: Drive,
    references: References,
    policy: DrivePolicy,
    optimizer: torch.optim.Optimizer,
    roughness: float,
    window: int,
) -> None:
    """Follow the references, with an update after each `window` samples."""
    commands: list[Tensor] = []
    misses: list[Tensor] = []
    for command, *_, miss in followed(drive, references, policy):
        commands.append(command)
        misses.append(miss)
        if len(misses) < window:
            continue
        cost = _rms(torch.stack(misses)) + roughness * _rms(torch.stack(commands).diff(dim=0))
        optimizer.zero_grad()
        cost.mean().backward()
        nn.utils.clip_grad_norm_(policy.network.parameters(), 1.0)
        optimizer.step()
        drive.detach()
        policy.detach()
        commands, misses = [command.detach()], []


def _rms(values: Tensor) -> Tensor:
    """Over time, of [T, N]."""
    return (values.square().mean(dim=0) + 1e-12).sqrt()


def rms_error(log: DriveLog, sample_time: float) -> np.ndarray:
    """RMS over time [N] (rad) of the reference less the true position, once settled."""
    return np.sqrt(np.mean(log.miss[:, round(SETTLE / sample_time) :] ** 2, axis=1))


def attempt(world: World, references: References, policy: DrivePolicy, seed: int) -> DriveLog:
    """A policy on each reference."""
    return record(world(references.payload, np.random.default_rng([seed, 2])), references, policy)
