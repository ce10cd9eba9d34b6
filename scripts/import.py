"""Logs of other projects become recordings: `source=sage path=DIR out=DIR`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("import")
