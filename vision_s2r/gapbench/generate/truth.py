"""A generated joint as it is: its drive, what alters its command and its sensor, and what a recording of it shows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vision_s2r.gapbench.generate.drive import DriveModel, run, step_of
from vision_s2r.gapbench.generate.excitation import SAMPLE_TIME, Excitation, played
from vision_s2r.gapbench.generate.severity import left_over

Change = Callable[[np.ndarray], np.ndarray]
FINE, COARSE = 5e-4, 4e-3  # s: for recordings, to measure a severity


def unaltered(values: np.ndarray) -> np.ndarray:
    """What most commands and sensors do."""
    return values


@dataclass(frozen=True)
class JointTruth:
    """A drive, with changes to what it is told ([T] A) and to what is read of it ([T, 2] rad, rad/s)."""

    drive: DriveModel
    command: Change = field(default=unaltered)
    sensor: Change = field(default=unaltered)

    def with_fields(self, fields: dict[str, float]) -> "JointTruth":
        """The same joint, other values."""
        return replace(self, drive=self.drive._replace(**fields))


def record(
    truth: JointTruth, excitations: Sequence[Excitation], longest: float = FINE
) -> tuple[np.ndarray, np.ndarray]:
    """Motion [E, T, 2] (rad, rad/s) as a noiseless analogue sensor sees it, and what was commanded [E, T] (A)."""
    motion, commands = [], []
    step = step_of(truth.drive, longest)
    for excitation in excitations:
        first = np.array([excitation.start, 0.0])
        rows, command = run(truth.drive, excitation.loop, first, SAMPLE_TIME, step)
        if truth.command is not unaltered:
            rows, _ = run(truth.drive, played(truth.command(command)), first, SAMPLE_TIME, step)
        motion.append(truth.sensor(rows))
        commands.append(command)
    return np.stack(motion), np.stack(commands)


def replay(drive: DriveModel, commands: np.ndarray, first: np.ndarray, longest: float = FINE) -> np.ndarray:
    """Free run of these commands [E, T] (A) from these states [E, 2]: what an encoder would show [E, T, 2]."""
    step = step_of(drive, longest)
    rows = [
        run(drive, played(command), start, SAMPLE_TIME, step)[0] for command, start in zip(commands, first, strict=True)
    ]
    return encoded(np.stack(rows), drive.resolution)


def encoded(motion: np.ndarray, resolution: float) -> np.ndarray:
    """Motion [E, T, 2] through an encoder of this resolution (rad); 0: as it is."""
    if resolution == 0:
        return motion
    position = np.round(motion[..., 0] / resolution) * resolution
    return np.stack([position, np.gradient(position, SAMPLE_TIME, axis=1)], axis=-1)


def velocity_difference(truth: JointTruth, without: JointTruth, excitations: Sequence[Excitation]) -> float:
    """How far (rad/s, root mean square) the free run of one joint is from another's under the first one's commands."""
    motion, commands = record(truth, excitations, COARSE)
    other = _analogue(without, commands, excitations)
    resolutions = truth.drive.resolution, without.drive.resolution
    if resolutions[0] != resolutions[1]:  # else two encoders would add what neither joint does
        motion, other = encoded(motion, resolutions[0]), encoded(other, resolutions[1])
    return _size((motion - other)[..., 1])


def unimitated(
    truth: JointTruth,
    base: JointTruth,
    target: JointTruth,
    others: Sequence[JointTruth],
    excitations: Sequence[Excitation],
) -> float:
    """What of the difference (rad/s, root mean square) between two joints no mixture of other changes imitates.

    To first order: the velocities of `target` less those of `base`, less their projection on the differences that
    `others` make to `base`, all under the commands of `truth`.
    """
    _, commands = record(truth, excitations, COARSE)
    before = _analogue(base, commands, excitations)[..., 1].ravel()
    change = _analogue(target, commands, excitations)[..., 1].ravel() - before
    columns = np.stack([_analogue(other, commands, excitations)[..., 1].ravel() - before for other in others], 1)
    return left_over(change, columns)


def _analogue(truth: JointTruth, commands: np.ndarray, excitations: Sequence[Excitation]) -> np.ndarray:
    """Motion [E, T, 2] of a joint under these commands [E, T], but for its encoder."""
    starts = np.array([[excitation.start, 0.0] for excitation in excitations])
    given = np.stack([truth.command(command) for command in commands])
    drive = truth.drive._replace(resolution=0.0)
    return np.stack([truth.sensor(rows) for rows in replay(drive, given, starts, COARSE)])


def _size(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
