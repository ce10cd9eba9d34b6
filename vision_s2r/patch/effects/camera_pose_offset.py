"""How a camera's pose is written for OpenCV: a ray s of the simulator's camera appears along R·s."""

import numpy as np

from vision_s2r.patch.effect import CAMERA_PATCHES, CameraPatch

CAMERA_PATCHES.register(
    "camera_pose_offset",
    CameraPatch(
        opencv=lambda given: {"rotation_vector": np.array([[given[key]] for key in ("pitch", "yaw", "roll")])},
    ),
)
