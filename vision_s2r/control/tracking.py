"""How well a controller holds target speeds on given machines."""

import numpy as np

from vision_s2r.control.config import ControlTaskConfig, episode_samples
from vision_s2r.control.environment import SpeedTracking
from vision_s2r.control.machines import Controller, Machines
from vision_s2r.joint import NominalJoint


def track(
    controller: Controller,
    task: ControlTaskConfig,
    nominal: NominalJoint,
    machines: Machines,
    targets: np.ndarray,
    seed: int = 0,
) -> np.ndarray:
    """Errors [N, T] of an episode of targets [N, T] (rad/s) on N machines: relative to the target, signed.

    `seed` is of the machines, where they are drawn, and of their sensors' noise.
    """
    environment = SpeedTracking(task, nominal, machines, len(targets), controller.history, seed)
    seen, _ = environment.reset(options={"targets": targets})
    controller.begin(len(targets))
    info: dict[str, np.ndarray] = {}
    for _ in range(episode_samples(task) // task.targets * targets.shape[1]):
        seen, _, _, _, info = environment.step(controller.act(seen))
    return info["errors"]
