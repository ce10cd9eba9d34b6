"""The methods that the transfer table compares: a file each, which registers `train(cfg, inputs, out, seed)`.

for name, train in METHODS.select(["rcan", "cyclegan"], "methods").items():
    released = train(cfg, inputs, out / name, seed)
"""

from vision_s2r.methods import conditional_gan, cyclegan, domain_randomization, graspgan, rcan, rl_cyclegan
from vision_s2r.methods.registry import METHODS, MethodInputs, Released, Train

__all__ = [
    "METHODS",
    "MethodInputs",
    "Released",
    "Train",
    "conditional_gan",
    "cyclegan",
    "domain_randomization",
    "graspgan",
    "rcan",
    "rl_cyclegan",
]

METHODS.load_installed()
