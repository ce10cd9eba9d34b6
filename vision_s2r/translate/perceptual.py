"""Frozen networks that say how alike a translated and the true canonical picture are: the policy's Q, and VGG-16."""

import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

import torch
from torch import Tensor, nn

from vision_s2r.errors import UserError
from vision_s2r.lazy import import_torchvision

VGG_WEIGHTS = "vgg16-397923af.pth"  # as torchvision names them
VGG_LAYERS = (3, 8, 15)  # relu1_2, relu2_2, relu3_3 (Johnson et al. 2016)
MEAN, SPREAD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of ImageNet's pictures, by channel


class QFeatures(Protocol):
    """A frozen policy, as `vision_s2r.grasp.FrozenQ`; cameras and grasps as there."""

    size: int  # side of its pictures, px

    def grasps(self, count: int, generator: torch.Generator) -> Tensor:
        """Random grasps [count, K, 3] on the CPU."""

    def activations(self, pictures: Tensor, intrinsics: Tensor, extrinsics: Tensor, grasps: Tensor) -> list[Tensor]:
        """What Q makes of the pictures at the grasps, layer by layer."""

    def logits(self, pictures: Tensor, intrinsics: Tensor, extrinsics: Tensor, grasps: Tensor) -> Tensor:
        """Logits [B, K] of the chance that each grasp succeeds."""

    def measure(self, translated: Tensor, true: Tensor, success: Tensor) -> dict[str, float]:
        """Metrics of logits in translated and true pictures [N, K] and labels [N, K]."""


def scores(frozen_q: QFeatures, translated: Tensor, target: Mapping[str, Tensor]) -> Tensor:
    """[B, K, 3]: logits of the labelled grasps in the translated and the true canonical pictures, and the labels."""
    where = target["intrinsics"], target["extrinsics"], target["grasps"]
    logits = [frozen_q.logits(pictures, *where) for pictures in (translated, target["canonical"])]
    return torch.stack([*logits, target["success"]], -1)


class Vgg:
    """The first layers of VGG-16 (Simonyan and Zisserman 2015, arXiv:1409.1556), trained on ImageNet, frozen.

    Nothing is downloaded: raises UserError unless torchvision's weights lie in torch's hub cache.
    """

    def __init__(self) -> None:
        path = Path(torch.hub.get_dir()) / "checkpoints" / VGG_WEIGHTS
        if not path.is_file():
            raise UserError(f"translate.loss.vgg is above 0, but {path} is not there: expected torchvision's weights")
        self._layers = nn.Sequential(*list(_vgg_layers())[: VGG_LAYERS[-1] + 1]).eval().requires_grad_(False)
        wanted = self._layers.state_dict().keys()
        try:
            found = torch.load(path, map_location="cpu", weights_only=True)
            self._layers.load_state_dict({name: found[f"features.{name}"] for name in wanted})
        except (RuntimeError, pickle.UnpicklingError, EOFError, KeyError, TypeError) as error:
            raise UserError(f"{path}: these are no weights of VGG-16 ({str(error).splitlines()[0]})") from error

    def __call__(self, pictures: Tensor) -> list[Tensor]:
        """Activations of its layers on pictures float [B, 3, H, W] in [0, 1]."""
        mean, spread = (pictures.new_tensor(values).view(3, 1, 1) for values in (MEAN, SPREAD))
        seen, found = (pictures - mean) / spread, []
        for index, layer in enumerate(self._layers.to(pictures.device).children()):
            seen = layer(seen)
            if index in VGG_LAYERS:
                found.append(seen)
        return found


def _vgg_layers() -> nn.Sequential:
    import_torchvision()  # here alone, as few want it
    from torchvision.models.vgg import cfgs, make_layers

    return make_layers(cfgs["D"])
