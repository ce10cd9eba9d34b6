"""A GAN from canonical to real pictures, after GraspGAN (Bousmalis et al. 2018, arXiv:1709.07857); key `graspgan`."""

from pathlib import Path

from vision_s2r.config import Config
from vision_s2r.methods.registry import METHODS, MethodInputs, Released
from vision_s2r.methods.unpaired import adapted


@METHODS.register("graspgan")
def train(cfg: Config, inputs: MethodInputs, out: Path, seed: int) -> Released:
    """Its policy; there is no way back to canonical pictures."""
    return adapted("graspgan", cfg.graspgan, cfg, inputs, out, seed)
