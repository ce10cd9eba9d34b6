"""The benchmark of diagnosis."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("gapbench")
