"""Diagnose a camera, train the translator under the diagnosis, measure what it won: `recording=DIR`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("close-gap")
