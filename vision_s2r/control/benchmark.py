"""How fast the environment steps, against the one-joint Python loop that everybody writes first.

Both track speeds of the same joint with the same observation, reward and integration step, under random actions, in
turns in one process; what counts is their ratio. A step is one command to one joint.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from rich.progress import track

from vision_s2r.control.config import ControlTaskConfig, JointConfig, episode_samples, held_samples
from vision_s2r.control.effects import CONTROL_EFFECTS
from vision_s2r.control.environment import SCALES, SpeedTracking
from vision_s2r.control.machines import DrawnMachines
from vision_s2r.joint import NominalJoint
from vision_s2r.randomize import Box
from vision_s2r.results import publish

JOINTS = (1, 256, 4096, 16384)
DAMPING, FRICTION = (0.08, 0.20), (0.01, 0.06)
RANDOMIZED: dict[str, dict[str, Any]] = {
    "viscous_damping": {"value": list(DAMPING)},
    "coulomb_friction": {"value": list(FRICTION)},
}
PLAY = {**RANDOMIZED, "backlash": {"width": [0.01, 0.05]}, "latency": {"delay": [0.0, 0.02]}}
ROUNDS = 5
SECONDS = 0.5  # of each way, a round
REFERENCE = "Python loop, 1 joint"


class OneJointEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """The plain loop: semi-implicit Euler by 2 ms, friction clamped to what stops the joint, damping drawn anew."""

    def __init__(self, task: ControlTaskConfig) -> None:
        self.task, self.joint = task, JointConfig()
        self.observation_space = spaces.Box(-np.inf, np.inf, (2,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, object] | None = None) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        self.damping = self.np_random.uniform(*DAMPING)
        self.friction = self.np_random.uniform(*FRICTION)
        self.position = self.velocity = 0.0
        self.sample = 0
        size = self.np_random.uniform(self.task.lowest, self.task.highest, self.task.targets)
        self.targets = size * self.np_random.choice([-1.0, 1.0], self.task.targets)
        return self._seen(), {}

    def _seen(self) -> np.ndarray:
        row = min(self.sample // held_samples(self.task), self.task.targets - 1)
        self.target = self.targets[row]
        return np.array([self.target / self.task.highest, self.velocity / self.task.highest], np.float32)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        current = float(np.clip(action[0], -1, 1)) * self.task.max_current
        step = self.task.sample_time / 5
        for _ in range(5):
            torque = self.joint.torque_constant * current - self.damping * self.velocity
            self.velocity += step * torque / self.joint.inertia
            friction = step * self.friction / self.joint.inertia
            self.velocity -= min(max(self.velocity, -friction), friction)
            self.position += step * self.velocity
        error = abs(self.velocity / self.target - 1)
        reward = -sum(min(error / scale, 1.0) for scale in SCALES) / len(SCALES)
        self.sample += 1
        over = self.sample == episode_samples(self.task)
        return self._seen(), reward, False, over, {}


def run(seed: int, out: Path) -> Path:
    """Measure environment steps a second of each way, medians over rounds; print and write control.json, returned."""
    ways: dict[str, Callable[[], float]] = {REFERENCE: lambda: _loop(seed)}
    for count in JOINTS:
        ways[f"ours, {count:,} joints"] = _ours(count, RANDOMIZED, seed)
    ways[f"ours, {JOINTS[-1]:,} joints, with play and latency"] = _ours(JOINTS[-1], PLAY, seed)
    for way in ways.values():
        way()  # compiles
    rounds = [{name: way() for name, way in ways.items()} for _ in track(range(ROUNDS), "rounds")]
    speeds = {name: float(np.median([each[name] for each in rounds])) for name in ways}
    rows = [[name, speed / 1e6, speed / speeds[REFERENCE]] for name, speed in speeds.items()]
    columns = ["way", "million steps/s", f"/ {REFERENCE}"]
    return publish(out / "control.json", "vision-s2r benchmark control", columns, rows)


def _ours(count: int, effects: dict[str, dict[str, Any]], seed: int) -> Callable[[], float]:
    machines = DrawnMachines(Box.of(effects, CONTROL_EFFECTS))
    environment = SpeedTracking(ControlTaskConfig(), NominalJoint(**vars(JointConfig())), machines, count, seed=seed)
    environment.reset(seed=seed)
    actions = np.random.default_rng(seed).uniform(-1, 1, (64, count, 1)).astype(np.float32)

    def way() -> float:
        start, steps = time.perf_counter(), 0
        while time.perf_counter() - start < SECONDS:
            environment.step(actions[steps % len(actions)])
            steps += 1
        return steps * count / (time.perf_counter() - start)

    return way


def _loop(seed: int) -> float:
    environment = OneJointEnv(ControlTaskConfig())
    environment.reset(seed=seed)
    actions = np.random.default_rng(seed).uniform(-1, 1, (64, 1)).astype(np.float32)
    start, steps = time.perf_counter(), 0
    while time.perf_counter() - start < SECONDS:
        _, _, _, over, _ = environment.step(actions[steps % len(actions)])
        steps += 1
        if over:
            environment.reset()
    return steps / (time.perf_counter() - start)
