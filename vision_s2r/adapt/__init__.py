"""Adaptation without pairs: CycleGAN, GraspGAN-like and RL-CycleGAN between canonical and real pictures.

In: rendered views with labelled grasps, pictures that real cameras recorded of other scenes (`render.Recorded`), a
canonical policy. Out: a translator from real to canonical pictures, which `vision_s2r.translate.Translator` loads,
and a policy that grasps from real pictures, which `vision_s2r.grasp.GraspPolicy` loads.
"""

from vision_s2r.adapt.config import AdaptConfig
from vision_s2r.adapt.train import Adapted, train_adapted

__all__ = ["AdaptConfig", "Adapted", "train_adapted"]
