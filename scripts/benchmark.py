"""Benchmarks, side by side: `python scripts/benchmark.py render|translate|grasp|joint|control [KEY=VALUE …]`."""

from vision_s2r.benchmarks import BENCHMARKS
from vision_s2r.cli import choose

if __name__ == "__main__":
    choose("benchmark", BENCHMARKS)
