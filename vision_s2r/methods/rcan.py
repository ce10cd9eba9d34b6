"""RCAN: the translator, learnt from pairs (James et al. 2019, arXiv:1812.07252); key `translate`."""

from pathlib import Path

from vision_s2r.config import Config
from vision_s2r.methods.registry import METHODS, MethodInputs, Released
from vision_s2r.pipeline import frozen_q
from vision_s2r.translate import train_translator


@METHODS.register("rcan")
def train(cfg: Config, inputs: MethodInputs, out: Path, seed: int) -> Released:
    """The translator, before the canonical policy."""
    return {"rcan": train_translator(cfg.translate, inputs.pairs, out, seed, frozen_q(cfg.translate))}
