"""Another recording through the simulator before and after a diagnosis: `recording=DIR report=FILE out=DIR`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("replay")
