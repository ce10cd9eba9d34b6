"""What rigid bodies ask of the joints of an arm, by MuJoCo: M(q), c(q, q̇) + g(q), and where the tip is."""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from vision_s2r.arm import rigid
from vision_s2r.arm.effect import BASE_TILT, OFFSET, PAYLOAD, tilted
from vision_s2r.arm.model import CARRIED, WEIGHTLESS, ArmModel


class Bodies:
    """The bodies of an arm whose joints in `joints` move, and whose others are held where `hold` says, or at 0."""

    def __init__(
        self,
        model: ArmModel,
        joints: Sequence[str],
        hold: Mapping[str, float],
        tip: str | None = None,
        effects: Mapping[str, Mapping[str, float]] | None = None,
    ) -> None:
        """`effects`: those that change the bodies, by name."""
        effects = effects or {}
        spec = model.spec.copy()
        last = spec.body(model.body_of(tip, list(joints)))
        given = effects.get(PAYLOAD) or {"mass": WEIGHTLESS, "x": 0.0, "y": 0.0, "z": 0.0}
        last.add_body(
            name=CARRIED,
            pos=[given["x"], given["y"], given["z"]],
            mass=max(given["mass"], WEIGHTLESS),
            inertia=[WEIGHTLESS * 1e-3] * 3,
            ipos=[0.0, 0.0, 0.0],
            explicitinertial=True,
        )
        self._model = spec.compile()
        self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        if BASE_TILT in effects:
            self._model.opt.gravity = tilted(self._model.opt.gravity, **effects[BASE_TILT])
        self._data = mujoco.MjData(self._model)
        for name, value in hold.items():
            self._data.qpos[self._model.joint(name).qposadr[0]] = value
        self._model.dof_armature[:] = 0.0  # the rotor's is the drive's
        at = np.array([self._model.joint(name).qposadr[0] for name in joints])
        degree = np.array([self._model.joint(name).dofadr[0] for name in joints])
        shown = np.array([effects.get(f"{name}.{OFFSET}", {"value": 0.0})["value"] for name in joints])
        self._model.qpos0[at] += shown  # bodies are where positions less these put them
        self._model.qpos_spring[at] += shown
        springs = (np.array([self._model.joint(name).stiffness[0] for name in joints]), self._model.qpos_spring[at])
        every = self._model.nv
        views = (self._data.qpos, self._data.qvel, at, degree, *springs, np.zeros((every, every)), np.zeros(every))
        self.rigid = rigid.Rigid(self._model._address, self._data._address, *views)  # of what this object keeps
        self._tip = _tip(self._model, tip)

    def terms(self, position: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """M [J, J] (kg·m²) without rotors, and c + g [J] (N·m), springs included, at positions and velocities [J]."""
        mass, bias = np.empty((len(position), len(position))), np.empty(len(position))
        rigid.evaluate(self.rigid, _plain(position), _plain(velocity), mass, bias)
        return mass, bias

    def loads(
        self, position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Torque [N, J] (N·m) that the rest of the arm puts on each joint, and its own inertia [N, J] (kg·m²).

        Along a motion [N, J] (rad, rad/s, rad/s²). The torque is −(Σ M_jk·q̈_k + c_j + g_j) over k ≠ j.
        """
        torque, inertia = np.empty(position.shape), np.empty(position.shape)
        motion = (_plain(position), _plain(velocity), _plain(acceleration))
        rigid.along(self.rigid, motion, torque, inertia)
        return torque, inertia

    def tip(self, position: np.ndarray) -> np.ndarray | None:
        """Where the tip is [N, 3] (m) at positions [N, J]; None where it is not known what the tip is."""
        if self._tip is None:
            return None
        places = np.empty((len(position), 3))
        for k, q in enumerate(position):
            self._data.qpos[self.rigid.at] = q
            mujoco.mj_kinematics(self._model, self._data)
            places[k] = self._tip_of()
        return places

    def _tip_of(self) -> np.ndarray:
        assert self._tip is not None
        kind, index = self._tip
        return self._data.site_xpos[index] if kind == "site" else self._data.xpos[index]


def _tip(model: mujoco.MjModel, name: str | None) -> tuple[str, int] | None:
    if name is None:
        return None
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    return ("site", site) if site >= 0 else ("body", mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name))


def _plain(values: np.ndarray) -> np.ndarray:
    """Of one type, so that what takes it is compiled once."""
    return np.require(values, np.float64, ("C", "W"))
