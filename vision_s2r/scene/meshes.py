"""Triangle meshes with the normals and texture coordinates that textures and light need."""

from dataclasses import dataclass

import numpy as np

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


def prism(radius: float, height: float, sides: int = 12) -> Mesh:
    """An upright regular prism, centred: a cheap cylinder."""
    angles = 2 * np.pi * np.arange(sides + 1) / sides
    ring = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    low, high = (np.concatenate([ring, np.full((sides + 1, 1), z)], axis=1) for z in (-height / 2, height / 2))
    middle = np.array([[0, 0, -height / 2], [0, 0, height / 2]])
    triangles = []
    for k in range(sides):
        triangles += [
            [low[k], low[k + 1], high[k + 1]],
            [low[k], high[k + 1], high[k]],
            [middle[0], low[k + 1], low[k]],
            [middle[1], high[k], high[k + 1]],
        ]
    return triplanar(np.array(triangles))


def merge(*parts: Mesh) -> Mesh:
    """Several meshes as one."""
    return Mesh(
        np.concatenate([p.triangles for p in parts]),
        np.concatenate([p.normals for p in parts]),
        np.concatenate([p.uv for p in parts]),
    )
