"""OpenCV: a calibration file, as `cv2.FileStorage` reads it."""

import cv2
import numpy as np

from vision_s2r.patch.effect import CAMERA_PATCHES
from vision_s2r.recording import CameraRecording
from vision_s2r.report.reading import Diagnosed, values


def calibration(named: Diagnosed, recording: CameraRecording) -> str:
    """YAML with image_width, image_height, camera_matrix, distortion_coefficients (k1, k2, p1, p2, k3).

    With the camera's pose diagnosed, also `rotation_vector` (rad, OpenCV's axes): a ray s of the simulator's camera
    appears along R·s.
    """
    height, width = recording.sim.shape[1:3]
    storage = cv2.FileStorage("opencv.yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("image_width", width)
    storage.write("image_height", height)
    intrinsics = recording.intrinsics
    if intrinsics is None:
        from vision_s2r.camera.camera import default_intrinsics  # imports torch

        storage.writeComment("the recording has no camera: a focal length of 1.1 widths was assumed", False)
        intrinsics = default_intrinsics(height, width)
    fx, fy, cx, cy = intrinsics
    storage.write("camera_matrix", np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]))
    entries = {"distortion_coefficients": np.zeros((1, 5))}
    for name, given in values(named).items():
        if name in CAMERA_PATCHES:
            entries |= CAMERA_PATCHES[name].opencv(given)
    for key, entry in entries.items():
        storage.write(key, entry)
    return storage.releaseAndGetString()
