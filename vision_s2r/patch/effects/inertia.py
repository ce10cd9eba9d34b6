"""How inertia is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, Given, JointPatch


def armature(given: Given, nominal: Given) -> dict[str, float]:
    """What is added to the inertia; a rotor's cannot be negative."""
    more = given["value"] - nominal["inertia"]
    return {"armature": more} if more > 0 else {}


JOINT_PATCHES.register(
    "inertia",
    JointPatch(
        words="change the inertia about the joint by {change}, to {value} in all",
        mujoco_joint=armature,
        mujoco_note="armature is what the diagnosis adds to the inertia; add it to an armature that is there",
    ),
)
