"""Benchmarks, side by side in one run: `python scripts/benchmark.py render [KEY=VALUE …]`."""

import sys

from vision_s2r.cli import compose, or_exit
from vision_s2r.config import Config
from vision_s2r.errors import UserError, nearest
from vision_s2r.render import benchmark as render_benchmark


def render(cfg: Config) -> None:
    """Pairs a second against the engine's limit and the usual loop; memory over 20,000 renders."""
    render_benchmark.run(cfg.scene, cfg.render.size, cfg.render.margin, cfg.seed)


BENCHMARKS = {"render": render}


def run(arguments: list[str]) -> None:
    """Run the benchmark named first, with the overrides that follow."""
    if not arguments or arguments[0] not in BENCHMARKS:
        raise UserError(f"benchmark '{' '.join(arguments[:1])}': {nearest(' '.join(arguments[:1]), BENCHMARKS)}")
    BENCHMARKS[arguments[0]](compose(Config, overrides=arguments[1:]))


if __name__ == "__main__":
    or_exit(lambda: run(sys.argv[1:]))
