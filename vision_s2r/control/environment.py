"""Speed tracking on randomized joints: a Gymnasium vector environment on the compiled simulator."""

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from vision_s2r.control.config import ControlTaskConfig, held_samples
from vision_s2r.control.effects import LOOP_EFFECTS
from vision_s2r.control.machines import Machines
from vision_s2r.joint import Joints, NominalJoint, pack_many

# Relative errors from which being worse costs nothing more: coarse, fair and fine have a share of the reward each, so
# that there is always something to gain.
SCALES = (1.0, 0.1, 0.02)


def observation_size(history: int) -> int:
    """Target, velocity, and of each sample before that velocity and command."""
    return 2 + 2 * history


def history_of(size: int) -> int:
    """How many samples back an observation of this size goes."""
    return (size - 2) // 2


class SpeedTracking(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """N joints that are to turn at target speeds, one after the other.

    An observation [2 + 2·history] is the target and the velocity that the sensor shows, over `task.highest`; then, of
    each of the `history` samples before, the velocity and the current that was sent, over `task.max_current`. An
    action [1] in [-1, 1] is the current over `task.max_current`. A step earns -1 (everything wrong) to 0 (exact).

    Targets are uniform in ±[lowest, highest]; `reset(options={"targets": [N, T]})` gives others for one episode. All
    episodes begin at rest and end together, truncated; then `info["errors"]` [N, T] holds what was left of each
    target: mean speed over the last `task.settled` seconds, relative to the target, minus 1.

    `history` samples are seen beside the present one. `machines` says on which joints, an episode at a time; effects
    are those of `CONTROL_EFFECTS`.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012 (Gymnasium's)

    def __init__(
        self,
        task: ControlTaskConfig,
        nominal: NominalJoint,
        machines: Machines,
        count: int,
        history: int = 0,
        seed: int = 0,
    ) -> None:
        self.task, self.nominal, self.machines, self.history = task, nominal, machines, history
        self.num_envs = count
        self.single_observation_space = spaces.Box(-np.inf, np.inf, (observation_size(history),), np.float32)
        self.single_action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, count)
        self.action_space = batch_space(self.single_action_space, count)
        self.rng = np.random.default_rng(seed)
        self.began_with: dict[str, Any] = {}  # the state of `rng` before the present episode
        self._held, self._settled = held_samples(task), round(task.settled / task.sample_time)
        self._joints: Joints | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode on new machines."""
        if seed is not None:
            self.rng = np.random.default_rng(seed)
        return self._begin((options or {}).get("targets")), {}

    @property
    def joints(self) -> Joints:
        """The joints as they are now."""
        assert self._joints is not None, "reset first"
        return self._joints

    def _begin(self, targets: np.ndarray | None = None) -> np.ndarray:
        count, task = self.num_envs, self.task
        self.began_with = dict(self.rng.bit_generator.state)
        values = self.machines.draw(count, self.rng)
        machines = pack_many(
            self.nominal, {name: given for name, given in values.items() if name not in LOOP_EFFECTS}, count
        )
        self._noise = values["observation_noise"]["sigma"] if "observation_noise" in values else np.zeros(count)
        period = task.sample_time * (values["time_step"]["scale"] if "time_step" in values else np.ones(count))
        if self._joints is None:
            self._joints = Joints(machines, period)
        else:
            self._joints.reset(np.arange(count), machines, np.zeros((count, 2)), period)
        if targets is None:
            size = self.rng.uniform(task.lowest, task.highest, (count, task.targets))
            targets = size * self.rng.choice([-1.0, 1.0], size.shape)
        self._targets = np.ascontiguousarray(targets.T)  # [T, N]
        self._errors = np.zeros_like(self._targets)
        self.sample, self.sent = 0, np.zeros(count)
        self._seen = np.zeros((count, observation_size(self.history)), np.float32)
        return self._observe(self._joints.shown[:, 1], np.zeros(count))

    def _observe(self, velocity: np.ndarray, sent: np.ndarray) -> np.ndarray:
        """`sent` [N], the last action, and the velocity [N] that followed join what was seen."""
        if self._noise.any():
            velocity = velocity + self._noise * self.rng.standard_normal(len(velocity))
        seen = self._seen.copy()
        if self.history:
            seen[:, 4:] = self._seen[:, 2:-2]
            seen[:, 2] = self._seen[:, 1]
            seen[:, 3] = sent
        seen[:, 1] = velocity / self.task.highest
        seen[:, 0] = self.target / self.task.highest
        self._seen = seen
        return seen

    @property
    def is_new_target(self) -> bool:
        """Whether the present sample is the first of its targets."""
        return self.sample % self._held == 0

    @property
    def target(self) -> np.ndarray:
        """Target speeds [N] of the present sample, rad/s."""
        return self._targets[min(self.sample // self._held, len(self._targets) - 1)]

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Send currents [N, 1] for a sample. Where that ends the episode, the next one has begun."""
        self.sent = sent = np.clip(actions[:, 0], -1.0, 1.0).astype(np.float64)  # [N], the last action
        shown = self.joints.step(sent * self.task.max_current)[:, 1]
        true, target = self.joints.true[:, 1], self.target
        error = np.abs(true / target - 1)
        reward = -sum(np.minimum(error / scale, 1.0) for scale in SCALES) / len(SCALES)
        row, inside = divmod(self.sample, self._held)
        if inside >= self._held - self._settled:
            self._errors[row] += (true / target - 1) / self._settled
        self.sample += 1
        over = self.sample == self._held * len(self._targets)
        seen, info = self._observe(shown, sent), {}
        if over:
            info = {"final_obs": seen, "errors": self._errors.T.copy()}
            seen = self._begin()
        count = self.num_envs
        return seen, reward.astype(np.float32), np.zeros(count, bool), np.full(count, over), info
