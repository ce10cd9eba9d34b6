"""The rigid bodies of an arm, from MJCF or URDF. Meshes may be missing: only masses and joints matter here."""

import logging
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import mujoco

from vision_s2r.errors import UserError, nearest

CARRIED = "vision_s2r_payload"  # the body that the payload is
WEIGHTLESS = 1e-9  # kg, of a payload that is none
TURNING = {int(mujoco.mjtJoint.mjJNT_HINGE): "rotary", int(mujoco.mjtJoint.mjJNT_SLIDE): "linear"}
LARGEST = 1 << 24  # bytes
log = logging.getLogger(__name__)
if mujoco.get_mju_user_warning() is None:  # then it writes MUJOCO_LOG.TXT into whatever folder one works in
    mujoco.set_mju_user_warning(log.warning)


@dataclass(frozen=True)
class ModelJoint:
    """A hinge or slide of a model, with what the model says of its drive; SI units."""

    name: str
    units: str  # rotary | linear
    low: float  # of the position; -inf where it has no limit
    high: float
    drive: dict[str, float]  # of the keys that a recording may give, those that the model has


class ArmModel:
    """A compiled model, whose `spec` can be edited and written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.spec = _spec(path)
        model = _compiled(self.spec, path)
        joints = (model.joint(k) for k in range(model.njnt))
        self.joints = {joint.name: _joint(model, joint.id) for joint in joints if model.jnt_type[joint.id] in TURNING}

    def places(self) -> list[str]:
        """Bodies and sites, of which one may be the tip."""
        return [each.name for each in (*self.spec.bodies, *self.spec.sites) if each.name]

    def body_of(self, tip: str | None, joints: list[str]) -> str:
        """The last body: that of the tip, or the one that the last of the joints moves."""
        if tip is None:
            return str(self.spec.joint(joints[-1]).parent.name)
        site = self.spec.site(tip)
        return tip if site is None else str(site.parent.name)

    def check_joint(self, name: str, where: str) -> ModelJoint:
        """The joint of this name. Raises UserError, which begins with `where`, where the model has none."""
        if name not in self.joints:
            raise UserError(f"{where}: no joint '{name}' in {self.path.name}, {nearest(name, self.joints)}")
        return self.joints[name]


def opened(path: Path) -> ArmModel:
    """The model of a file, read once as long as it stays as it is. Its `spec` is to be copied, not changed."""
    return _opened(path, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=8)
def _opened(path: Path, _: int) -> ArmModel:
    return ArmModel(path)


def one_line(error: Exception) -> str:
    """MuJoCo's words."""
    return " ".join(str(error).removeprefix("Error: ").split())


def _spec(path: Path) -> mujoco.MjSpec:
    """The model as it is written, without meshes and what is drawn with them."""
    if not path.is_file():
        raise UserError(f"{path}: no such file, expected an MJCF or URDF model")
    if path.stat().st_size > LARGEST:
        raise UserError(f"{path}: of {path.stat().st_size} bytes, expected an MJCF or URDF model")
    try:
        path.read_text(encoding="utf-8")  # or its names cannot be read once it is loaded
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise UserError(f"{path}: does not load in MuJoCo: {one_line(error)}") from error
    return spec


def _compiled(spec: mujoco.MjSpec, path: Path) -> mujoco.MjModel:
    """The model; without meshes, and what is drawn, where one of their files is missing."""
    try:
        return _balanced(spec, path)
    except ValueError as error:
        if "opening file" not in str(error) and "not found" not in str(error):
            raise UserError(f"{path}: does not load in MuJoCo: {one_line(error)}") from error
    for geom in list(spec.geoms):
        if geom.meshname or geom.hfieldname:
            spec.delete(geom)
    for kind in ("meshes", "textures", "materials", "hfields", "skins"):
        for each in list(getattr(spec, kind)):
            spec.delete(each)
    for each in (*spec.geoms, *spec.sites):
        each.material = ""
    try:
        return _balanced(spec, path)
    except ValueError as error:
        raise UserError(f"{path}: without its missing meshes, MuJoCo says: {one_line(error)}") from error


def _balanced(spec: mujoco.MjSpec, path: Path) -> mujoco.MjModel:
    """The model; where a tensor of inertia is that of no body, as in vendors' URDFs, with the mean of its parts."""
    try:
        return spec.compile()
    except ValueError as error:
        if "balanceinertia" not in str(error):
            raise
        log.warning("%s: a tensor of inertia can be of no body, MuJoCo balances it: %s", path, one_line(error))
    spec.compiler.balanceinertia = True
    return spec.compile()


def _joint(model: mujoco.MjModel, index: int) -> ModelJoint:
    limited = bool(model.jnt_limited[index])
    low, high = model.jnt_range[index] if limited else (-math.inf, math.inf)
    dof = model.jnt_dofadr[index]
    drive = {
        "armature": float(model.dof_armature[dof]),
        "viscous_damping": float(model.dof_damping[dof]),
        "coulomb_friction": float(model.dof_frictionloss[dof]),
    }
    drive |= _motor(model, index)
    weakest, strongest = model.jnt_actfrcrange[index]  # a URDF's effort
    if model.jnt_actfrclimited[index] and strongest == -weakest > 0:
        drive["torque_limit"] = min(float(strongest), drive.get("torque_limit", math.inf))
    return ModelJoint(model.joint(index).name, TURNING[int(model.jnt_type[index])], float(low), float(high), drive)


def _motor(model: mujoco.MjModel, joint: int) -> dict[str, float]:
    """The gains and the limit of the model's own position servo of this joint; nothing where it has none."""
    for k in range(model.nu):
        if model.actuator_trntype[k] != mujoco.mjtTrn.mjTRN_JOINT or model.actuator_trnid[k, 0] != joint:
            continue
        gain, bias = model.actuator_gainprm[k, 0], model.actuator_biasprm[k]
        found = {}
        if bias[1] != 0:
            found = {"proportional_gain": float(gain), "derivative_gain": 0.0 - float(bias[2])}
        low, high = model.actuator_forcerange[k]
        return found | ({"torque_limit": float(high)} if model.actuator_forcelimited[k] and high == -low else {})
    return {}
