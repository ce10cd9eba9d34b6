"""How a diagnosed effect is written for other simulators: one record an effect, each in a file of `patch/effects`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vision_s2r.effects import Records

Given = Mapping[str, float]  # an effect's parameters by name, SI units


@dataclass(frozen=True, kw_only=True)
class JointPatch:
    """Of a joint effect. What a format's field leaves out, the format has no attribute for: `words` are written then.

    `words` may hold {parameter} of each parameter, {length} and {torque} (units); of a nominal parameter also {change}
    (from its nominal value) and {opposite} (its negative).
    """

    words: str
    urdf: str = ""  # the attribute of <dynamics> that is its value
    mujoco_joint: Callable[[Given, Given], dict[str, float]] | None = None  # (given, nominal) -> attributes of <joint>
    mujoco_note: str = ""  # what to know of these
    # (given, torque constant) -> attributes of <general>, whose force is gainprm·ctrl + biasprm
    mujoco_motor: Callable[[Given, float], dict[str, float | str]] | None = None
    bullet: Callable[[Given], dict[str, dict[str, Any]]] | None = None  # arguments by function of PyBullet


@dataclass(frozen=True, kw_only=True)
class CameraPatch:
    """Of a camera effect that is geometry: what a calibration file of OpenCV says of it, by key."""

    opencv: Callable[[Given], dict[str, np.ndarray]]


@dataclass(frozen=True, kw_only=True)
class ContactPatch:
    """Of a contact effect. Functions take its parameters and the nominal body (mass, gravity and coefficients)."""

    bullet: Callable[[Given, Given], dict[str, dict[str, Any]]]  # arguments by function of PyBullet
    urdf: Mapping[str, str] = field(default_factory=dict)  # by parameter: the element of <contact> that it is
    urdf_link: Callable[[Given, Given], str] | None = None  # what stands beside <contact> in <link>
    mujoco_friction: int | None = None  # its place in a geom's friction: sliding, spinning, rolling
    mujoco_solref: Callable[[Given, Given], tuple[float, float]] | None = None
    mujoco_model: Callable[[Given, Given], str] | None = None  # what stands beside the body in <mujoco>


JOINT_PATCHES: Records[JointPatch] = Records("joint", "patches")
CONTACT_PATCHES: Records[ContactPatch] = Records("contact", "patches")
CAMERA_PATCHES: Records[CameraPatch] = Records("camera", "patches")
