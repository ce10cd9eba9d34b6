"""Domain randomization: a policy on randomized pictures themselves (Tobin et al. 2017, arXiv:1703.06907).

Its key is `baseline`.
"""

from pathlib import Path

from vision_s2r.config import Config
from vision_s2r.grasp import train_policy
from vision_s2r.methods.registry import METHODS, MethodInputs, Released


@METHODS.register("domain_randomization")
def train(cfg: Config, inputs: MethodInputs, out: Path, seed: int) -> Released:
    """Its policy, on real pictures as they are."""
    return {"domain_randomization": train_policy(cfg.baseline, inputs.labelled, out, seed)}
