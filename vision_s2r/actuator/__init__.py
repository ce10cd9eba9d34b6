"""Actuator networks: in come logs of a drive that is commanded positions, out come networks that stand for its motor.

`MotorDrive` is the drive itself, with effects of `vision_s2r.joint` or, as the analytic model has it, without; `record`
logs it, `fit` trains an `ActuatorNetwork` on the logs, and `NetworkDrive` is the simulator with the network in the
motor's place. `run.run` does all of it, and tries controllers tuned in either simulator on the drive.

Hwangbo et al., Learning agile and dynamic motor skills for legged robots, Science Robotics 4(26), 2019.
"""

from vision_s2r.actuator.config import ActuatorConfig
from vision_s2r.actuator.drive import MotorDrive, NetworkDrive
from vision_s2r.actuator.log import DriveLog, record
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.actuator.training import fit

__all__ = ["ActuatorConfig", "ActuatorNetwork", "DriveLog", "MotorDrive", "NetworkDrive", "fit", "record"]
