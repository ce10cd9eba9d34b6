"""The scene as a Gymnasium environment: see a picture, choose a grasp, learn whether it held.

`gymnasium.make("vision_s2r.scene.env:vision_s2r/BinGrasp-v0")`; the module's name may go once it is imported. An
episode is one attempt, as in the evaluation: reset draws a scene, step tries a grasp in it and ends.
"""

from typing import Any

import gymnasium
import numpy as np

from vision_s2r.errors import UserError, nearest
from vision_s2r.scene import config
from vision_s2r.scene.appearance import Appearance, canonical, randomized, real
from vision_s2r.scene.config import SceneConfig
from vision_s2r.scene.grasping import attempt
from vision_s2r.scene.proposals import REACH
from vision_s2r.scene.renderer import Renderer
from vision_s2r.scene.sampling import nominal_camera, sample_state
from vision_s2r.scene.state import SceneState

ID = "vision_s2r/BinGrasp-v0"
LOOKS = ("canonical", "randomized", "real")


class BinGraspEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """Observation: picture, uint8 [size, size, 3]. Action: (x, y) in metres and yaw in radians, float32 [3].

    Reward: 1 where an object is held after the lift, else 0. `info` has the scene state (reset) and why a grasp
    failed (step).
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012 - Gymnasium's own form

    def __init__(
        self,
        scene: SceneConfig | None = None,
        size: int = 64,
        look: str = "canonical",
        render_mode: str | None = None,
    ) -> None:
        self.cfg = scene or SceneConfig()
        config.check(self.cfg)
        if look not in LOOKS:
            raise UserError(f"look '{look}': {nearest(look, LOOKS)}")
        self.size, self.look, self.render_mode = size, look, render_mode
        self.observation_space = gymnasium.spaces.Box(0, 255, (size, size, 3), np.uint8)
        high = np.array([REACH, REACH, np.pi / 2], dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-high, high, dtype=np.float32)
        self._renderer: Renderer | None = None
        self._state: SceneState | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """A new scene; the same seed gives the same."""
        super().reset(seed=seed)
        first, second = (int(n) for n in self.np_random.integers(2**31, size=2))
        self._state = sample_state(self.cfg, first, second)
        return self._picture(self._state, self.size), {"state": self._state.to_dict()}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Try the grasp; the picture stays what it was before it."""
        if self._state is None:
            raise gymnasium.error.ResetNeeded("call reset before step")
        outcome = attempt(self.cfg, self._state, np.asarray(action, dtype=np.float64))
        picture = self._picture(self._state, self.size)
        return picture, float(outcome.success), True, False, {"reason": outcome.reason, "held": outcome.held}

    def render(self) -> np.ndarray | None:
        """The scene at four times the observation's size, uint8 [4 size, 4 size, 3]."""
        if self.render_mode is None or self._state is None:
            return None
        return self._picture(self._state, 4 * self.size)

    def close(self) -> None:
        """Disconnect from the renderer."""
        if self._renderer is not None:
            self._renderer.__exit__(None, None, None)
            self._renderer = None

    def _picture(self, state: SceneState, size: int) -> np.ndarray:
        if self._renderer is None:
            self._renderer = Renderer(self.cfg)
        camera = nominal_camera(self.cfg.viewpoint) if self.look == "canonical" else None
        return self._renderer.render(state, self._appearance(state), size, camera=camera).rgb

    def _appearance(self, state: SceneState) -> Appearance:
        if self.look == "canonical":
            return canonical(state)
        return randomized(self.cfg, state) if self.look == "randomized" else real(self.cfg, state)


gymnasium.register(ID, entry_point="vision_s2r.scene.env:BinGraspEnv", max_episode_steps=1)
