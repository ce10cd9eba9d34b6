"""Triangle meshes with the normals and texture coordinates that textures and light need.

The engine gets them as files: what it is given as arrays it never frees.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vision_s2r.files import whole
from vision_s2r.scene.cache import cache

TILE = 0.12  # m of surface that one texture covers


@dataclass(frozen=True)
class Mesh:
    """Triangles [T, 3, 3] in metres, normals [T, 3, 3] and texture coordinates [T, 3, 2]."""

    triangles: np.ndarray
    normals: np.ndarray
    uv: np.ndarray


def triplanar(triangles: np.ndarray, tile: float = TILE) -> Mesh:
    """Project the texture along the axis that each triangle [3, 3] faces most; normals are flat."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    axis = np.abs(normal).argmax(axis=1)
    kept = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    uv = np.take_along_axis(triangles, kept[:, None, :].repeat(3, axis=1), axis=2) / tile
    return Mesh(triangles, normal[:, None].repeat(3, axis=1), uv)


def box(size: tuple[float, float, float], centre: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    """A box of the given edge lengths."""
    half = np.array(size) / 2
    quads = []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1, 1):
            corners = np.zeros((4, 3))
            corners[:, axis] = sign
            corners[:, a] = np.array([-1, 1, 1, -1]) * sign
            corners[:, b] = [-1, -1, 1, 1]
            quads.append(corners * half + centre)
    return triplanar(np.concatenate([[q[[0, 1, 2]], q[[0, 2, 3]]] for q in quads]))


def file(name: str, mesh: Mesh) -> Path:
    """The mesh as a Wavefront OBJ file in the cache, written if it is not yet there."""
    digest = hashlib.sha256(mesh.triangles.tobytes() + mesh.uv.tobytes()).hexdigest()[:12]
    path = cache() / "meshes" / f"{name}-{digest}.obj"
    if not path.exists():
        corners = []
        with whole(path) as temporary, temporary.open("w") as out:
            for key, rows in (("v", mesh.triangles), ("vt", mesh.uv), ("vn", mesh.normals)):
                # Each row once: the engine reads the file again for every body.
                unique, inverse = np.unique(rows.reshape(-1, rows.shape[2]), axis=0, return_inverse=True)
                out.writelines(f"{key} {' '.join(f'{x:.7g}' for x in row)}\n" for row in unique)
                corners.append(1 + inverse.reshape(-1, 3))
            for v, vt, vn in zip(*corners, strict=True):
                out.write("f " + " ".join(f"{a}/{b}/{c}" for a, b, c in zip(v, vt, vn, strict=True)) + "\n")
    return path
