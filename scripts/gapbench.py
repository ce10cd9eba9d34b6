"""The sealed benchmark of diagnosis. Keys: configs/gapbench.yaml."""

from vision_s2r.cli import main
from vision_s2r.gapbench.bench import bench
from vision_s2r.gapbench.config import GapbenchConfig

if __name__ == "__main__":
    main(bench, GapbenchConfig, "gapbench")
