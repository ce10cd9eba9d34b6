"""What is exported: the networks with what belongs to them before and after, and names for all of it."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from vision_s2r.grasp.forms import load_q
from vision_s2r.grasp.q_function import QFunction
from vision_s2r.scene import CLASSES
from vision_s2r.training import checkpoint
from vision_s2r.translate import Translator


@dataclass(frozen=True)
class Port:
    """An input or an output."""

    name: str
    shape: tuple[str | int, ...]  # sides by name where any number goes
    meaning: str  # with unit and range


@dataclass(frozen=True)
class Graph:
    """A network, and what goes in and comes out; all of it float32."""

    module: nn.Module
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    checkpoint: checkpoint.Checkpoint

    def example(self, seed: int, **sides: int) -> tuple[Tensor, ...]:
        """Inputs of these sizes: pictures at random, a camera that looks down from a metre, grasps near its centre."""
        generator = torch.Generator().manual_seed(seed)
        found = {
            port.name: torch.rand(*(s if isinstance(s, int) else sides[s] for s in port.shape), generator=generator)
            for port in self.inputs
        }
        if "extrinsics" in found:
            batch, size = len(found["images"]), found["images"].shape[-1]
            found["intrinsics"] = torch.tensor([2.0 * size, 2.0 * size, size / 2, size / 2]).repeat(batch, 1)
            found["extrinsics"] = torch.diag(torch.tensor([1.0, -1.0, -1.0, 1.0])).repeat(batch, 1, 1)
            found["extrinsics"][:, 2, 3] = 1.0
            found["grasps"] = 0.2 * found["grasps"] - 0.1
        return tuple(found[port.name] for port in self.inputs)


class _Translating(nn.Module):
    """A translator's outputs in a fixed order."""

    def __init__(self, translator: Translator, names: list[str]):
        super().__init__()
        self.network, self.read, self._names = translator.network, translator.read, names

    def forward(self, images: Tensor) -> tuple[Tensor, ...]:
        found = self.read(self.network(images))
        return tuple(found[name] for name in self._names)


class _Scoring(nn.Module):
    """Chances instead of logits."""

    def __init__(self, q_function: QFunction):
        super().__init__()
        self.q_function = q_function.eval().requires_grad_(False)

    def forward(self, images: Tensor, intrinsics: Tensor, extrinsics: Tensor, grasps: Tensor) -> Tensor:
        logits: Tensor = self.q_function(images, intrinsics, extrinsics, grasps).logits
        return logits.sigmoid()


def translator(path: str) -> Graph:
    """The translator of a released checkpoint. Raises UserError where it is none."""
    loaded = Translator.load(path)
    size = loaded.size
    batch = ("batch", 3, size, size)
    meanings = {
        "canonical": Port("canonical", batch, "the canonical view, RGB in [0, 1]"),
        "segmentation": Port("segmentation", ("batch", len(CLASSES), size, size), f"chances of {', '.join(CLASSES)}"),
        "depth": Port("depth", ("batch", size, size), "m"),
    }
    names = [name for name in meanings if name in loaded.network.heads]
    return Graph(
        _Translating(loaded, names),
        (Port("images", batch, "a picture, RGB in [0, 1]"),),
        tuple(meanings[name] for name in names),
        checkpoint.load(path, "translator"),
    )


def policy(path: str) -> Graph:
    """Q of a released policy; the search for its best grasp stays outside. Raises UserError where it is none."""
    q_function, cfg, size = load_q(path)
    channels = 6 if cfg.with_source else 3
    what = "the canonical view, then the picture it was made from" if cfg.with_source else f"the {cfg.picture} picture"
    return Graph(
        _Scoring(q_function),
        (
            Port("images", ("batch", channels, size, size), f"{what}, RGB in [0, 1]"),
            Port("intrinsics", ("batch", 4), "fx, fy, cx, cy of its camera, px"),
            Port("extrinsics", ("batch", 4, 4), "of its camera, world to camera, m"),
            Port("grasps", ("batch", "grasps", 3), "x, y (m), yaw (rad) in the world"),
        ),
        (Port("chances", ("batch", "grasps"), "that the grasp succeeds, [0, 1]"),),
        checkpoint.load(path, "q_function"),
    )
