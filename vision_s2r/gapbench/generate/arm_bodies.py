"""Arms that the benchmark draws: chains of rods, and arms of two to seven joints from URDFs that PyBullet ships."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pybullet_data

RADIUS = 0.03  # m, of rods
BALL = 0.005  # m, of what the tip touches with
SWING = 0.9  # rad, to either side of home that an arm is asked to go


@dataclass(frozen=True)
class ArmBodies:
    """Rigid bodies, and which of their joints are driven."""

    name: str
    urdf: str
    joints: tuple[str, ...]  # the driven ones, from the base on; all others are fixed at 0
    home: tuple[float, ...]  # rad, where the driven ones begin
    tip: str  # the link that the last of them moves
    reach: tuple[tuple[float, float], ...]  # m, in the tip's frame: x, y and z of what it may carry


# The files of PyBullet's data that are arms: a Kuka LBR iiwa, a Franka Panda with its hand, a UFactory xArm 6.
_FLANGE = ((-0.05, 0.05), (-0.05, 0.05), (0.05, 0.2))
_IIWA, _PANDA, _XARM = "kuka_iiwa/model.urdf", "franka_panda/panda.urdf", "xarm/xarm6_robot.urdf"


@dataclass(frozen=True)
class _Shipped:
    file: str
    joints: tuple[str, ...]


def _numbered(pattern: str, numbers: Sequence[int]) -> tuple[str, ...]:
    return tuple(pattern.format(number) for number in numbers)


_SHIPPED = {
    "xarm6_two": _Shipped(_XARM, _numbered("joint{}", (2, 3))),
    "iiwa_three": _Shipped(_IIWA, _numbered("lbr_iiwa_joint_{}", (2, 4, 6))),
    "panda_four": _Shipped(_PANDA, _numbered("panda_joint{}", (1, 2, 4, 6))),
    "xarm6_five": _Shipped(_XARM, _numbered("joint{}", range(1, 6))),
    "xarm6": _Shipped(_XARM, _numbered("joint{}", range(1, 7))),
    "iiwa": _Shipped(_IIWA, _numbered("lbr_iiwa_joint_{}", range(1, 8))),
    "panda": _Shipped(_PANDA, _numbered("panda_joint{}", range(1, 8))),
}
SHIPPED = tuple(_SHIPPED)


@cache
def shipped(name: str) -> ArmBodies:
    """One of `SHIPPED`, begun in the middle of its joints' ranges where these have ends."""
    chosen = _SHIPPED[name]
    text = (Path(pybullet_data.getDataPath()) / chosen.file).read_text(encoding="utf-8")
    root = ElementTree.fromstring(text)
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    home = tuple(_middle(joints[each]) for each in chosen.joints)
    tip = joints[chosen.joints[-1]].find("child")
    assert tip is not None
    return ArmBodies(name, text, chosen.joints, home, str(tip.get("link")), _FLANGE)


def _middle(joint: ElementTree.Element) -> float:
    limit = joint.find("limit")
    if limit is None or joint.get("type") == "continuous":
        return 0.0
    low, high = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
    return 0.0 if low < -SWING and high > SWING else (low + high) / 2


def chain(rng: np.random.Generator) -> ArmBodies:
    """Two or three links of rod on a stand."""
    count = int(rng.integers(2, 4))
    lengths = rng.uniform(0.15, 0.3, count)
    masses = rng.uniform(0.2, 0.6, count) * np.linspace(1.3, 0.7, count)
    axes = ("y", *rng.choice(["y", "y", "z"], count - 1))
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    parts = ['<robot name="chain">', f'<link name="stand"><inertial><mass value="1"/>{inertia}</inertial></link>']
    parent, at = "stand", "0 0 0"
    for k in range(count):
        length, mass = float(lengths[k]), float(masses[k])
        across, along = mass * (3 * RADIUS**2 + length**2) / 12, mass * RADIUS**2 / 2
        parts += [
            f'<link name="link{k}"><inertial><origin xyz="{length / 2!r} 0 0"/><mass value="{mass!r}"/>',
            f'<inertia ixx="{along!r}" iyy="{across!r}" izz="{across!r}" ixy="0" ixz="0" iyz="0"/></inertial></link>',
            f'<joint name="joint{k}" type="continuous"><parent link="{parent}"/><child link="link{k}"/>',
            f'<origin xyz="{at}"/><axis xyz="{"0 1 0" if axes[k] == "y" else "0 0 1"}"/></joint>',
        ]
        parent, at = f"link{k}", f"{length!r} 0 0"
    reach = ((float(lengths[-1] / 2), float(lengths[-1])), (0.0, 0.0), (0.0, 0.0))
    names = _numbered("joint{}", range(count))
    return ArmBodies("chain", "\n".join([*parts, "</robot>"]) + "\n", names, (0.0,) * count, parent, reach)


def simulated(arm: ArmBodies, payload: Sequence[float] | None, touches: bool = False) -> str:
    """The arm as URDF for Bullet: what is not driven is fixed, what is drawn or touched is left out.

    payload   its mass (kg), and where it is on the tip (m)
    touches   whether its tip is a ball that is felt

    A tensor that no body can have (its largest part over the sum of the others) is that of the mean of its parts: what
    MuJoCo's `balanceinertia` does, where Bullet would take the link for a point. What has no mass has no inertia.
    """
    root = ElementTree.fromstring(arm.urdf)
    for joint in root.findall("joint"):
        if joint.get("name") not in arm.joints:
            joint.set("type", "fixed")
        for limit in joint.findall("limit"):  # far away, but the engine spends time on them
            joint.remove(limit)
        if joint.get("type") == "revolute":
            joint.set("type", "continuous")
    for link in root.findall("link"):
        for kind in ("visual", "collision"):
            for each in link.findall(kind):
                link.remove(each)
        for inertial in link.findall("inertial"):
            weightless = all(float(mass.get("value", 0)) == 0 for mass in inertial.findall("mass"))
            for tensor in inertial.findall("inertia"):
                _balance(tensor, weightless)
    if payload is not None:
        mass, *place = payload
        at = " ".join(map(repr, place))
        root.extend(
            ElementTree.fromstring(
                f'<a><link name="carried"><inertial><mass value="{mass!r}"/><inertia ixx="1e-9" iyy="1e-9" izz="1e-9" '
                'ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="carries" type="fixed">'
                f'<parent link="{arm.tip}"/><child link="carried"/><origin xyz="{at}"/></joint></a>'
            )
        )
    if touches:
        tip = next(link for link in root.findall("link") if link.get("name") == arm.tip)
        tip.append(ElementTree.fromstring(f'<collision><geometry><sphere radius="{BALL}"/></geometry></collision>'))
    return ElementTree.tostring(root, encoding="unicode")


def _balance(tensor: ElementTree.Element, weightless: bool) -> None:
    xx, xy, xz, yy, yz, zz = (float(tensor.get(key, 0)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    parts = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if weightless or parts[0] <= 0 or parts[2] > parts[0] + parts[1]:
        mean = 0.0 if weightless else float(parts.mean())
        for key in ("ixx", "iyy", "izz"):
            tensor.set(key, repr(mean))
        for key in ("ixy", "ixz", "iyz"):
            tensor.set(key, "0")
