"""The actuator network: from what a position controller sees to the torque that reaches the load.

Three hidden layers of 32 softsign units (Hwangbo et al. 2019). Inputs are position errors (command − measured position,
rad) and measured velocities (rad/s) now and some samples ago; the output is the delivered torque (N·m), the mean over
the sample that begins now. Neighbouring samples of a motion are almost equal, and what tells them apart is what
matters: inputs are whitened, not only scaled.
"""

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from vision_s2r.actuator.config import lags
from vision_s2r.errors import UserError
from vision_s2r.training.checkpoint import Checkpoint, load, save

WIDTH, DEPTH = 32, 3
KIND = "actuator"


class ActuatorNetwork(nn.Module):
    """`history` in s ago, rising from 0, in multiples of `sample_time` (s)."""

    mean: Tensor
    whitening: Tensor
    scale: Tensor

    def __init__(self, history: Sequence[float], sample_time: float) -> None:
        super().__init__()
        self.history, self.sample_time = tuple(history), sample_time
        self.lags = lags(self.history, sample_time)
        size = 2 * len(self.lags)
        widths = [size] + [WIDTH] * DEPTH
        hidden = [layer for pair in itertools.pairwise(widths) for layer in (nn.Linear(*pair), nn.Softsign())]
        self.layers = nn.Sequential(*hidden, nn.Linear(WIDTH, 1))
        self.normalize(np.zeros(size), np.eye(size), 1.0)

    def normalize(self, mean: np.ndarray, whitening: np.ndarray, scale: float) -> None:
        """Inputs [B, 2H] become (inputs − mean [2H]) @ whitening [2H, 2H]; the output is in units of `scale` (N·m)."""
        for name, value in (("mean", mean), ("whitening", whitening), ("scale", scale)):
            self.register_buffer(name, torch.as_tensor(value, dtype=torch.float32), persistent=False)

    def forward(self, inputs: Tensor) -> Tensor:
        """Torques [B] (N·m) of float32 [B, 2H]: position errors of the history, latest first, then velocities."""
        return self.scale * self.layers((inputs - self.mean) @ self.whitening)[:, 0]

    def save(self, path: Path, training: dict[str, object]) -> None:
        """Writes a checkpoint: weights; history and normalization as JSON. Raises UserError where it cannot."""
        configuration = {"history": list(self.history), "sample_time": self.sample_time}
        normalization = {name: getattr(self, name).tolist() for name in ("mean", "whitening", "scale")}
        tensors = {f"network.{key}": value for key, value in self.state_dict().items()}
        save(path, Checkpoint(KIND, configuration, normalization, training, tensors))

    @classmethod
    def load(cls, path: str | Path, history: Sequence[float] | None = None) -> "ActuatorNetwork":
        """Reads what `save` wrote. Raises UserError for what is none of ours, and where its sizes do not fit.

        With `history`, also where the network has another one.
        """
        checkpoint = load(path, KIND)
        try:
            network = cls(checkpoint.configuration["history"], checkpoint.configuration["sample_time"])
            mean, whitening = (np.array(checkpoint.normalization[name], float) for name in ("mean", "whitening"))
            scale = float(checkpoint.normalization["scale"])
        except (KeyError, TypeError, ValueError, UserError) as error:
            raise UserError(f"{path}: its header is that of no actuator network ({error})") from error
        if history is not None and network.history != tuple(history):
            raise UserError(f"{path}: sees {list(network.history)} s ago, expected {list(history)}")
        size = 2 * len(network.lags)
        if mean.shape != (size,) or whitening.shape != (size, size):
            raise UserError(f"{path}: normalizes {mean.size} inputs: its history of {len(network.lags)} has {size}")
        checkpoint.restore("network", network)
        network.normalize(mean, whitening, scale)
        return network
