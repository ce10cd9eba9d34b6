"""A conditional GAN on pairs: pix2pix's objective (Isola et al. 2017, arXiv:1611.07004) on RCAN's plain network.

Its key is `conditional_gan`. The published network, which is larger, is in `vision_s2r.translate.pix2pix_unet`.
"""

from pathlib import Path

from vision_s2r.config import Config
from vision_s2r.methods.registry import METHODS, MethodInputs, Released
from vision_s2r.pipeline import frozen_q
from vision_s2r.translate import train_translator


@METHODS.register("conditional_gan")
def train(cfg: Config, inputs: MethodInputs, out: Path, seed: int) -> Released:
    """The translator, before the canonical policy."""
    settings = cfg.conditional_gan
    return {"conditional_gan": train_translator(settings, inputs.pairs, out, seed, frozen_q(settings))}
