"""Logs of machines whose parameters are known."""

import numpy as np

from tests.recordings import NOMINAL
from vision_s2r.joint import NominalJoint, Tables, pack, simulate
from vision_s2r.recording import JointRecording


def steps(episodes: int = 4, samples: int = 600, largest: float = 1.8, seed: int = 1) -> np.ndarray:
    """Currents [E, T] that change at random five times a second."""
    drawn = np.random.default_rng(seed).uniform(-largest, largest, (episodes, samples // 20))
    return np.repeat(drawn, 20, axis=1)


def a_log(
    effects: dict[str, dict[str, float]],
    command: np.ndarray | None = None,
    noise: tuple[float, float] = (1e-4, 1e-3),
    seed: int = 0,
    unknown: tuple[Tables, np.ndarray] | None = None,
) -> JointRecording:
    """What sensors of this noise (rad, rad/s) show of the nominal joint with these effects, 100 times a second.

    `unknown`: a torque that is none of them, its knots and its heights there (N·m).
    """
    command = steps() if command is None else command
    tables, heights = unknown or (None, np.empty(0))
    machine = np.append(pack(NominalJoint(**NOMINAL), effects), heights)[None]
    states = simulate(machine, command, np.zeros((len(command), 2)), 0.01, tables=tables)[0]
    states = states + np.random.default_rng(seed).normal(size=states.shape) * noise
    return JointRecording(
        nominal=NOMINAL,
        sample_time=0.01,
        units="rotary",
        command=command,
        position=states[..., 0],
        velocity=states[..., 1],
        lengths=np.full(len(command), command.shape[1]),
        episodes=tuple(range(len(command))),
    )
