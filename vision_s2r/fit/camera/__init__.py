"""The diagnosis of cameras: pairs of pictures in, a case for the search out.

`CameraCase` predicts the real pictures from the simulator's through the effects of `vision_s2r.camera`, as a mean and a
noise that depends on brightness, and scores the prediction pixel by pixel.
"""

from vision_s2r.fit.camera.case import CameraCase

__all__ = ["CameraCase"]
