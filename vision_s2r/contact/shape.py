"""The body: its shape, the points of it that may touch, and how it resists rotation."""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from vision_s2r.errors import UserError

MOST_POINTS = 256  # of a mesh's hull
DENT = 1e-3  # of a mesh's size by which a corner may lie outside of a face
FLAT = 1e-9  # of the cube of its size: no volume


_NONE = np.zeros((0, 3))


@dataclass(frozen=True)
class Shape:
    """A convex body of uniform density, in a frame at its centroid."""

    kind: Literal["box", "sphere", "cylinder", "mesh"]
    points: np.ndarray  # float64 [N, 3], m: corners; of a round body none
    inward: np.ndarray  # float64 [N, 3]: by how much each corner moves as all faces move inwards by 1
    radius: float  # m, of a round body
    half_length: float  # m, of a cylinder, whose axis is z
    inertia: np.ndarray  # float64 [3, 3], m²: about the centroid, of unit mass
    reach: float  # m, of its farthest point from the centroid
    depth: float  # m, of its nearest face: a body lower than that has its centroid under the support

    @property
    def contacts(self) -> int:
        """Points that may touch at a time: corners, a ball's lowest point, four of either rim of a cylinder."""
        return {"sphere": 1, "cylinder": 8}.get(self.kind, len(self.points))

    @cached_property
    def inverse(self) -> np.ndarray:
        """Of the inertia [3, 3], 1/m²."""
        return np.linalg.inv(self.inertia)

    @cached_property
    def isotropic(self) -> bool:
        """Whether it resists rotation about any axis alike."""
        return bool(np.ptp(np.linalg.eigvalsh(self.inertia)) < 1e-9 * np.trace(self.inertia))

    def lowest(self, position: np.ndarray, attitude: np.ndarray) -> np.ndarray:
        """Height [...] (m) of the lowest point over the support at positions [..., 3] and attitudes [..., 4]."""
        x, y, z, w = np.moveaxis(attitude, -1, 0)
        down = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1)
        if self.kind == "sphere":
            return np.asarray(position[..., 2] - self.radius)
        if self.kind == "cylinder":
            lean = np.sqrt(np.maximum(1 - down[..., 2] ** 2, 0.0))
            return np.asarray(position[..., 2] - self.half_length * np.abs(down[..., 2]) - self.radius * lean)
        return np.asarray(position[..., 2] + (down @ self.points.T).min(axis=-1))


def box(half_extents: tuple[float, float, float]) -> Shape:
    """A box of these half extents (m) along its axes."""
    h = np.array(half_extents, dtype=float)
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * h
    squares = h**2
    inertia = np.diag([squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1]]) / 3
    return Shape("box", corners, -np.sign(corners), 0.0, 0.0, inertia, float(np.linalg.norm(h)), float(h.min()))


def sphere(radius: float) -> Shape:
    """A ball."""
    return Shape("sphere", _NONE, _NONE, radius, 0.0, 0.4 * radius**2 * np.eye(3), radius, radius)


def cylinder(radius: float, length: float) -> Shape:
    """A cylinder along its z axis."""
    half = length / 2
    across = radius**2 / 4 + half**2 / 3
    inertia = np.diag([across, across, radius**2 / 2])
    return Shape("cylinder", _NONE, _NONE, radius, half, inertia, math.hypot(radius, half), min(radius, half))


def mesh(path: Path) -> Shape:
    """A convex mesh from an OBJ file, moved to its centroid. Raises UserError where it is none."""
    vertices, faces = _obj(path)
    try:
        hull = ConvexHull(vertices)
    except (QhullError, ValueError):
        raise UserError(f"{path}: its {len(vertices)} vertices enclose no volume, expected a convex mesh") from None
    if hull.volume < FLAT * np.ptp(vertices, axis=0).max() ** 3:
        raise UserError(f"{path}: its vertices enclose no volume, expected a convex mesh")
    if len(hull.vertices) > MOST_POINTS:
        raise UserError(f"{path}: {len(hull.vertices)} corners, expected at most {MOST_POINTS}: simplify the mesh")
    inside = vertices.mean(axis=0)
    _check_convex(path, vertices - inside, faces)
    corners, simplices = vertices - inside, hull.simplices
    tetrahedra = corners[simplices]  # [F, 3, 3], with a fourth corner at the origin
    volume = np.abs(np.linalg.det(tetrahedra)) / 6
    centroid = (volume[:, None] * tetrahedra.sum(axis=1) / 4).sum(axis=0) / volume.sum()
    # Second moments of a tetrahedron with a corner at the origin: V/20·(Σ vᵢvᵢ⊤ + s·s⊤), s the sum of the others.
    whole = tetrahedra.sum(axis=1)
    second = np.einsum("f,fia,fib->ab", volume, tetrahedra, tetrahedra)
    second += np.einsum("f,fa,fb->ab", volume, whole, whole)
    second = second / 20 / volume.sum() - np.outer(centroid, centroid)
    inertia = np.trace(second) * np.eye(3) - second
    points = corners[hull.vertices] - centroid
    depth = float((-hull.equations[:, 3] - hull.equations[:, :3] @ (inside + centroid)).min())
    inward = np.array([_inward(hull, k) for k in hull.vertices])
    return Shape("mesh", points, inward, 0.0, 0.0, inertia, float(np.linalg.norm(points, axis=1).max()), depth)


def _inward(hull: ConvexHull, corner: int) -> np.ndarray:
    """How a corner moves as the faces that meet there move inwards by 1."""
    normals = hull.equations[(hull.simplices == corner).any(axis=1), :3]
    return np.asarray(np.linalg.lstsq(normals, -np.ones(len(normals)), rcond=None)[0])


def _check_convex(path: Path, corners: np.ndarray, faces: list[list[int]]) -> None:
    """UserError where corners lie on both sides of a face."""
    slack = DENT * float(np.ptp(corners, axis=0).max())
    for face in faces:
        for k in range(1, len(face) - 1):
            a, b, c = corners[face[0]], corners[face[k]], corners[face[k + 1]]
            normal = np.cross(b - a, c - a)
            size = float(np.linalg.norm(normal))
            if size < slack**2:
                continue
            height = (corners - a) @ normal / size
            if min(height.max(), -height.min()) > slack:
                raise UserError(f"{path}: is not convex, corners lie on both sides of the face {face[0] + 1} …")


def _obj(path: Path) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices [V, 3] and faces, as indices from 0, of an OBJ file."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}), expected a mesh") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: is not text, expected an OBJ file") from error
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for number, line in enumerate(lines, start=1):
        word, *rest = line.split() or [""]
        try:
            if word == "v":
                vertices.append([float(x) for x in rest[:3]])
                if len(vertices[-1]) < 3 or not np.isfinite(vertices[-1]).all() or np.abs(vertices[-1]).max() > 1e6:
                    raise ValueError
            elif word == "f":
                indices = [int(x.split("/")[0]) for x in rest]
                face = [k - 1 if k > 0 else len(vertices) + k for k in indices]
                if len(face) < 3 or not all(0 <= k < len(vertices) for k in face):
                    raise ValueError
                faces.append(face)
        except ValueError:
            raise UserError(f"{path}, line {number}: '{line.strip()[:40]}' is no vertex or face") from None
    if len(vertices) < 4:
        raise UserError(f"{path}: {len(vertices)} vertices, expected a convex mesh of 4 or more")
    return np.array(vertices), faces
