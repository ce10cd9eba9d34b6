"""Controllers of a joint's speed: in come a nominal joint and ranges of effects, out come policies and what they miss.

`SpeedTracking` is the Gymnasium vector environment on the compiled simulator, `train` makes a `Policy` with PPO from
Stable-Baselines3 or from a `Teacher` that is told the machines, `track` runs any controller on any machines, `ceiling`
says what can be reached on them at all. The commands of `vision-s2r control` are built on these.

`gymnasium.make("vision_s2r/SpeedTracking-v0")` is a single joint, for a learner that wants no vectors.
"""

import gymnasium

from vision_s2r.control.environment import SpeedTracking
from vision_s2r.control.machines import AdrRanges, DrawnMachines, Given, Machines
from vision_s2r.control.planner import ceiling
from vision_s2r.control.policy import OpenLoop, Policy
from vision_s2r.control.single import OneJoint
from vision_s2r.control.teacher import Teacher
from vision_s2r.control.tracking import track
from vision_s2r.control.training import train

__all__ = [
    "AdrRanges",
    "DrawnMachines",
    "Given",
    "Machines",
    "OneJoint",
    "OpenLoop",
    "Policy",
    "SpeedTracking",
    "Teacher",
    "ceiling",
    "track",
    "train",
]

gymnasium.register("vision_s2r/SpeedTracking-v0", entry_point="vision_s2r.control.single:OneJoint")
