"""The analytic model of the motor: its controller's torque at once, less friction."""

import numpy as np

from vision_s2r.actuator.config import DriveConfig
from vision_s2r.actuator.drive import LOAD
from vision_s2r.actuator.log import DriveLog


def analytic_torque(cfg: DriveConfig, log: DriveLog) -> np.ndarray:
    """Delivered torques [N, T] (N·m) of a rigid drive without delay that is in the logged state.

    Motor and load share the acceleration that the motor's torque (at most its limit), its friction and the payload
    leave, so that the load is handed its share of the first two and carries the motor's share of the payload. It is
    what a drive without effects delivers; the paper's ideal actuator, which is spared inertia and friction.
    """
    motor = np.clip(cfg.stiffness * log.error - cfg.damping * log.velocity, -cfg.torque_limit, cfg.torque_limit)
    friction = cfg.viscous_damping * log.velocity + cfg.coulomb_friction * np.sign(log.velocity)
    return LOAD * (motor - friction) - (1 - LOAD) * log.payload[:, None]
