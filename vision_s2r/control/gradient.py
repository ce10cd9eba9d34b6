"""Training a policy by its gradient through the simulator, backwards in time.

The compiled simulator is differentiated numerically, a sample at a time; a joint has one command and four states, so
that this costs six more of it. Where PPO has to find out by trying what a current would have done, here every current
is told (Wiedemann et al., "Training efficient controllers via analytic policy gradient", ICRA 2023).
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from vision_s2r.control import policy as policies
from vision_s2r.control.config import LEAST_RATE, GradientTrainingConfig, episode_samples
from vision_s2r.control.environment import SpeedTracking, observation_size
from vision_s2r.control.progress import Progress
from vision_s2r.joint.differentiable import DifferentiableJoints

FINE = 0.01  # relative error below which being better gains little
STEEPEST = 3.0  # what a joint's state may count at most in a loss: where a loop runs away, its gradient does too
FORGET = 0.92  # of what a sample's state means for later ones: a horizon of a dozen samples
GAIN, AGAIN = 2.0, 0.2  # of the controller that a training begins with: for what is missing, and of the last current


def learn(environment: SpeedTracking, training: GradientTrainingConfig, out: Path, seed: int) -> policies.Network:
    """The network after `training.steps`; goes on with what `out` holds."""
    torch.manual_seed(seed)
    network = begin(environment.history, training.hidden)
    optimizer = torch.optim.Adam(network.parameters(), training.learning_rate)
    task, machines = environment.task, environment.machines
    steps = environment.num_envs * episode_samples(task)  # of an episode
    progress = Progress(out)
    if (state := progress.state) is not None:
        network.load_state_dict(state["policy"])
        optimizer.load_state_dict(state["optimizer"])
        environment.rng.bit_generator.state = state["environment"]
        machines.restore(state["machines"])
    while progress.steps < training.steps:
        machines.updated(policies.Policy(network))
        fall(optimizer, training.learning_rate, progress.steps / training.steps)
        errors = _episode(environment, network, optimizer, training.window)
        progress.episode(
            progress.steps + steps,
            errors,
            task.tolerance,
            {
                "policy": network.state_dict(),
                "optimizer": optimizer.state_dict(),
                "environment": environment.rng.bit_generator.state,
                "machines": machines.state(),
            },
        )
    return network


def fall(optimizer: torch.optim.Optimizer, highest: float, done: float) -> None:
    """Set the learning rate for when a share of the steps is `done`: half a cosine from the highest on."""
    for group in optimizer.param_groups:
        group["lr"] = highest * max(LEAST_RATE, 0.5 * (1 + math.cos(math.pi * done)))


def begin(history: int, hidden: list[int]) -> policies.Network:
    """A network that is a proportional controller: where nothing moves, there is no gradient to begin with."""
    network = policies.Network(observation_size(history), hidden, straight=True)
    nn.init.zeros_(network.action.weight)
    nn.init.zeros_(network.action.bias)
    with torch.no_grad():
        straight = network.action.weight[0, hidden[-1] :]
        straight[:2] = torch.tensor([GAIN, -GAIN])
        straight[3:4] = AGAIN
    return network


def _episode(
    environment: SpeedTracking, network: policies.Network, optimizer: torch.optim.Optimizer, window: int
) -> np.ndarray:
    """Go through an episode, with an update after each `window` samples; the errors [N, T] of its targets."""
    task = environment.task
    sight = torch.from_numpy(environment.reset()[0])
    joints = DifferentiableJoints(environment.joints, STEEPEST, FORGET)
    losses: list[Tensor] = []
    info: dict[str, Any] = {}
    while not info:
        action = network(sight)
        sent = action + (action.clamp(-1, 1) - action).detach()  # one that is cut still knows which way is back
        velocity = joints.foreseen(task.max_current * sent[:, 0].double())[:, 1:2].float()
        target = torch.from_numpy(environment.target)[:, None]
        losses.append(0.5 * torch.log1p(((velocity / target - 1) / FINE) ** 2).mean())
        seen, *_, info = environment.step(sent.detach().numpy())
        flowing = torch.cat([sight[:, :1], velocity / task.highest, sight[:, 1:2], sent, sight[:, 2:-2]], dim=1)
        flowing = flowing[:, : sight.shape[1]]
        sight = torch.from_numpy(seen) + flowing - flowing.detach()  # the values that are seen, the gradient of these
        if len(losses) == window or info:
            optimizer.zero_grad()
            torch.stack(losses).mean().backward()
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
            losses, sight = [], sight.detach()
            joints.detach()
    errors: np.ndarray = info["errors"]
    return errors
