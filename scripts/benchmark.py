"""Benchmarks, side by side: `benchmark.py render|translate|grasp|joint|contact|control [KEY=VALUE …]`."""

from vision_s2r.benchmarks import BENCHMARKS
from vision_s2r.cli import choose

if __name__ == "__main__":
    choose("benchmark", BENCHMARKS)
