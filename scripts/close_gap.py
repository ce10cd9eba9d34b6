"""Diagnose a camera, train the translator under the diagnosis, measure what it won: `recording=DIR`."""

from vision_s2r.cli import main
from vision_s2r.close_gap.loop import close_gap
from vision_s2r.config import Config

if __name__ == "__main__":
    main(lambda cfg: print(f"summary: {close_gap(cfg)}"), Config)
