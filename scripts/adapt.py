"""Adapt to recorded real pictures without pairs, or go on with it. Keys: configs/adapt/rl_cyclegan.yaml."""

from vision_s2r import pipeline
from vision_s2r.cli import main
from vision_s2r.config import Config


def adapt(cfg: Config) -> None:
    """The adaptation of the first seed, in OUT/adapt-SEED."""
    released = pipeline.adapt(cfg, cfg.seed)
    print(released.policy, *([released.translator] if released.translator else []), sep="\n")


if __name__ == "__main__":
    main(adapt, Config)
