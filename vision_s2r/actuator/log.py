"""Logs of a drive: what a controller commanded, what the sensors showed."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from vision_s2r.actuator.drive import Drive
from vision_s2r.actuator.references import References
from vision_s2r.threads import one_thread

LIMIT = 1.5  # rad: what can be commanded


class PositionController(Protocol):
    """From what is wanted and what is measured to a drive's command."""

    def begin(self, count: int) -> None:
        """A motion of so many drives begins."""
        ...

    def command(self, wanted: Tensor, measured: Tensor) -> Tensor:
        """Commands [N] (rad) for wanted positions, velocities and accelerations [N, 3], and `Drive.measured` [N, 2]."""
        ...


class LooseLoop:
    """Answers position errors with `position` [N], and velocity errors with `velocity` [N] (s)."""

    def __init__(self, position: np.ndarray, velocity: np.ndarray) -> None:
        self._gains = torch.from_numpy(np.stack([position, velocity], axis=1))

    def begin(self, count: int) -> None:
        """Nothing is remembered."""

    def command(self, wanted: Tensor, measured: Tensor) -> Tensor:
        """The wanted position, and a bit more for what is missing."""
        return wanted[:, 0] + (self._gains * (wanted[:, :2] - measured)).sum(dim=1)


@dataclass(frozen=True)
class DriveLog:
    """N motions of T samples of a drive, [N, T] but where it says so."""

    command: np.ndarray  # rad, held from this sample to the next
    position: np.ndarray  # rad, measured as this sample began
    velocity: np.ndarray  # rad/s, measured as this sample began
    torque: np.ndarray  # N·m, delivered, as the sensor has it: the mean from this sample to the next
    miss: np.ndarray  # rad, the reference less the true position as this sample began
    payload: np.ndarray  # N·m [N], the world's torque on the load

    @property
    def error(self) -> np.ndarray:
        """Command less measured position, rad."""
        return self.command - self.position

    def first(self, motions: int) -> "DriveLog":
        """The first motions."""
        return DriveLog(*(each[:motions] for each in vars(self).values()))


def followed(drive: Drive, references: References, controller: PositionController) -> Iterator[tuple[Tensor, ...]]:
    """What is in a `DriveLog`, from `command` to `miss`, a sample [N] at a time, as a drive at rest goes on."""
    wanted = torch.from_numpy(np.stack([references.position, references.velocity, references.acceleration], axis=2))
    controller.begin(len(drive))
    for sample in wanted.unbind(dim=1):
        measured, miss = drive.measured, sample[:, 0] - drive.true[:, 0]
        command = controller.command(sample, measured).clamp(-LIMIT, LIMIT)
        yield command, measured[:, 0], measured[:, 1], drive.step(command), miss


@one_thread()
@torch.no_grad()
def record(drive: Drive, references: References, controller: PositionController) -> DriveLog:
    """Log a drive from rest while a controller follows the references."""
    samples = zip(*followed(drive, references, controller), strict=True)
    logged = [torch.stack(each, dim=1).numpy() for each in samples]
    return DriveLog(*[*logged, references.payload])
