"""What training does to pictures and to the frames they are seen in."""

import math

import torch
from kornia.filters import gaussian_blur2d
from torch import Tensor

from vision_s2r.grasp.config import AugmentationConfig
from vision_s2r.grasp.geometry import mirrored, mirrored_grasps, wrap
from vision_s2r.training import Batch

KERNEL = 5  # px, of the blur
SHARPEST = 0.05  # px, standard deviation at which a Gaussian is a single pixel


def degrade(images: Tensor, cfg: AugmentationConfig, generator: torch.Generator) -> Tensor:
    """Pictures [B, C, H, W] in [0, 1] blurred, tinted and noisy within `cfg`'s bounds, each by its own draw."""
    count, channels = images.shape[:2]

    def draw(*shape: int) -> Tensor:
        return torch.rand(count, *shape, 1, 1, generator=generator).to(images.device)

    if cfg.blur:
        sigma = (cfg.blur * draw()).clamp_min(SHARPEST)[:, 0].expand(-1, 2)
        images = gaussian_blur2d(images, KERNEL, sigma, border_type="replicate")
    gain = 1 + cfg.brightness * (2 * draw(1) - 1) + cfg.colour * (2 * draw(channels) - 1)
    images = images * gain
    if cfg.noise:
        noise = _normal(images, generator)
        images = images + cfg.noise * draw(1) * noise
    return images.clamp(0, 1)


def _normal(images: Tensor, generator: torch.Generator) -> Tensor:
    """N(0, 1) in the shape of the pictures, drawn where they are; on the CPU from the generator itself."""
    if images.device.type == "cpu":
        return torch.randn(images.shape, generator=generator)
    there = torch.Generator(images.device).manual_seed(int(torch.randint(2**62, (1,), generator=generator)))
    return torch.randn(images.shape, generator=there, device=images.device)


def turn(batch: Batch, generator: torch.Generator) -> Batch:
    """The same scenes, cameras and grasps with the world's axes turned about z, each scene by an angle of its own.

    Pictures stay; what a Q-function reads as yaw varies, so it cannot learn that one yaw is like another only once.
    """
    extrinsics, grasps = batch["extrinsics"], batch["grasps"]
    angle = (2 * math.pi * torch.rand(len(grasps), generator=generator)).to(grasps.device)
    cos, sin = torch.cos(angle)[:, None], torch.sin(angle)[:, None]
    x, y, yaw = grasps.unbind(-1)
    turned = torch.stack([cos * x - sin * y, sin * x + cos * y, wrap(yaw + angle[:, None])], -1)
    cos, sin = cos.to(extrinsics), sin.to(extrinsics)
    right, ahead = extrinsics[:, :, 0], extrinsics[:, :, 1]
    columns = [cos * right - sin * ahead, sin * right + cos * ahead, extrinsics[:, :, 2], extrinsics[:, :, 3]]
    return batch | {"extrinsics": torch.stack(columns, -1), "grasps": turned}


def mirror(batch: Batch, generator: torch.Generator) -> Batch:
    """Half of the scenes as a mirror at the plane x = 0 of the world shows them, with cameras and grasps.

    `batch` has images [B, C, H, W], intrinsics, extrinsics and grasps. The light then comes from the other side. Where
    it has the rectifier's `displacements` [B, 2, P, P], they too.
    """
    chosen = (torch.rand(len(batch["images"]), generator=generator) < 0.5).to(batch["images"].device)
    images, intrinsics, extrinsics = mirrored(batch["images"], batch["intrinsics"], batch["extrinsics"])
    grasps = mirrored_grasps(batch["grasps"])
    there = {"images": images, "intrinsics": intrinsics, "extrinsics": extrinsics, "grasps": grasps}
    if "displacements" in batch:
        right, down = batch["displacements"].flip(-1).unbind(1)
        there["displacements"] = torch.stack([-right, down], 1)
    return batch | {
        name: torch.where(chosen.view(-1, *[1] * (value.ndim - 1)), value, batch[name]) for name, value in there.items()
    }
