"""The grasping scene: (seed, index) in; settled states, grasp outcomes and pictures of any look out."""

from vision_s2r.scene.appearance import CLASSES, canonical, palette, randomized, real
from vision_s2r.scene.config import SceneConfig
from vision_s2r.scene.grasping import Outcome, attempt
from vision_s2r.scene.proposals import Origin, propose
from vision_s2r.scene.renderer import Renderer, View
from vision_s2r.scene.sampling import nominal_camera, sample_state, turned
from vision_s2r.scene.state import Pinhole, SceneState

__all__ = [
    "CLASSES",
    "Origin",
    "Outcome",
    "Pinhole",
    "Renderer",
    "SceneConfig",
    "SceneState",
    "View",
    "attempt",
    "canonical",
    "nominal_camera",
    "palette",
    "propose",
    "randomized",
    "real",
    "sample_state",
    "turned",
]
