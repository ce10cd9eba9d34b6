"""Where to try grasps for training: at random, at random on an object, and by a scripted scorer.

The scorer reads the objects' shapes and poses from the scene state; it never sees a picture.
"""

from enum import IntEnum

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.scene import arm, objects, tray
from vision_s2r.scene.config import SceneConfig
from vision_s2r.scene.sampling import Stream, generator
from vision_s2r.scene.state import SceneState

CANDIDATES = 256  # a scene, among which the scorer chooses
REACH = tray.INNER / 2 - 0.01  # m: how far from the middle a grasp may aim


class Origin(IntEnum):
    """How a grasp was proposed."""

    RANDOM = 0
    ON_OBJECT = 1
    SCRIPTED = 2


def propose(cfg: SceneConfig, state: SceneState, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Grasps [count, 3] = (x, y, yaw) and their origins [count] for one scene, the same for the same scene.

    One in six is random in the bin, two are random on an object, three are scripted.
    """
    rng = generator(state.seed, state.index, Stream.GRASPS)
    pattern = [
        Origin.SCRIPTED,
        Origin.ON_OBJECT,
        Origin.SCRIPTED,
        Origin.ON_OBJECT,
        Origin.SCRIPTED,
        Origin.RANDOM,
    ]
    origins = np.array([pattern[k % len(pattern)] for k in range(count)])
    points = surface_points(cfg, state)
    grasps = np.empty((count, 3))
    for origin in Origin:
        wanted = int((origins == origin).sum())
        if origin is Origin.RANDOM:
            found = _random(rng, wanted)
        elif origin is Origin.ON_OBJECT:
            found = _on_object(rng, points, wanted)
        else:
            found = scripted(rng, points, wanted)
        grasps[origins == origin] = found
    return grasps, origins


def surface_points(cfg: SceneConfig, state: SceneState) -> list[np.ndarray]:
    """Vertices and triangle middles [N, 3] of each object, in the world."""
    found = []
    for object_id, pose in zip(state.object_ids, state.object_poses, strict=True):
        vertices, faces = objects.vertices_and_faces(object_id)
        local = np.concatenate([vertices, vertices[faces].mean(axis=1)]) * cfg.objects.scale
        found.append(Rotation.from_quat(pose[3:]).apply(local) + pose[:3])
    return found


def scripted(rng: np.random.Generator, points: list[np.ndarray], count: int) -> np.ndarray:
    """The best of many candidate grasps on objects: `count` of them [count, 3], drawn by softmax of their score."""
    candidates = _on_object(rng, points, CANDIDATES, spread=0.3)
    logits = np.array([score(points, grasp) for grasp in candidates]) + rng.gumbel(size=CANDIDATES)
    return candidates[np.argsort(-logits)[:count]]


def score(points: list[np.ndarray], grasp: np.ndarray) -> float:
    """How promising a grasp is, from the shapes alone; higher is better.

    Between the open fingers there should be much of one object, high enough to hold, centred and narrow; under the
    fingers, nothing.
    """
    everything = np.concatenate(points)
    offset = everything[:, :2] - grasp[:2]
    cosine, sine = np.cos(grasp[2]), np.sin(grasp[2])
    along = offset @ [cosine, sine]
    across = offset @ [-sine, cosine]
    height = everything[:, 2]
    slab = np.abs(across) < arm.FINGER_SIZE[1] / 2 + 0.003
    between = slab & (np.abs(along) < arm.MAX_OPENING)
    if between.sum() < 3:
        return -20.0
    outer = arm.MAX_OPENING + arm.FINGER_SIZE[0]
    under = slab & (np.abs(along) >= arm.MAX_OPENING) & (np.abs(along) < outer + 0.003)
    blocked = height[under].max(initial=0.0)
    left, right = along[between].min(), along[between].max()
    grip = max(height[between].max() - blocked, 0.0)
    whose = [(np.abs(p[:, :2] - grasp[:2]).max(axis=1) < 0.02).sum() for p in points]
    middle = points[int(np.argmax(whose))].mean(axis=0)[:2]
    off_centre = float(np.linalg.norm(middle - grasp[:2]))
    return 120 * min(grip, 0.04) - 40 * abs(left + right) / 2 - 25 * (right - left) - 60 * off_centre


def _random(rng: np.random.Generator, count: int) -> np.ndarray:
    yaw = rng.uniform(-np.pi / 2, np.pi / 2, size=count)
    return np.column_stack([rng.uniform(-REACH, REACH, size=(count, 2)), yaw])


def _on_object(rng: np.random.Generator, points: list[np.ndarray], count: int, spread: float = 0.6) -> np.ndarray:
    """Aimed at a random object: from its middle towards a random point of its surface, by up to `spread`."""
    grasps = _random(rng, count)
    for k, which in enumerate(rng.integers(len(points), size=count)):
        cloud = points[which]
        middle = cloud.mean(axis=0)
        goal = middle + rng.uniform(0, spread) * (cloud[rng.integers(len(cloud))] - middle)
        grasps[k, :2] = np.clip(goal[:2], -REACH, REACH)
    return grasps
