"""Pictures of a scene state in any look, by PyBullet's TinyRenderer, which needs no GPU and repeats bit for bit.

The world of a renderer has no physics. Fixed parts are made once; a scene's objects are made when the scene changes,
from meshes that stay; between pictures only poses, colours and textures change. Nothing is reset, nothing leaks.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np

from vision_s2r.bullet import pybullet
from vision_s2r.scene import arm, meshes, objects, textures, tray
from vision_s2r.scene.appearance import CLASSES, DISTRACTOR_SIZES, PARTS, TABLE, Appearance, Surface, class_of
from vision_s2r.scene.config import SceneConfig
from vision_s2r.scene.state import Pinhole, SceneState

NEAR, FAR = 0.2, 2.0  # m
LIGHT_DISTANCE = 1.2  # m, below FAR: beyond it the renderer drops shadows
TABLE_SIZE = 1.6
HIDDEN = (0.0, 0.0, -20.0)  # below the table, out of every picture


@dataclass(frozen=True)
class View:
    """One picture: rgb uint8 [S, S, 3]; where asked for, depth float32 [S, S] (m along the optical axis),
    segmentation uint8 [S, S] (class ids) and instance uint8 [S, S] (0: none, k + 1: object k)."""

    rgb: np.ndarray
    depth: np.ndarray | None = None
    segmentation: np.ndarray | None = None
    instance: np.ndarray | None = None


class Renderer:
    """Renders scene states; use as a context manager."""

    def __init__(self, cfg: SceneConfig) -> None:
        self.cfg = cfg
        self.client = pybullet.connect(pybullet.DIRECT)
        look = cfg.appearance
        self.banks = {
            "randomized": textures.bank(
                textures.chosen(look.families), look.textures, look.texture_size, look.texture_seed
            ),
            "real": textures.bank(textures.REAL, look.real_textures, look.texture_size, look.texture_seed),
        }
        self.textures = {name: [self._texture(path) for path in paths] for name, paths in self.banks.items()}
        self.parts = {part: self._body(meshes.file(part, _part_mesh(part))) for part in PARTS}
        for part in tray.PARTS:
            self._move(self.parts[part.name], part.position, (0, 0, 0, 1))
        self.shapes: dict[int, int] = {}
        self.state: SceneState | None = None
        self.objects: list[int] = []
        self.distractors = [
            self._body(meshes.file(f"distractor-{k}", meshes.box(size))) for k, size in enumerate(DISTRACTOR_SIZES)
        ]

    def render(
        self,
        state: SceneState,
        look: Appearance,
        size: int,
        margin: int = 0,
        labels: bool = False,
        camera: Pinhole | None = None,
    ) -> View:
        """A picture of size + 2 margin pixels a side; the margin lies around what size alone would show.

        labels: depth, segmentation and instances too. camera: another than the state's own.
        """
        self._arrange(state)
        self._dress(look)
        camera = camera or state.camera
        side = size + 2 * margin
        image = pybullet.getCameraImage(
            side,
            side,
            view_matrix(camera),
            projection(camera, size, margin),
            lightDirection=look.light.direction,
            lightColor=look.light.colour,
            lightDistance=LIGHT_DISTANCE,
            shadow=int(look.light.shadow),
            lightAmbientCoeff=look.light.ambient,
            lightDiffuseCoeff=look.light.diffuse,
            lightSpecularCoeff=look.light.specular,
            renderer=pybullet.ER_TINY_RENDERER,
            flags=0 if labels else pybullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self.client,
        )
        rgb = np.asarray(image[2], dtype=np.uint8).reshape(side, side, 4)[..., :3]
        if not labels:
            return View(rgb)
        bodies = np.asarray(image[4]).reshape(side, side)
        buffer = np.asarray(image[3], dtype=np.float32).reshape(side, side)
        depth = (FAR * NEAR / (FAR - (FAR - NEAR) * buffer.astype(np.float64))).astype(np.float32)
        return View(rgb, depth, *self._labels(bodies))

    def _arrange(self, state: SceneState) -> None:
        """Put the state's objects and arm in place; nothing to do for the state that is there already."""
        if state is self.state:
            return
        for body in self.objects:
            pybullet.removeBody(body, physicsClientId=self.client)
        self.objects = [
            self._object(object_id, pose) for object_id, pose in zip(state.object_ids, state.object_poses, strict=True)
        ]
        for part in arm.parts(state.arm_joints):
            self._move(self.parts[part.name], part.position, _yaw(part.yaw))
        self.state = state

    def _dress(self, look: Appearance) -> None:
        for part, surface in look.parts.items():
            self._paint(self.parts[part], surface, look.bank)
        for body, surface in zip(self.objects, look.objects, strict=True):
            self._paint(body, surface, look.bank)
        for body in self.distractors:
            self._move(body, HIDDEN, (0, 0, 0, 1))
        for thing in look.distractors:
            body, height = self.distractors[thing.shape], DISTRACTOR_SIZES[thing.shape][2]
            self._move(body, (*thing.place, height / 2 - tray.DEPTH_OF_FLOOR), _yaw(thing.yaw))
            self._paint(body, thing.surface, look.bank)

    def _labels(self, bodies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Class ids and instances [S, S] from body ids."""
        table = np.zeros((max(bodies.max(), 0) + 2, 2), dtype=np.uint8)
        for part, body in self.parts.items():
            if body < len(table) - 1:
                table[body, 0] = CLASSES.index(class_of(part))
        for k, body in enumerate(self.objects):
            if body < len(table) - 1:
                table[body] = CLASSES.index("object"), k + 1
        found = table[bodies]  # -1, nothing hit, is the last row: background
        return found[..., 0], found[..., 1]

    def _paint(self, body: int, surface: Surface, bank: str) -> None:
        texture = self.textures[bank][surface.texture] if surface.texture >= 0 else -1
        pybullet.changeVisualShape(
            body,
            -1,
            textureUniqueId=texture,
            rgbaColor=[*surface.colour, 1],
            specularColor=[surface.specular] * 3,
            physicsClientId=self.client,
        )

    def _move(self, body: int, position: tuple[float, ...], quaternion: tuple[float, ...]) -> None:
        pybullet.resetBasePositionAndOrientation(body, position, quaternion, physicsClientId=self.client)

    def _texture(self, path: Path) -> int:
        return pybullet.loadTexture(str(path), physicsClientId=self.client)

    def _object(self, object_id: int, pose: tuple[float, ...]) -> int:
        if object_id not in self.shapes:
            self.shapes[object_id] = self._shape(objects.mesh_file(object_id, self.cfg.objects.scale))
        return pybullet.createMultiBody(0, -1, self.shapes[object_id], pose[:3], pose[3:], physicsClientId=self.client)

    def _body(self, mesh: Path) -> int:
        return pybullet.createMultiBody(0, -1, self._shape(mesh), physicsClientId=self.client)

    def _shape(self, mesh: Path) -> int:
        return pybullet.createVisualShape(pybullet.GEOM_MESH, fileName=str(mesh), physicsClientId=self.client)

    def __enter__(self) -> "Renderer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pybullet.disconnect(physicsClientId=self.client)


def _part_mesh(part: str) -> meshes.Mesh:
    if part == TABLE:
        top = -tray.DEPTH_OF_FLOOR
        return meshes.box((TABLE_SIZE, TABLE_SIZE, 0.02), (0, 0, top - 0.01))
    sizes = {p.name: p.size for p in tray.PARTS} | arm.SIZES
    return meshes.box(sizes[part])


def _yaw(angle: float) -> tuple[float, float, float, float]:
    return 0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2)


def view_matrix(camera: Pinhole) -> list[float]:
    """OpenGL's view matrix, by columns: its camera looks along -z with y up."""
    return (np.diag([1, -1, -1, 1]) @ camera.extrinsics()).T.ravel().tolist()


def projection(camera: Pinhole, size: int, margin: int) -> list[float]:
    """OpenGL's projection, by columns, of the picture with its margin."""
    scale = size / (size + 2 * margin) / np.tan(camera.field_of_view / 2)
    matrix = np.zeros((4, 4))
    matrix[0, 0] = matrix[1, 1] = scale
    matrix[2, 2], matrix[2, 3] = -(FAR + NEAR) / (FAR - NEAR), -2 * FAR * NEAR / (FAR - NEAR)
    matrix[3, 2] = -1
    return matrix.T.ravel().tolist()
