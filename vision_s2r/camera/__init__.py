"""The real camera: clean pictures in, what a real camera would have made of them out.

`Camera(images, camera.sample(...))`: the fifteen effects of a camera, batched, each with parameters per
sample, in the order in which light meets them. The sampled parameters are data, and replay to the same
picture. An effect is a class in a file of `camera/effects`.
"""

from vision_s2r.camera import effects as _effects  # noqa: F401  (fills the registry)
from vision_s2r.camera.camera import Camera
from vision_s2r.camera.config import CameraConfig, load_config
from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect
from vision_s2r.camera.parameters import CameraParameters

__all__ = ["CAMERA_EFFECTS", "Camera", "CameraConfig", "CameraEffect", "CameraParameters", "load_config"]
