"""Where the gap of a recording lies, which effect causes it, how far it shrinks: `recording=DIR out=DIR`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("diagnose")
