"""Grasping from pictures: Q(picture, grasp), learnt from simulated attempts and maximized by the cross-entropy method.

In: views with labelled grasps (`vision_s2r.render`). Out: a policy,
`GraspPolicy.load(path).act(canonical, intrinsics, extrinsics, seeds)`: pictures to grasps (x, y, yaw). A policy sees
canonical pictures; by configuration it sees the source picture beside them, or (the baseline of domain
randomization) source pictures alone.
"""

from vision_s2r.grasp.compare import compare_forms
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.grasp.frozen_q import FrozenQ
from vision_s2r.grasp.method import train_policy
from vision_s2r.grasp.policy import GraspPolicy, Grasps

__all__ = ["FrozenQ", "GraspConfig", "GraspPolicy", "Grasps", "compare_forms", "train_policy"]
