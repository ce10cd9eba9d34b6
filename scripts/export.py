"""Trained networks for other programs: `translator checkpoint=bin-64 out=DIR`, `policy checkpoint=bin-64-student`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("export")
