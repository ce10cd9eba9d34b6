"""Close, and diagnose, the gap between simulated and real robots that see.

    report = vision_s2r.diagnose(vision_s2r.read("DIR"))

Names are imported when they are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from vision_s2r.lazy import load

if TYPE_CHECKING:
    from vision_s2r.camera import Camera
    from vision_s2r.diagnose.config import DiagnoseConfig
    from vision_s2r.diagnose.diagnose import diagnose
    from vision_s2r.errors import UserError
    from vision_s2r.grasp import GraspPolicy
    from vision_s2r.identify import IdentifyConfig
    from vision_s2r.identify.identify import identify
    from vision_s2r.joint import simulate
    from vision_s2r.recording import CameraRecording, ContactRecording, JointRecording, read, write
    from vision_s2r.translate import Translator

__all__ = [
    "Camera",
    "CameraRecording",
    "ContactRecording",
    "DiagnoseConfig",
    "GraspPolicy",
    "IdentifyConfig",
    "JointRecording",
    "Translator",
    "UserError",
    "diagnose",
    "identify",
    "read",
    "simulate",
    "write",
]

_PACKAGES = ("diagnose", "identify")  # packages that can be called
_PLACES = {
    "Camera": "camera",
    "CameraRecording": "recording",
    "ContactRecording": "recording",
    "DiagnoseConfig": "diagnose.config",
    "GraspPolicy": "grasp",
    "IdentifyConfig": "identify.config",
    "JointRecording": "recording",
    "Translator": "translate",
    "UserError": "errors",
    "read": "recording",
    "simulate": "joint",
    "write": "recording",
}


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return import_module(f"vision_s2r.{name}")
    if name in _PLACES:
        return load(f"vision_s2r.{_PLACES[name]}:{name}")
    raise AttributeError(f"module 'vision_s2r' has no attribute '{name}'")


def __dir__() -> list[str]:
    return [*globals(), *__all__]
