"""MuJoCo's own functions for rigid bodies, as compiled code calls them: nothing waits for Python between two steps."""

from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import mujoco
import numba
import numpy as np
from numba import types

from vision_s2r.joint.compiled import compiled

_LIBRARY = next(Path(mujoco.__file__).parent.glob("libmujoco.*"))
llvmlite.binding.load_library_permanently(str(_LIBRARY))  # by name, so that numba can keep what calls it


def _of_mujoco(name: str, *more: Any) -> Any:
    """A function of the library that takes the addresses of a model and of its data first."""
    return types.ExternalFunction(name, types.void(types.intp, types.intp, *more))


_mj_kinematics, _mj_com_pos, _mj_crb, _mj_com_vel = map(
    _of_mujoco, ("mj_kinematics", "mj_comPos", "mj_crb", "mj_comVel")
)
_mj_rne = _of_mujoco("mj_rne", types.int32, types.intp)
_mj_full_m = _of_mujoco("mj_fullM", types.intp)


class Rigid(NamedTuple):
    """Bodies of which J joints move; addresses and views of a model and its data, which somebody else keeps."""

    model: int
    data: int
    positions: np.ndarray  # of all joints, as MuJoCo has them
    velocities: np.ndarray
    at: np.ndarray  # [J] where these joints' positions are
    degree: np.ndarray  # [J] and their velocities
    stiffness: np.ndarray  # [J] N·m/rad (N/m) of the model's own springs at these joints
    untwisted: np.ndarray  # [J] rad (m) at which these do nothing
    mass: np.ndarray  # [V, V] of all degrees of freedom: scratch
    bias: np.ndarray  # [V]


@compiled
def terms(bodies: Rigid, position: np.ndarray, velocity: np.ndarray, mass: np.ndarray, bias: np.ndarray) -> None:
    """M [J, J] (kg·m²) without rotors, and c + g [J] (N·m), at positions and velocities [J], into `mass` and `bias`.

    What the model's own springs pull is part of g.
    """
    joints = len(position)
    for j in range(joints):
        bodies.positions[bodies.at[j]] = position[j]
        bodies.velocities[bodies.degree[j]] = velocity[j]
    model, data = bodies.model, bodies.data
    _mj_kinematics(model, data)
    _mj_com_pos(model, data)
    _mj_crb(model, data)
    _mj_com_vel(model, data)
    _mj_rne(model, data, np.int32(0), bodies.bias.ctypes.data)
    _mj_full_m(model, data, bodies.mass.ctypes.data)
    for j in range(joints):
        bias[j] = bodies.bias[bodies.degree[j]] + bodies.stiffness[j] * (position[j] - bodies.untwisted[j])
        for k in range(joints):
            mass[j, k] = bodies.mass[bodies.degree[j], bodies.degree[k]]


@numba.njit(nogil=True, error_model="numpy", cache=True)
def evaluate(bodies: Rigid, position: np.ndarray, velocity: np.ndarray, mass: np.ndarray, bias: np.ndarray) -> None:
    """`terms`, for Python."""
    terms(bodies, position, velocity, mass, bias)


@numba.njit(nogil=True, error_model="numpy", cache=True)
def along(
    bodies: Rigid,
    motion: tuple[np.ndarray, np.ndarray, np.ndarray],
    torque: np.ndarray,
    inertia: np.ndarray,
) -> None:
    """The torque −(Σ M_jk·q̈_k + c_j + g_j) over k ≠ j, and M_jj, along positions, velocities, accelerations [N, J]."""
    position, velocity, acceleration = motion
    joints = position.shape[1]
    mass, bias = np.empty((joints, joints)), np.empty(joints)
    for row in range(len(position)):
        terms(bodies, position[row], velocity[row], mass, bias)
        for j in range(joints):
            inertia[row, j] = mass[j, j]
            torque[row, j] = mass[j, j] * acceleration[row, j] - bias[j]
            for k in range(joints):
                torque[row, j] -= mass[j, k] * acceleration[row, k]
