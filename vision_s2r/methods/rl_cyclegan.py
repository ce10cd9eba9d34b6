"""RL-CycleGAN: a CycleGAN that Q agrees with (Rao et al. 2020, arXiv:2006.09001); key `adapt`."""

from pathlib import Path

from vision_s2r.config import Config
from vision_s2r.methods.registry import METHODS, MethodInputs, Released
from vision_s2r.methods.unpaired import adapted


@METHODS.register("rl_cyclegan")
def train(cfg: Config, inputs: MethodInputs, out: Path, seed: int) -> Released:
    """Its translator and its policy."""
    return adapted("rl_cyclegan", cfg.adapt, cfg, inputs, out, seed)
