"""The terms of the translator's loss. Each is a mean over samples, so that processes can average their gradients."""

from collections.abc import Callable
from typing import Any

import torch
from kornia.metrics import ssim
from torch import Tensor
from torch.nn import functional as F

from vision_s2r.networks import rectification as rectifier
from vision_s2r.scene import CLASSES
from vision_s2r.translate.config import LossConfig

Maps = dict[str, Tensor]
SSIM_WINDOW = 7  # pixels
OBJECT = CLASSES.index("object")


def image(output: Maps, target: Maps, weight: Tensor) -> Tensor:
    """Absolute error of the canonical picture."""
    return (weight * (output["canonical"] - target["canonical"]).abs()).mean()


def gradient(output: Maps, target: Maps, weight: Tensor) -> Tensor:
    """Absolute error of the differences between neighbours: what a blurred edge pays for, and a shifted one.

    (Mathieu et al. 2016, arXiv:1511.05440, with both signs kept.)
    """
    error = output["canonical"] - target["canonical"]
    across = weight[..., 1:] * error.diff(dim=-1).abs()
    down = weight[..., 1:, :] * error.diff(dim=-2).abs()
    return across.mean() + down.mean()


def structure(output: Maps, target: Maps, weight: Tensor) -> Tensor:
    """1 - SSIM (Wang et al. 2004)."""
    return 1 - ssim(output["canonical"], target["canonical"], SSIM_WINDOW).mean()


def segmentation(output: Maps, target: Maps, weight: Tensor) -> Tensor:
    """Cross-entropy of the classes."""
    return F.cross_entropy(output["segmentation"], target["segmentation"])


def depth(output: Maps, target: Maps, weight: Tensor) -> Tensor:
    """Absolute error of the depth, in parts of its range."""
    return (weight * (output["depth"] - target["depth"]).abs()).mean()


def rectification(output: Maps, target: Maps, weight: Tensor) -> Tensor:
    """Absolute error of where the picture is sampled, in tenths of half its side."""
    return rectifier.loss(output["displacements"], target["displacements"])


TERMS: dict[str, Callable[[Maps, Maps, Tensor], Tensor]] = {
    "image": image,
    "gradient": gradient,
    "ssim": structure,
    "segmentation": segmentation,
    "depth": depth,
    "rectification": rectification,
}


def supervised(cfg: LossConfig, output: Maps, target: Maps) -> Maps:
    """The terms that compare with the target, without their weights; only those that have one.

    `output`: canonical [B, 3, H, W], and where they have a weight segmentation logits [B, C, H, W] and depth
    [B, 1, H, W] in parts of its range. `target`: the same, segmentation as class ids int64 [B, H, W].
    """
    weight = weights(cfg, target)
    wanted = {name: term for name, term in TERMS.items() if getattr(cfg, name) > 0}
    if "displacements" not in target:
        wanted.pop("rectification", None)
    return {name: term(output, target, weight) for name, term in wanted.items()}


def perceptual(made: list[Tensor], true: list[Tensor]) -> Tensor:
    """Absolute difference of a frozen network's activations, each layer alike (Johnson et al. 2016, arXiv:1603.08155).

    `made`, `true`: its layers' activations on the translated and the true canonical pictures.
    """
    return torch.stack([F.l1_loss(ours, theirs) for ours, theirs in zip(made, true, strict=True)]).mean()


def weights(cfg: LossConfig, target: Maps) -> Tensor:
    """How much each pixel counts [B, 1, H, W]: objects more."""
    return 1 + cfg.focus * (target["segmentation"] == OBJECT).unsqueeze(1).to(torch.float32)


def adversarial(form: str, fake: Tensor) -> Tensor:
    """What the translator pays for scores `fake` of its pictures."""
    return -fake.mean() if form == "hinge" else (fake - 1).square().mean()


def discrimination(form: str, real: Tensor, fake: Tensor) -> Tensor:
    """What the discriminator pays: hinge (Lim and Ye 2017, arXiv:1705.02894), or least squares (Mao et al. 2017)."""
    if form == "hinge":
        return F.relu(1 - real).mean() + F.relu(1 + fake).mean()
    return (real - 1).square().mean() + fake.square().mean()


def weighted(cfg: LossConfig, terms: Maps) -> Tensor:
    """The sum of the terms, each times its weight."""
    total: Any = sum(getattr(cfg, name) * term for name, term in terms.items())
    return total
