"""Tiny rendered scenes, and networks that stand in for trained ones, each with its checkpoint."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from vision_s2r.grasp import GraspConfig, Grasps
from vision_s2r.grasp.forms import build
from vision_s2r.networks.unet import NetworkConfig, UNet
from vision_s2r.render import RenderConfig, render
from vision_s2r.scene import SceneConfig
from vision_s2r.scene.config import AppearanceConfig, ObjectsConfig
from vision_s2r.training import checkpoint
from vision_s2r.training.checkpoint import Checkpoint
from vision_s2r.translate.rcan import normalization

SIZE = 32
APPEARANCE = AppearanceConfig(textures=8, real_textures=8, texture_size=16)
SCENE = SceneConfig(objects=ObjectsConfig(split="test"), appearance=APPEARANCE)


def render_scenes(out: Path, scene: SceneConfig = SCENE, **keys: object) -> Path:
    """Four scenes with everything that an evaluation reads, but for `keys` of RenderConfig."""
    settings = {"scenes": 4, "seed": 5, "size": SIZE, "margin": 4, "views": 1, "real": True, "grasps": 0, "workers": 1}
    return render(scene, RenderConfig(out=str(out), **{**settings, **keys}))


class GreenPolicy:
    """Aims at the middle of the green (objects are, in canonical pictures), `offset` metres to the right of it."""

    def __init__(self, path):
        found = checkpoint.load(path, "q_function")
        self.offset = found.tensors["offset"].item()
        self.cfg, self.size = GraspConfig(picture=found.configuration["picture"]), found.normalization["size"]
        self.asked = 0

    def act(self, canonical, intrinsics, extrinsics, seeds, source=None, mirrored=False):
        assert canonical.dtype == torch.uint8 and canonical.shape[1:] == (SIZE, SIZE, 3)
        assert len(seeds) == len(canonical) and source is None
        self.asked += 1
        actions, q = [], []
        for picture, k, world_to_camera in zip(canonical.numpy(), intrinsics.numpy(), extrinsics.numpy(), strict=True):
            red, green, blue = picture.astype(float).transpose(2, 0, 1)
            greenness = np.maximum(green - np.maximum(red, blue), 0) ** 3
            v, u = np.unravel_index(greenness.argmax(), greenness.shape)
            ray = world_to_camera[:3, :3].T @ [(u - k[2]) / k[0], (v - k[3]) / k[1], 1]
            eye = -world_to_camera[:3, :3].T @ world_to_camera[:3, 3]
            x, y, _ = eye + ray * (0.02 - eye[2]) / ray[2]
            actions.append([np.clip(x + self.offset, -0.11, 0.11), np.clip(y, -0.11, 0.11), 0.3])
            q.append(greenness.max() / 255**3)
        return Grasps(torch.tensor(actions, dtype=torch.float32), torch.tensor(q))

    def score(self, canonical, intrinsics, extrinsics, grasps, source=None):
        """How green the picture is in the half that a grasp is in, left or right."""
        assert canonical.dtype == torch.uint8 and grasps.shape == (len(canonical), grasps.shape[1], 3)
        is_green = (canonical[..., 1].int() - canonical[..., [0, 2]].amax(-1).int() > 20).float()
        left, right = (half.mean((1, 2))[:, None] for half in is_green.split(SIZE // 2, dim=2))
        return torch.where(grasps[..., 0] < 0, left, right)


class MirrorTranslator:
    """The picture in a mirror."""

    size = SIZE

    def __init__(self, path):
        checkpoint.load(path, "translator")

    def __call__(self, images, mirrored=False):
        return images.flip(2)


def save_policy(path: Path, offset: float = 0.0, picture: str = "canonical", size: int = SIZE) -> str:
    tensors = {"offset": torch.tensor([offset])}
    checkpoint.save(path, Checkpoint("q_function", {"picture": picture}, {"size": size}, {"step": 1}, tensors))
    return str(path)


def save_translator(path: Path, **configuration: object) -> str:
    checkpoint.save(path, Checkpoint("translator", configuration, {}, {"step": 1}, {"nothing": torch.zeros(1)}))
    return str(path)


def save_untrained_policy(path: Path, cfg: GraspConfig) -> str:
    """A checkpoint that `GraspPolicy` loads."""
    torch.manual_seed(0)
    tensors = {f"q_function.{name}": value for name, value in build(cfg).state_dict().items()}
    checkpoint.save(path, Checkpoint("q_function", asdict(cfg), {"size": SIZE}, {"step": 0}, tensors))
    return str(path)


def save_untrained_translator(path: Path, cfg: NetworkConfig) -> str:
    """A checkpoint that `Translator` loads."""
    torch.manual_seed(0)
    tensors = {f"unet.{name}": value for name, value in UNet(cfg, {"canonical": 3}).state_dict().items()}
    configuration = {"network": asdict(cfg), "heads": {"canonical": 3}}
    checkpoint.save(path, Checkpoint("translator", configuration, normalization(SIZE, (0.5, 1)), {"step": 0}, tensors))
    return str(path)
