"""Measured machines: every real log diagnosed, and tried on the others: `path=DIR out=DIR`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("hardware")
