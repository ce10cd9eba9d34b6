"""The vector environment as Stable-Baselines3 wants it."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from vision_s2r.control.environment import SpeedTracking


class Adapter(VecEnv):
    """`SpeedTracking` behind Stable-Baselines3's interface; `errors` holds those of the last episode, [N, T]."""

    def __init__(self, environment: SpeedTracking) -> None:
        self.environment = environment
        self.errors: np.ndarray | None = None
        super().__init__(environment.num_envs, environment.single_observation_space, environment.single_action_space)
        self._nothing: list[dict[str, Any]] = [{} for _ in range(environment.num_envs)]

    def reset(self) -> np.ndarray:
        """Begin an episode."""
        return self.environment.reset()[0]

    def step_async(self, actions: np.ndarray) -> None:
        """Note the actions."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Send them."""
        seen, reward, _, truncated, info = self.environment.step(self._actions)
        infos = self._nothing
        if info:
            self.errors = info["errors"]
            infos = [{"TimeLimit.truncated": True, "terminal_observation": last} for last in info["final_obs"]]
        return seen, reward, truncated, infos

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """One attribute for all."""
        return [getattr(self.environment, attr_name, None)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Joints have no attributes of their own."""
        raise NotImplementedError

    def env_method(
        self, method_name: str, *args: Any, indices: int | Iterable[int] | None = None, **kwargs: Any
    ) -> list[Any]:
        """Nor methods."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type[Any], indices: int | Iterable[int] | None = None) -> list[bool]:
        """In nothing."""
        return [False] * len(list(self._get_indices(indices)))
