"""The camera is mounted, or calibrated, a little askew."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame
from vision_s2r.camera.resample import warp
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class CameraPoseOffset(CameraEffect):
    """A ray s of the simulator's camera appears along R·s, R the rotation vector (pitch, yaw, roll).

    OpenCV's axes: x right, y down, z forward. Differentiable in picture and parameters.
    """

    name = "camera_pose_offset"
    order = 10
    optical = True
    linear_light = False
    parameters = (
        Parameter("yaw", "rad", low=-0.5, high=0.5, neutral=0.0, moderate=0.04),
        Parameter("pitch", "rad", low=-0.5, high=0.5, neutral=0.0, moderate=0.03),
        Parameter("roll", "rad", low=-0.5, high=0.5, neutral=0.0, moderate=0.05),
    )

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        pitch, yaw, roll = values["pitch"], values["yaw"], values["roll"]
        zero = torch.zeros_like(yaw)
        skew = torch.stack([zero, -roll, yaw, roll, zero, -pitch, -yaw, pitch, zero], dim=-1)
        rotation = torch.linalg.matrix_exp(skew.reshape(-1, 3, 3))  # Rodrigues' formula, smooth at zero
        fx, fy, cx, cy = frame.intrinsics[:, :, None, None].unbind(1)
        x, y = frame.pixels()
        x, y = (x - cx) / fx, (y - cy) / fy
        # The real picture's ray is (x, y, 1); the simulator's is what the inverse rotation, Rᵀ, makes of it.
        r = rotation[:, :, :, None, None]
        right = r[:, 0, 0] * x + (r[:, 1, 0] * y + r[:, 2, 0])
        down = r[:, 0, 1] * x + (r[:, 1, 1] * y + r[:, 2, 1])
        forward = (r[:, 0, 2] * x + (r[:, 1, 2] * y + r[:, 2, 2])).clamp(min=1e-3)
        return warp(images, fx * (right / forward) + cx, fy * (down / forward) + cy, frame)
