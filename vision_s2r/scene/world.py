"""The physics: a fresh world per use, so that what happens in it depends on its inputs alone.

A world that has lived remembers (contact caches, solver warm starts): the same grasp then differs in the last
bits, and at times in its outcome. Making a world anew takes 10 ms and buys labels that are a pure function of
their inputs.
"""

from collections.abc import Sequence
from types import TracebackType

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.bullet import pybullet
from vision_s2r.scene import objects, tray
from vision_s2r.scene.config import SceneConfig
from vision_s2r.scene.machine import Values

# Of changeDynamics, for effects of one value.
ENGINE = {"restitution": "restitution", "rolling_friction": "rollingFriction", "spinning_friction": "spinningFriction"}


class World:
    """A PyBullet world with the bin, on its own connection; use as a context manager."""

    def __init__(self, cfg: SceneConfig, contact: Values | None = None) -> None:
        """`contact`: effects that objects have with the fingers, and of the tilted bin."""
        self.cfg = cfg
        self._contact = contact or {}
        self.client = pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=cfg.physics.time_step,
            numSolverIterations=cfg.physics.solver_iterations,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        pybullet.setGravity(*self._gravity(), physicsClientId=self.client)
        for part in tray.PARTS:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=[s / 2 for s in part.size], physicsClientId=self.client
            )
            body = pybullet.createMultiBody(0, shape, -1, part.position, physicsClientId=self.client)
            pybullet.changeDynamics(body, -1, lateralFriction=0.8, physicsClientId=self.client)
            if self.bouncy:
                pybullet.changeDynamics(body, -1, restitution=1.0, physicsClientId=self.client)
        self.objects: list[int] = []

    def add_object(self, object_id: int, pose: Sequence[float]) -> int:
        """Put an object at a pose (x, y, z, qx, qy, qz, qw); returns its place in `self.objects`."""
        physics = self.cfg.physics
        body = pybullet.loadURDF(
            str(objects.urdf(object_id)),
            pose[:3],
            pose[3:],
            globalScaling=self.cfg.objects.scale / objects.URDF_SCALE,
            physicsClientId=self.client,
        )
        pybullet.changeDynamics(
            body,
            -1,
            mass=physics.object_mass,
            lateralFriction=physics.object_friction,
            spinningFriction=0.002,
            rollingFriction=0.0002,
            physicsClientId=self.client,
        )
        for dynamics in self._changed():
            pybullet.changeDynamics(body, -1, **dynamics, physicsClientId=self.client)
        self.objects.append(body)
        return len(self.objects) - 1

    @property
    def bouncy(self) -> bool:
        """Whether a restitution is given: the engine multiplies those of two bodies, of which one is then 1."""
        return "restitution" in self._contact

    def _changed(self) -> list[dict[str, float]]:
        """What an object has of its contact with the fingers, as arguments of changeDynamics."""
        finger, changed = self.cfg.physics.finger_friction, []
        for name, values in self._contact.items():
            if name == "lateral_friction":  # the engine multiplies those of two bodies
                changed.append({"lateralFriction": values["value"] / finger if finger else 0.0})
            elif name == "contact_compliance":
                changed.append({"contactStiffness": values["stiffness"], "contactDamping": values["damping"]})
            elif name in ENGINE:
                changed.append({ENGINE[name]: values["value"]})
        return changed

    def _gravity(self) -> tuple[float, float, float]:
        """In the bin's frame, m/s²."""
        if "support_tilt" not in self._contact:
            return 0.0, 0.0, -9.81
        tilt = self._contact["support_tilt"]
        x, y, z = Rotation.from_euler("xy", (tilt["roll"], tilt["pitch"])).inv().apply((0.0, 0.0, -9.81))
        return float(x), float(y), float(z)

    def step(self, count: int = 1) -> None:
        """Advance by `count` time steps."""
        for _ in range(count):
            pybullet.stepSimulation(physicsClientId=self.client)

    def poses(self) -> np.ndarray:
        """Poses [K, 7] of the objects."""
        found = [pybullet.getBasePositionAndOrientation(b, physicsClientId=self.client) for b in self.objects]
        return np.array([[*position, *orientation] for position, orientation in found]).reshape(-1, 7)

    def speeds(self) -> np.ndarray:
        """Linear (m/s) and angular (rad/s) speed [K, 2] of the objects."""
        found = [pybullet.getBaseVelocity(b, physicsClientId=self.client) for b in self.objects]
        return np.array([[np.linalg.norm(v), np.linalg.norm(w)] for v, w in found]).reshape(-1, 2)

    def top(self) -> float:
        """Height of the highest point of the bin and the objects, m."""
        boxes = [pybullet.getAABB(body, physicsClientId=self.client) for body in self.objects]
        return max([tray.HEIGHT, *(high[2] for _, high in boxes)])

    def __enter__(self) -> "World":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pybullet.disconnect(physicsClientId=self.client)
