"""How a lens that bends lines is written for OpenCV."""

import numpy as np

from vision_s2r.patch.effect import CAMERA_PATCHES, CameraPatch

CAMERA_PATCHES.register(
    "lens_distortion",
    CameraPatch(
        opencv=lambda given: {"distortion_coefficients": np.array([[given["k1"], given["k2"], 0.0, 0.0, 0.0]])},
    ),
)
