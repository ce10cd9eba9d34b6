"""Logs of a drive: what a controller commanded, what the sensors showed."""

from dataclasses import dataclass

import numpy as np

from vision_s2r.actuator.drive import Drive
from vision_s2r.actuator.references import References
from vision_s2r.threads import one_thread

# The gains of a controller, and between which values they are tuned:
# command = r + position·(r − q) + velocity·(ṙ − q̇) + ahead·ṙ + ahead²·r̈ + integral·∫(r − q) dt
GAINS = {
    "position": (-1.0, 10.0),
    "velocity": (-0.2, 0.5),
    "ahead": (0.0, 0.3),
    "ahead_squared": (0.0, 0.02),
    "integral": (0.0, 40.0),
}
LIMIT = 1.5  # rad: what can be commanded
WINDUP = 0.2  # rad·s: what the integral is held to


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


@one_thread()
def record(drive: Drive, references: References, gains: np.ndarray) -> DriveLog:
    """Log a drive from rest while controllers with these `gains` [N, 5], as GAINS names them, follow the references."""
    position, velocity, ahead, ahead_squared, integral = gains.T
    command, q, v, torque, miss = np.empty((5, *references.position.shape))
    total = np.zeros(len(drive))
    for k in range(command.shape[1]):
        r, rate, acceleration = (x[:, k] for x in (references.position, references.velocity, references.acceleration))
        q[:, k], v[:, k] = drive.measured.T
        error = r - q[:, k]
        total = np.clip(total + drive.cfg.sample_time * error, -WINDUP, WINDUP)
        feedback = position * error + velocity * (rate - v[:, k]) + integral * total
        command[:, k] = np.clip(r + feedback + ahead * rate + ahead_squared * acceleration, -LIMIT, LIMIT)
        miss[:, k] = r - drive.true[:, 0]
        torque[:, k] = drive.step(command[:, k])
    return DriveLog(command, q, v, torque, miss, drive.load_torque)
