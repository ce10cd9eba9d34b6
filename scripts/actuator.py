"""An actuator network in the motor's place, and policies that transfer because of it: `out=DIR [actuator=small]`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("actuator")
