"""A grasp, simulated: descend on guard, close with limited force, lift, and look whether something is held."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vision_s2r.bullet import pybullet
from vision_s2r.scene import arm
from vision_s2r.scene.config import SceneConfig
from vision_s2r.scene.drives import LIFT, Drives, Tuning
from vision_s2r.scene.machine import NEUTRAL, Machine
from vision_s2r.scene.state import SceneState
from vision_s2r.scene.world import World

CLEARANCE = 0.015  # m between the finger tips and the highest object when the descent starts
DESCENT_SPEED = 0.5  # m/s
LIFT_SPEED = 0.6
GUARD_FORCE = 3.0  # N on the fingers that ends the descent
CLOSING_SPEED = 0.25
CLOSING_TIME = 0.35  # s
HOLD_TIME = 0.15
EMPTY_OPENING = 0.001  # m: closed further than this, nothing is between the fingers
LEFT, RIGHT = 4, 5


@dataclass(frozen=True)
class Outcome:
    """What became of a grasp: the index of the object held (-1: none), and why it failed ('' if held)."""

    held: int
    reason: str

    @property
    def success(self) -> bool:
        """An object is held in both fingers after the lift."""
        return self.held >= 0


UNTUNED = Tuning()


def attempt(
    cfg: SceneConfig,
    state: SceneState,
    grasp: np.ndarray,
    machine: Machine = NEUTRAL,
    tuning: Tuning = UNTUNED,
) -> Outcome:
    """Try the grasp (x, y, yaw) [3] in the scene, on a robot that has the drives and the contact of a machine.

    `tuning` is what its controller knows of the drives. A pure function: its own world, made and thrown away.
    """
    with World(cfg, machine.contact) as world:
        for object_id, pose in zip(state.object_ids, state.object_poses, strict=True):
            world.add_object(object_id, pose)
        waiting = np.array(state.arm_joints[:4])
        drives = Drives(machine.drives, cfg.physics.time_step, waiting) if machine.drives or tuning else None
        return _Gripper(world, grasp, drives, tuning, waiting).run()


class _Gripper:
    """The arm in a world, holding its (x, y, yaw) while lift and fingers move."""

    def __init__(
        self, world: World, grasp: np.ndarray, drives: Drives | None, tuning: Tuning, waiting: np.ndarray
    ) -> None:
        self.world = world
        self.client = world.client
        self.dt = world.cfg.physics.time_step
        self.start = world.top() + CLEARANCE
        self.height = self.start  # commanded
        self.drives = drives
        joints = arm.inverse(float(grasp[0]), float(grasp[1]), self.start, float(grasp[2]))
        self.goal = np.array(joints[:4])
        self.wait, self.raised = 0, 0.0  # time steps after a stroke, and m that the lift is commanded higher
        if drives:
            correction, over, self.wait = tuning.correction(waiting, self.goal, self.dt)
            self.goal = self.goal + correction
            drives.approach(self.goal, over)
            self.raised = float(correction[LIFT])
            joints = (*(self.goal + drives.displaced).tolist(), *joints[4:])
        self.body = _load(world)
        for joint, value in enumerate(joints):
            pybullet.resetJointState(self.body, joint, value, physicsClientId=self.client)
        self._drive([0, 1, 3], [joints[i] for i in (0, 1, 3)], 500.0)
        self._drive([LEFT, RIGHT], [arm.MAX_OPENING] * 2, world.cfg.physics.squeeze_force)

    def run(self) -> Outcome:
        """The whole attempt."""
        bottom = self._descend()
        if not self._close(bottom):
            return Outcome(-1, "empty")
        return self._lift(bottom)

    def _descend(self) -> float:
        """Go down until something pushes back or the floor is near; returns the height that is held."""
        floor = self.world.cfg.physics.floor_clearance
        heights = [self.start]
        while heights[-1] > floor:
            heights.append(max(heights[-1] - DESCENT_SPEED * self.dt, floor))
        held = heights[-1]
        for height in self._moved(heights[1:], 200.0):
            if self._force() > GUARD_FORCE:
                held = height + 0.002
                break
        for _ in self._moved([held] * (6 + self.wait), 200.0):
            pass
        return held

    def _close(self, height: float) -> bool:
        """Close with limited force; False if the fingers met each other."""
        force = self.world.cfg.physics.squeeze_force
        slow = 0
        steps = round(CLOSING_TIME / self.dt)
        targets = [max(arm.MAX_OPENING - CLOSING_SPEED * k * self.dt, -0.003) for k in range(steps)]
        for k, _ in enumerate(self._moved([height] * steps, 200.0, targets)):
            left, right = self._finger(LEFT), self._finger(RIGHT)
            if left[0] + right[0] < 2 * EMPTY_OPENING:
                return False
            slow = slow + 1 if abs(left[1] + right[1]) < 0.004 and k > 12 else 0
            if slow >= 8:
                break
        self._drive([LEFT, RIGHT], [-0.01, -0.01], force)
        return True

    def _lift(self, bottom: float) -> Outcome:
        physics = self.world.cfg.physics
        before = self.world.poses()[:, 2]
        heights = [bottom]
        while heights[-1] < bottom + physics.lift_height:
            heights.append(heights[-1] + LIFT_SPEED * self.dt)
        for _ in self._moved(heights[1:], 300.0):
            if self._finger(LEFT)[0] + self._finger(RIGHT)[0] < 2 * EMPTY_OPENING:
                return Outcome(-1, "slipped")
        for _ in self._moved([heights[-1]] * (round(HOLD_TIME / self.dt) + self.wait), 300.0):
            pass
        risen = self.world.poses()[:, 2] - before
        for k in np.flatnonzero(risen > 0.7 * physics.lift_height):
            if self._touches(LEFT, int(k)) and self._touches(RIGHT, int(k)):
                return Outcome(int(k), "")
        return Outcome(-1, "dropped")

    def _moved(self, heights: list[float], force: float, fingers: list[float] | None = None) -> Iterator[float]:
        """Command each of these heights, and finger positions, for a time step; yields the height after it.

        Whoever stops listening stops the motion there: drives know of no more commands than were given.
        """
        commands = np.tile(self.goal, (len(heights), 1))
        commands[:, LIFT] = np.array(heights) + self.raised
        displaced = self.drives.plan(commands) if self.drives else None
        given = 0
        try:
            for k, height in enumerate(heights):
                if displaced is not None:
                    joints = commands[k] + displaced[k]
                    self._drive([0, 1, 3], joints[[0, 1, 3]].tolist(), 500.0)
                    self._drive([LIFT], [float(joints[LIFT])], force)
                elif height != self.height:
                    self._drive([LIFT], [height], force)
                self.height = height
                if fingers is not None:
                    self._drive([LEFT, RIGHT], [fingers[k]] * 2, self.world.cfg.physics.squeeze_force)
                given += 1
                self.world.step()
                yield height
        finally:
            if self.drives:
                self.drives.commit(commands[:given])

    def _drive(self, joints: list[int], targets: list[float], force: float) -> None:
        pybullet.setJointMotorControlArray(
            self.body,
            joints,
            pybullet.POSITION_CONTROL,
            targetPositions=targets,
            forces=[force] * len(joints),
            positionGains=[0.5] * len(joints),
            physicsClientId=self.client,
        )

    def _finger(self, joint: int) -> tuple[float, float]:
        position, velocity, *_ = pybullet.getJointState(self.body, joint, physicsClientId=self.client)
        return position, velocity

    def _force(self) -> float:
        """Upward push on the gripper, N."""
        contacts = pybullet.getContactPoints(self.body, physicsClientId=self.client)
        return sum(c[9] * abs(c[7][2]) for c in contacts)

    def _touches(self, joint: int, which: int) -> bool:
        body = self.world.objects[which]
        return bool(pybullet.getContactPoints(self.body, body, joint, physicsClientId=self.client))


def _load(world: World) -> int:
    """The arm as one multibody: links of `arm.py`, of which palm and fingers can touch."""
    client = world.client

    def shape(size: tuple[float, float, float], centre: tuple[float, float, float]) -> int:
        half = [s / 2 for s in size]
        return pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=half, collisionFramePosition=centre, physicsClientId=client
        )

    finger_z = arm.FINGER_SIZE[2] / 2
    shapes = [-1, -1, -1, shape(arm.PALM_SIZE, (0, 0, arm.FINGER_SIZE[2] + arm.PALM_SIZE[2] / 2))]
    shapes += [shape(arm.FINGER_SIZE, (s * arm.FINGER_SIZE[0] / 2, 0, finger_z)) for s in (1, -1)]
    turn, slide = pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC
    z, x, flipped = [0, 0, 1], [1, 0, 0], [-1, 0, 0]
    body = pybullet.createMultiBody(
        baseMass=0,
        basePosition=[*arm.BASE, 0.0],
        linkMasses=[2.0, 1.5, 0.4, 0.4, 0.08, 0.08],
        linkCollisionShapeIndices=shapes,
        linkVisualShapeIndices=[-1] * 6,
        linkPositions=[
            [0, 0, 0],
            [arm.UPPER_ARM, 0, 0],
            [arm.FOREARM, 0, 0],
            [0, 0, 0],
            [0, 0, 0],
            [0, 0, 0],
        ],
        linkOrientations=[[0, 0, 0, 1]] * 6,
        linkInertialFramePositions=[[0, 0, 0]] * 6,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 6,
        linkParentIndices=[0, 1, 2, 3, 4, 4],
        linkJointTypes=[turn, turn, slide, turn, slide, slide],
        linkJointAxis=[z, z, z, z, x, flipped],
        physicsClientId=client,
    )
    for joint in range(6):
        pybullet.changeDynamics(body, joint, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client)
    for joint in (LEFT, RIGHT):
        friction = world.cfg.physics.finger_friction
        pybullet.changeDynamics(body, joint, lateralFriction=friction, physicsClientId=client)
        if world.bouncy:
            pybullet.changeDynamics(body, joint, restitution=1.0, physicsClientId=client)
    gear = pybullet.createConstraint(
        body, LEFT, body, RIGHT, pybullet.JOINT_GEAR, x, [0, 0, 0], [0, 0, 0], physicsClientId=client
    )
    pybullet.changeConstraint(gear, gearRatio=-1, maxForce=200, erp=0.3, physicsClientId=client)
    return body
