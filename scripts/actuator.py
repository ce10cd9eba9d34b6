"""An actuator network in the motor's place, and controllers that transfer because of it: `out=DIR [actuator=small]`."""

from vision_s2r.actuator.config import ActuatorConfig
from vision_s2r.actuator.run import run
from vision_s2r.cli import main

if __name__ == "__main__":
    main(lambda cfg: print(f"picture: {run(cfg)}"), ActuatorConfig, "actuator")
