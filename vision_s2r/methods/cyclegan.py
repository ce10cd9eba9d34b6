"""CycleGAN between canonical and real pictures (Zhu et al. 2017, arXiv:1703.10593); key `cyclegan`."""

from pathlib import Path

from vision_s2r.config import Config
from vision_s2r.methods.registry import METHODS, MethodInputs, Released
from vision_s2r.methods.unpaired import adapted


@METHODS.register("cyclegan")
def train(cfg: Config, inputs: MethodInputs, out: Path, seed: int) -> Released:
    """Its translator and its policy."""
    return adapted("cyclegan", cfg.cyclegan, cfg, inputs, out, seed)
