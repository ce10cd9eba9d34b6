"""One joint as a Gymnasium environment, for whoever brings a learner of their own."""

from typing import Any

import gymnasium
import numpy as np

from vision_s2r.control.config import ControlTaskConfig, JointConfig
from vision_s2r.control.environment import SpeedTracking
from vision_s2r.control.machines import Given, Machines
from vision_s2r.joint import NominalJoint


class OneJoint(gymnasium.Env[np.ndarray, np.ndarray]):
    """`SpeedTracking` of a single joint; by default the nominal one, without effects."""

    def __init__(
        self,
        task: ControlTaskConfig | None = None,
        nominal: NominalJoint | None = None,
        machines: Machines | None = None,
        history: int = 0,
    ) -> None:
        nominal = nominal or NominalJoint(**vars(JointConfig()))
        self._joint = SpeedTracking(task or ControlTaskConfig(), nominal, machines or Given({}), 1, history)
        self.observation_space = self._joint.single_observation_space
        self.action_space = self._joint.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        seen, info = self._joint.reset(seed=seed, options=options)
        return seen[0], info

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Send a current for a sample."""
        seen, reward, terminated, truncated, info = self._joint.step(np.asarray(action)[None])
        last = info["final_obs"] if info else seen
        return last[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), {k: v[0] for k, v in info.items()}
