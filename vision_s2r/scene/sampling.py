"""From (seed, index) to a settled scene state, whatever was drawn before."""

from dataclasses import replace
from enum import IntEnum

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.randomize import Range
from vision_s2r.scene import arm, objects, tray
from vision_s2r.scene.config import SceneConfig, ViewpointConfig
from vision_s2r.scene.state import Pinhole, SceneState
from vision_s2r.scene.world import World

ATTEMPTS = 20
CHECK_EVERY = 24  # steps between two looks at whether all lies still
LOOK_AT = 0.028  # m, y: towards the arm, so that the waiting gripper is in the picture
STILL = (0.004, 0.08)  # m/s, rad/s


class Stream(IntEnum):
    """What a generator is for: separate streams keep one choice from shifting another."""

    STATE = 0
    RANDOMIZED = 1
    REAL = 2
    GRASPS = 3
    TURNED = 4


def generator(seed: int, index: int, stream: Stream, *more: int) -> np.random.Generator:
    """The random numbers of one purpose of one scene."""
    return np.random.default_rng([seed, index, int(stream), *more])


def sample_state(cfg: SceneConfig, seed: int, index: int) -> SceneState:
    """The scene of (seed, index): objects dropped into the bin and settled, arm at home, camera placed.

    Scenes in which something fell out or would not come to rest are drawn again, from the same generator.
    """
    ids = objects.object_ids(cfg.objects.split)
    rng = generator(seed, index, Stream.STATE)
    for _ in range(ATTEMPTS):
        chosen = rng.choice(len(ids), size=Range(*cfg.objects.count).integer(rng), replace=False)
        object_ids = tuple(ids[i] for i in chosen)
        poses = _settle(cfg, object_ids, rng)
        if poses is not None:
            return SceneState(
                seed=seed,
                index=index,
                object_ids=object_ids,
                object_poses=tuple(tuple(float(v) for v in pose) for pose in poses),
                arm_joints=_home(rng),
                camera=_scene_camera(cfg.viewpoint, rng),
            )
    raise RuntimeError(f"no settled scene for seed {seed}, index {index} in {ATTEMPTS} attempts")


def turned(cfg: SceneConfig, settled: SceneState, index: int) -> SceneState:
    """A settled scene a number of quarter turns on, under the number `index`, with an arm pose and a camera of its own.

    The bin is square, so it is as good a scene as the one that was settled, and most of a scene's time is its settling.
    """
    rng = generator(settled.seed, index, Stream.TURNED)
    turn = Rotation.from_euler("z", np.pi / 2 * index)
    poses = [
        (*turn.apply(pose[:3]).tolist(), *(turn * Rotation.from_quat(pose[3:])).as_quat().tolist())
        for pose in settled.object_poses
    ]
    return replace(
        settled,
        index=index,
        object_poses=tuple(poses),
        arm_joints=_home(rng),
        camera=_scene_camera(cfg.viewpoint, rng),
    )


def _settle(cfg: SceneConfig, object_ids: tuple[int, ...], rng: np.random.Generator) -> np.ndarray | None:
    """Drop the objects one above the other; their poses [K, 7] once still, None if that never comes."""
    half = tray.INNER / 2
    with World(cfg) as world:
        for k, object_id in enumerate(object_ids):
            x, y = rng.uniform(-0.6 * half, 0.6 * half, size=2)
            quaternion = Rotation.random(random_state=rng).as_quat()
            world.add_object(object_id, [x, y, 0.06 + 0.05 * k, *quaternion])
        for _ in range(round(cfg.physics.settle_time / cfg.physics.time_step / CHECK_EVERY)):
            world.step(CHECK_EVERY)
            if (world.speeds() < STILL).all():
                poses = world.poses()
                inside = (np.abs(poses[:, :2]) < half).all() and (poses[:, 2] > -0.01).all()
                return poses if inside and (poses[:, 2] < 0.1).all() else None
    return None


def _home(rng: np.random.Generator) -> tuple[float, ...]:
    """The arm waiting at the bin's back wall, at the edge of the picture."""
    x, y = rng.uniform(-0.08, 0.08), rng.uniform(0.14, 0.16)
    z, yaw = rng.uniform(0.06, 0.075), rng.uniform(-0.4, 0.4)
    return arm.inverse(x, y, z, yaw, opening=rng.uniform(0.6, 1.0) * arm.MAX_OPENING)


def nominal_camera(cfg: ViewpointConfig) -> Pinhole:
    """The camera as it is meant to be: looking down on the bin, tilted towards the arm. Canonical views are its."""
    place = [0.0, LOOK_AT - cfg.height * np.tan(cfg.tilt), cfg.height]
    return _camera(cfg.field_of_view, place, _nominal_rotation(cfg))


def _scene_camera(cfg: ViewpointConfig, rng: np.random.Generator) -> Pinhole:
    """A scene's own: the nominal one, displaced, turned and zoomed a little."""
    turned = Rotation.from_rotvec(rng.uniform(-1, 1, size=3) * cfg.angle_jitter) * _nominal_rotation(cfg)
    place = np.array(nominal_camera(cfg).position) + rng.uniform(-1, 1, size=3) * cfg.position_jitter
    field_of_view = cfg.field_of_view * (1 + rng.uniform(-1, 1) * cfg.field_of_view_jitter)
    return _camera(field_of_view, place.tolist(), turned)


def _nominal_rotation(cfg: ViewpointConfig) -> Rotation:
    down = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]])
    return Rotation.from_euler("x", -cfg.tilt) * down


def _camera(field_of_view: float, place: list[float], rotation: Rotation) -> Pinhole:
    x, y, z = (float(v) for v in place)
    return Pinhole(float(field_of_view), (x, y, z), tuple(map(tuple, rotation.as_matrix().tolist())))
