"""Actuator networks: in come logs of a drive that is commanded positions, out come networks that stand for its motor.

`MotorDrive` is the drive itself, or with other effects what a simulator takes it for; `record` logs it, `fit` trains an
`ActuatorNetwork` on the logs, and `NetworkDrive` is the simulator with the network in the motor's place. `learn` trains
a policy in any of them. `run.run` does all of it, and tries the policies on the drive.

Hwangbo et al., Learning agile and dynamic motor skills for legged robots, Science Robotics 4(26), 2019.
"""

from vision_s2r.actuator.config import ActuatorConfig
from vision_s2r.actuator.drive import MotorDrive, NetworkDrive
from vision_s2r.actuator.log import DriveLog, record
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.actuator.policy import DrivePolicy, learn
from vision_s2r.actuator.training import fit

__all__ = [
    "ActuatorConfig",
    "ActuatorNetwork",
    "DriveLog",
    "DrivePolicy",
    "MotorDrive",
    "NetworkDrive",
    "fit",
    "learn",
    "record",
]
