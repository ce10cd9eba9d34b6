"""Benchmarks, side by side: `benchmark.py render|translate|grasp|joint|contact|control [KEY=VALUE …]`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("benchmark")
