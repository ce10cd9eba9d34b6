"""All formats of a kind, into one folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vision_s2r.files import write
from vision_s2r.patch import bullet, contact, hydra, mujoco, opencv, urdf
from vision_s2r.patch import effects as _effects  # noqa: F401  (fills the records)
from vision_s2r.patch.effect import CAMERA_PATCHES
from vision_s2r.recording import ArmRecording, ContactRecording, JointRecording, Recording
from vision_s2r.report.reading import diagnosed


def write_patch(report: Mapping[str, Any], recording: Recording, folder: Path) -> list[Path]:
    """Write what a report names into a folder, for the machine of the recording; returns the files.

    Hydra: a configuration with the values, and one whose ranges are their intervals. Joints and contacts: MuJoCo,
    URDF and PyBullet. Arms: the whole model as MJCF. Cameras: OpenCV, where the geometry is concerned; surfaces and
    light of the scene by label. Raises UserError where that cannot be.
    """
    named = diagnosed(report)
    if isinstance(recording, JointRecording):
        files = {
            "joint.yaml": hydra.joint(named, recording, randomize=False),
            "joint_randomized.yaml": hydra.joint(named, recording, randomize=True),
            "mujoco.xml": mujoco.joint(named, recording),
            "urdf.xml": urdf.joint(named, recording),
            "pybullet.json": bullet.joint(named, recording),
        }
    elif isinstance(recording, ContactRecording):
        files = {
            "contact.yaml": contact.hydra(named, recording, randomize=False),
            "contact_randomized.yaml": contact.hydra(named, recording, randomize=True),
            "mujoco.xml": contact.mujoco(named, recording),
            "urdf.xml": contact.urdf(named, recording),
            "pybullet.json": contact.bullet(named, recording),
        }
    elif isinstance(recording, ArmRecording):
        from vision_s2r.patch import arm  # imports MuJoCo

        files = {"patched.xml": arm.mjcf(named, recording), "arm.yaml": arm.hydra(named, recording)}
    else:
        from vision_s2r.patch import appearance  # imports torch

        scene = appearance.of_scene(named)
        named = {name: given for name, given in named.items() if name not in scene}
        files = {
            "camera.yaml": hydra.camera(named, recording, randomize=False),
            "camera_randomized.yaml": hydra.camera(named, recording, randomize=True),
            "overrides.txt": hydra.camera_overrides(named, recording),
        }
        if scene:
            files["appearance.yaml"] = appearance.hydra(scene, recording, randomize=False)
            files["appearance_randomized.yaml"] = appearance.hydra(scene, recording, randomize=True)
        if named.keys() & set(CAMERA_PATCHES):
            files["opencv.yml"] = opencv.calibration(named, recording)
    return [write(folder / name, content) for name, content in files.items()]
