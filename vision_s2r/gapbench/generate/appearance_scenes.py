"""Tables with solids, cast ray by ray: what is where, how far and which way it faces; or drawn by PyBullet.

Both show the same scenes: a table, a mat on it, boxes and balls, each a label. What they look like is a `Look`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import cv2
import numpy as np

from vision_s2r.bullet import pybullet

Array = np.ndarray
Rng = np.random.Generator

TABLE, MAT, BOX, BALL = range(1, 5)  # labels
SOLIDS = (BOX, BALL)
THING = 9  # label of what the simulator does not know
_FINE = 2  # rays a pixel, along each axis
_NEAR, _FAR = 0.2, 2.0  # m
_MAT = (0.17, 0.13)  # m, half its sides


@dataclass(frozen=True)
class Viewpoint:
    """A camera above the table that looks at its middle; x right, y down, z forward."""

    size: int
    focal: float  # px
    position: Array  # m
    rotation: Array  # [3, 3], world to camera

    @property
    def centre(self) -> float:
        """Of the picture, px."""
        return (self.size - 1) / 2


@dataclass(frozen=True)
class Solid:
    """A box on the table or a ball: place, half its sides (of a ball, its radius thrice), yaw."""

    label: int
    place: Array
    half: Array
    yaw: float


@dataclass(frozen=True)
class Look:
    """Colours of labels (RGB, in the units that a renderer shades in), grain of labels, and the light."""

    colours: Mapping[int, Array]
    towards: Array  # unit vector to the light, world axes
    ambient: float
    grain: Mapping[int, tuple[float, float]] = field(default_factory=dict)  # label -> standard deviation, length (px)


def pinhole(size: int, focal: float, rng: Rng) -> Viewpoint:
    """A camera somewhere above the table."""
    turn, down = rng.uniform(0, 2 * math.pi), rng.uniform(0.75, 1.3)
    away = np.array([math.cos(turn) * math.cos(down), math.sin(turn) * math.cos(down), math.sin(down)])
    position = away * rng.uniform(0.55, 0.7)
    right = np.cross(-away, (0, 0, 1.0))
    right /= np.linalg.norm(right)
    return Viewpoint(size, focal, position, np.stack([right, np.cross(-away, right), -away]))


def solids(rng: Rng) -> list[Solid]:
    """Boxes and balls that stand on the table without touching."""
    found: list[Solid] = []
    for k in range(int(rng.integers(5, 9))):
        for _ in range(40):
            label = SOLIDS[k % 2]
            half = rng.uniform(0.02, 0.05, 3) if label == BOX else np.full(3, rng.uniform(0.025, 0.045))
            place = np.array([*rng.uniform(-0.2, 0.2, 2), half[2]])
            reach = float(np.linalg.norm(half[:2]))
            if apart(place, reach, found):
                found.append(Solid(label, place, half, rng.uniform(0, math.pi)))
                break
    return found


def apart(place: Array, reach: float, others: list[Solid]) -> bool:
    """Whether what reaches so far (m) from its place touches none of the others."""
    return all(np.linalg.norm((place - o.place)[:2]) > reach + np.linalg.norm(o.half[:2]) for o in others)


def unknown_thing(rng: Rng) -> Solid:
    """A box that stands on the table in every scene, and that the simulator lacks."""
    half = rng.uniform(0.025, 0.06, 3)
    return Solid(THING, np.array([*rng.uniform(-0.15, 0.15, 2), half[2]]), half, rng.uniform(0, math.pi))


# -- by rays -----------------------------------------------------------------------------------------------------------


def cast(camera: Viewpoint, things: list[Solid], fine: int = 1) -> tuple[Array, Array, Array]:
    """Labels [h, w], depth [h, w] (m) and normals [h, w, 3] (world), `fine` rays a pixel along each axis."""
    side = camera.size * fine
    at = ((np.arange(side) + 0.5) / fine - 0.5 - camera.centre) / camera.focal
    rays = np.stack([*np.meshgrid(at, at), np.ones((side, side))], -1) @ camera.rotation
    origin = camera.position
    depth = -origin[2] / np.minimum(rays[..., 2], -1e-9)
    ground = origin[:2] + rays[..., :2] * depth[..., None]
    labels = np.where((np.abs(ground) < _MAT).all(-1), MAT, TABLE).astype(np.uint8)
    normals = np.broadcast_to(np.array([0.0, 0.0, 1.0]), rays.shape).copy()
    for thing in things:
        found, facing = _ball(thing, origin, rays) if thing.label == BALL else _box(thing, origin, rays)
        nearer = found < depth
        depth = np.where(nearer, found, depth)
        labels[nearer], normals[nearer] = thing.label, facing[nearer]
    return labels, depth, normals


def _ball(thing: Solid, origin: Array, rays: Array) -> tuple[Array, Array]:
    offset, radius = origin - thing.place, thing.half[0]
    square, half, rest = (rays**2).sum(-1), rays @ offset, offset @ offset - radius**2
    root = half**2 - square * rest
    hit = np.where(root > 0, (-half - np.sqrt(np.maximum(root, 0))) / square, np.inf)
    return hit, (offset + rays * np.where(np.isfinite(hit), hit, 0)[..., None]) / radius


def _box(thing: Solid, origin: Array, rays: Array) -> tuple[Array, Array]:
    c, s = math.cos(thing.yaw), math.sin(thing.yaw)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])  # world to box
    start, along = turn @ (origin - thing.place), rays @ turn.T
    along = np.where(np.abs(along) < 1e-9, 1e-9, along)
    ends = np.stack([(-thing.half - start) / along, (thing.half - start) / along])
    near, far = ends.min(0), ends.max(0)
    axis, entry = near.argmax(-1), near.max(-1)
    facing = np.eye(3)[axis] * -np.sign(along)
    return np.where(entry < far.min(-1), entry, np.inf), facing @ turn


def shaded(camera: Viewpoint, things: list[Solid], look: Look, rng: Rng) -> Array:
    """Linear light [H, W, 3]: colours times Lambert's shading, the mean of several rays a pixel."""
    labels, _, normals = cast(camera, things, _FINE)
    colours = np.zeros((256, 3))
    for label, colour in look.colours.items():
        colours[label] = colour
    shading = look.ambient + (1 - look.ambient) * np.maximum(normals @ look.towards, 0)
    light = colours[labels] * shading[..., None]
    for label, (amplitude, length) in look.grain.items():
        light = light * (1 + amplitude * (labels == label) * grain(labels.shape, length * _FINE, rng))[..., None]
    return cv2.resize(np.maximum(light, 0), (camera.size, camera.size), interpolation=cv2.INTER_AREA)


def grain(shape: tuple[int, int], length: float, rng: Rng) -> Array:
    """A Gaussian field of unit variance whose correlation falls to 1/e at this distance (samples)."""
    field = cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), length / 2, borderType=cv2.BORDER_REFLECT)
    return (field - field.mean()) / field.std()


# -- by PyBullet -------------------------------------------------------------------------------------------------------


class Bullet:
    """The same scenes by PyBullet's TinyRenderer, which shades coded values; use as a context manager."""

    def __init__(self, camera: Viewpoint, things: list[Solid]) -> None:
        self.camera, self.things = camera, things

    def __enter__(self) -> "Bullet":
        self.client = pybullet.connect(pybullet.DIRECT)
        self.bodies = {
            self._body(pybullet.GEOM_BOX, (0, 0, -0.01), 0.0, halfExtents=[0.8, 0.8, 0.01]): TABLE,
            self._body(pybullet.GEOM_BOX, (0, 0, 0.0), 0.0, halfExtents=[*_MAT, 0.0005]): MAT,
        }
        for thing in self.things:
            sizes = {"radius": thing.half[0]} if thing.label == BALL else {"halfExtents": thing.half.tolist()}
            kind = pybullet.GEOM_SPHERE if thing.label == BALL else pybullet.GEOM_BOX
            self.bodies[self._body(kind, thing.place.tolist(), thing.yaw, **sizes)] = thing.label
        return self

    def __exit__(self, *error: object) -> None:
        pybullet.disconnect(physicsClientId=self.client)

    def _body(self, kind: int, place: object, yaw: float, **sizes: object) -> int:
        shape = pybullet.createVisualShape(kind, physicsClientId=self.client, **sizes)
        turned = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
        return int(pybullet.createMultiBody(0, -1, shape, place, turned, physicsClientId=self.client))

    def picture(self, look: Look) -> tuple[Array, Array, Array]:
        """Coded values uint8 [H, W, 3], labels [H, W] and depth [H, W] (m)."""
        for body, label in self.bodies.items():
            colour = [*look.colours[label].tolist(), 1]
            pybullet.changeVisualShape(body, -1, rgbaColor=colour, specularColor=[0, 0, 0], physicsClientId=self.client)
        camera, side = self.camera, self.camera.size
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = camera.rotation, -camera.rotation @ camera.position
        matrix = np.zeros((4, 4))
        matrix[0, 0] = matrix[1, 1] = 2 * camera.focal / side
        matrix[2, 2], matrix[2, 3] = -(_FAR + _NEAR) / (_FAR - _NEAR), -2 * _FAR * _NEAR / (_FAR - _NEAR)
        matrix[3, 2] = -1
        image = pybullet.getCameraImage(
            side,
            side,
            (np.diag([1, -1, -1, 1]) @ pose).T.ravel().tolist(),
            matrix.T.ravel().tolist(),
            lightDirection=look.towards.tolist(),
            lightColor=[1, 1, 1],
            lightDistance=1.2,
            shadow=0,
            lightAmbientCoeff=look.ambient,
            lightDiffuseCoeff=1 - look.ambient,
            lightSpecularCoeff=0.0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        rgb = np.asarray(image[2], np.uint8).reshape(side, side, 4)[..., :3]
        bodies = np.asarray(image[4]).reshape(side, side)
        buffer = np.asarray(image[3], np.float64).reshape(side, side)
        depth = _FAR * _NEAR / (_FAR - (_FAR - _NEAR) * buffer)
        labels = np.vectorize(lambda body: self.bodies.get(body, 0), otypes=[np.uint8])(bodies)
        return rgb, labels, depth
