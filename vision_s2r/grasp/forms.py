"""From a configuration, or a checkpoint, to its Q-function."""

import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from torch import Tensor, nn

from vision_s2r.errors import UserError
from vision_s2r.grasp.config import GraspConfig, check
from vision_s2r.grasp.crop import CropQ
from vision_s2r.grasp.dense import DenseQ
from vision_s2r.grasp.q_function import QFunction
from vision_s2r.grasp.trunk import TrunkQ
from vision_s2r.networks.rectifier import Rectifier
from vision_s2r.networks.unet import NetworkConfig, UNet
from vision_s2r.training import checkpoint


class Front(nn.Module):
    """A U-Net from pictures to pictures, as a correction of what comes in once the camera's pose is undone.

    It begins as the identity, so that Q has a picture to learn from before the U-Net has anything to add. Out: the
    pictures, and the rectifier's displacements (None where there is none).
    """

    def __init__(self, cfg: NetworkConfig):
        super().__init__()
        self.rectifier = Rectifier(cfg.rectifier, cfg.looks) if cfg.rectifier else None
        self.unet = UNet(replace(cfg, rectifier=0, residual=True), {"picture": 3})

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor | None]:
        displacements = None
        if self.rectifier is not None:
            images, displacements = self.rectifier(images)
        return self.unet(images)["picture"], displacements

    def compile(self, *args: Any, **kwargs: Any) -> None:
        """As of any module, of the U-Net alone: it is most of the work."""
        self.unet.compile(*args, **kwargs)


def build(cfg: GraspConfig) -> QFunction:
    """The Q-function of a checked configuration, with fresh weights."""
    channels = 6 if cfg.with_source else 3
    front = Front(cfg.front) if cfg.front else None
    if cfg.form == "crop":
        return CropQ(channels, cfg.width, cfg.crop, cfg.plane_height, front)
    if cfg.form == "trunk":
        return TrunkQ(channels, cfg.width, cfg.plane_height, front)
    side = 2 * math.hypot(*cfg.area)
    return DenseQ(channels, cfg.width, cfg.dense, side, cfg.plane_height, front)


def load_q(path: str | Path) -> tuple[QFunction, GraspConfig, int]:
    """The Q-function of a released checkpoint, its configuration, and the side of its pictures (px).

    Raises UserError where the file is none.
    """
    found = checkpoint.load(path, "q_function")
    cfg = _configuration(found)
    size = found.normalization.get("size")
    if not isinstance(size, int):
        raise UserError(f"{path}: its header gives no size of pictures: expected a policy's checkpoint")
    q_function = build(cfg)
    found.restore("q_function", q_function)
    return q_function, cfg, size


def load_configuration(path: str | Path) -> GraspConfig:
    """What a released checkpoint's policy is, without building it. Raises UserError where the file is none."""
    return _configuration(checkpoint.load(path, "q_function"))


def _configuration(found: checkpoint.Checkpoint) -> GraspConfig:
    """The policy's part of a checkpoint's configuration, typed and checked."""
    known = {field.name for field in fields(GraspConfig)}
    values = found.configuration
    try:
        merged = OmegaConf.merge(
            OmegaConf.structured(GraspConfig), {name: value for name, value in values.items() if name in known}
        )
        cfg = OmegaConf.to_object(merged)
        assert isinstance(cfg, GraspConfig)
        check(cfg)
    except (OmegaConfBaseException, ArithmeticError, UserError) as error:
        raise UserError(f"{found.path}: its configuration is no policy's ({str(error).splitlines()[0]})") from error
    return cfg
