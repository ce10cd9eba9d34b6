"""The procedural objects that PyBullet ships: which are usable, how they are split, their meshes."""

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pybullet_data

from vision_s2r.errors import UserError, nearest
from vision_s2r.scene import meshes

SPLITS = {"train": range(900), "test": range(900, 1000)}
URDF_SCALE = 0.015  # m per unit of the meshes, as their URDF files say
NAN_VERTICES = frozenset({168})
MAX_CONVEX_PARTS = 10  # of more parts, contact is slow


def folder() -> Path:
    """The folder of the objects' URDF files inside the installed `pybullet_data`."""
    return Path(pybullet_data.getDataPath()) / "random_urdfs"


def urdf(object_id: int) -> Path:
    """The URDF of one object."""
    return folder() / f"{object_id:03d}" / f"{object_id:03d}.urdf"


@cache
def object_ids(split: str) -> tuple[int, ...]:
    """The usable objects of a split, in order; none of "test" is ever in "train".

    Raises UserError for an unknown split, and where no object of it is installed.
    """
    if split not in SPLITS:
        raise UserError(f"object split '{split}': {nearest(split, SPLITS)}")
    ids = tuple(
        i for i in SPLITS[split] if i not in NAN_VERTICES and urdf(i).is_file() and _parts(i) <= MAX_CONVEX_PARTS
    )
    if not ids:
        raise UserError(f"object split '{split}' is empty: expected random_urdfs under {folder()}")
    return ids


def _parts(object_id: int) -> int:
    text = urdf(object_id).with_suffix(".obj").read_text()
    return sum(line.startswith(("o ", "g ")) for line in text.splitlines())


@cache
def vertices_and_faces(object_id: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices [N, 3] in the object's own unit and triangles [T, 3] as indices."""
    vertices, faces = [], []
    for line in urdf(object_id).with_suffix(".obj").read_text().splitlines():
        key, *values = line.split() or [""]
        if key == "v":
            vertices.append([float(v) for v in values[:3]])
        elif key == "f":
            corners = [int(v.split("/")[0]) - 1 for v in values]
            faces += [[corners[0], *pair] for pair in pairwise(corners[1:])]
    return np.array(vertices), np.array(faces)


@cache
def mesh_file(object_id: int, scale: float) -> Path:
    """The object at a scale, with flat normals and box-projected texture coordinates, which its own file lacks."""
    vertices, faces = vertices_and_faces(object_id)
    return meshes.file(f"object-{object_id:03d}", meshes.triplanar(vertices[faces] * scale))
