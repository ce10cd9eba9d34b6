"""Learning a policy by imitating a teacher that is told the machine, where the policy itself leads.

Privileged learning (Chen et al., "Learning by cheating", CoRL 2019; Lee et al., Science Robotics 2020) by dataset
aggregation (DAgger, Ross et al. 2011): the policy, which sees velocities and currents only, drives the joints, and at
every sample the teacher says what it would have done there. No loop that runs away can hide what should have been done.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from vision_s2r.control import policy as policies
from vision_s2r.control.config import ImitationTrainingConfig, episode_samples
from vision_s2r.control.environment import SpeedTracking, observation_size
from vision_s2r.control.progress import Progress
from vision_s2r.control.schedule import fall
from vision_s2r.control.teacher import Teacher

GAIN, AGAIN = 2.0, 0.2  # of the controller that a training begins with: for what is missing, and of the last current
COARSE, FINE = 0.01, 0.02  # of an action: errors from which on they count by their size, and by their logarithm
LOGARITHM = 0.2  # weight of the latter: the last per cent, which transients would drown


def learn(
    environment: SpeedTracking, training: ImitationTrainingConfig, recurrent: bool, out: Path, seed: int
) -> policies.AnyNetwork:
    """The network after `training.steps`; goes on with what `out` holds."""
    torch.manual_seed(seed)
    network = begin(environment.history, training.hidden, recurrent)
    optimizer = torch.optim.Adam(network.parameters(), training.learning_rate)
    task, machines, rng = environment.task, environment.machines, environment.rng
    steps = environment.num_envs * episode_samples(task)  # of an episode
    progress = Progress(out)
    if (state := progress.state) is not None:
        network.load_state_dict(state["policy"])
        optimizer.load_state_dict(state["optimizer"])
        rng.bit_generator.state = state["environment"]
        machines.restore(state["machines"])
    while progress.steps < training.steps:
        done = progress.steps / training.steps
        policy = policies.Policy(network)
        machines.updated(policy)
        fall(optimizer, training.learning_rate, done)
        episode = _episode(environment, policy, training, led=max(0.0, 1 - done / training.led))
        _fit(network, optimizer, episode, training, rng)
        progress.episode(
            progress.steps + steps,
            episode.errors,
            task.tolerance,
            {
                "policy": network.state_dict(),
                "optimizer": optimizer.state_dict(),
                "environment": rng.bit_generator.state,
                "machines": machines.state(),
            },
        )
    return network


def begin(history: int, hidden: list[int], recurrent: bool) -> policies.AnyNetwork:
    """A network that is a proportional controller, whatever it remembers."""
    inputs = observation_size(history)
    network: policies.AnyNetwork
    last: Tensor
    if recurrent:
        network = policies.RecurrentNetwork(inputs, hidden)
        gains, last = network.gains, network.gains.bias
    else:
        network = policies.Network(inputs, hidden, straight=True)
        gains, last = network.action, network.action.weight[0, hidden[-1] :]
    nn.init.zeros_(gains.weight)
    nn.init.zeros_(gains.bias)
    with torch.no_grad():
        last[:2] = torch.tensor([GAIN, -GAIN])
        if history:
            last[3] = AGAIN
    return network


@dataclass(frozen=True)
class _Episode:
    seen: Tensor  # [T, N, inputs]
    wanted: Tensor  # [T, N], the teacher's actions
    errors: np.ndarray  # [N, targets], of all of them


def _episode(
    environment: SpeedTracking, policy: policies.Policy, training: ImitationTrainingConfig, led: float
) -> _Episode:
    """One in which the teacher leads a share `led` of the joints, and the policy the others."""
    seen, _ = environment.reset()
    policy.begin(environment.num_envs)
    teacher = Teacher(environment, training.effort)
    by_teacher = environment.rng.random(environment.num_envs) < led
    sights, wanted = [], []
    info: dict[str, np.ndarray] = {}
    while not info:
        sights.append(seen)
        wanted.append(teacher.act())
        sent = np.where(by_teacher, wanted[-1], policy.act(seen)[:, 0])
        seen, *_, info = environment.step(sent[:, None])
    return _Episode(
        torch.from_numpy(np.stack(sights)),
        torch.from_numpy(np.stack(wanted).astype(np.float32)),
        info["errors"],
    )


def _fit(
    network: policies.AnyNetwork,
    optimizer: torch.optim.Optimizer,
    episode: _Episode,
    training: ImitationTrainingConfig,
    rng: np.random.Generator,
) -> None:
    """Go over an episode, window after window where memory asks for their order, and shuffled elsewhere."""
    count, joints = episode.wanted.shape
    for _ in range(training.passes):
        if isinstance(network, policies.RecurrentNetwork):
            memory = torch.zeros(1, joints, network.hidden[-1])
            for start in range(0, count, training.window):
                some = slice(start, start + training.window)
                actions, memory = network(episode.seen[some], memory.detach())
                _update(network, optimizer, actions, episode.wanted[some])
        else:
            seen, wanted = episode.seen.flatten(0, 1), episode.wanted.flatten()
            for each in torch.from_numpy(rng.permutation(len(seen))).split(training.window * joints):
                _update(network, optimizer, network(seen[each])[:, 0], wanted[each])


def _update(network: nn.Module, optimizer: torch.optim.Optimizer, actions: Tensor, wanted: Tensor) -> None:
    beyond = (wanted.abs() >= 1) & (actions * wanted > 1)  # both at the limit, on the same side
    off = torch.where(beyond, 0.0, actions - wanted)
    size = (off.square() + COARSE**2).sqrt() - COARSE
    optimizer.zero_grad()
    (size + 0.5 * LOGARITHM * torch.log1p((off / FINE).square())).mean().backward()
    nn.utils.clip_grad_norm_(network.parameters(), 1.0)
    optimizer.step()
