"""The diagnosis of joints: a log in, a case for the search out.

`JointCase` predicts a recording through the machines of `vision_s2r.joint`, led by a leaky observer, and scores the
prediction sample by sample.
"""

from vision_s2r.fit.joint.case import JointCase

__all__ = ["JointCase"]
