"""A scene state: data that says all about a scene but its looks."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.errors import UserError, nearest
from vision_s2r.files import write

FORMAT = "vision-s2r/scene-state/1"


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera in OpenCV's axes: x right, y down, z forward.

    field_of_view: vertical = horizontal, radians, across a square picture; position [3] in metres;
    rotation [3, 3], world to camera.
    """

    field_of_view: float
    position: tuple[float, float, float]
    rotation: tuple[tuple[float, float, float], ...]

    def intrinsics(self, size: int) -> np.ndarray:
        """fx, fy, cx, cy [4] in pixels of a size x size picture, pixel centres at integers."""
        focal = size / 2 / np.tan(self.field_of_view / 2)
        return np.array([focal, focal, (size - 1) / 2, (size - 1) / 2])

    def extrinsics(self) -> np.ndarray:
        """World to camera, [4, 4]."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation
        matrix[:3, 3] = -matrix[:3, :3] @ np.array(self.position)
        return matrix


@dataclass(frozen=True)
class SceneState:
    """Object ids and poses, arm joints and camera of the scene drawn for (seed, index).

    object_poses: K times (x, y, z, qx, qy, qz, qw), metres and unit quaternion, world frame;
    arm_joints: shoulder, elbow (rad), lift (m), wrist (rad), each finger's opening (m); camera: the scene's own, which
    source pictures are taken with.
    """

    seed: int
    index: int
    object_ids: tuple[int, ...]
    object_poses: tuple[tuple[float, ...], ...]
    arm_joints: tuple[float, ...]
    camera: Pinhole

    def to_dict(self) -> dict[str, Any]:
        """JSON-able; floats survive bit for bit."""
        return {"format": FORMAT, **asdict(self)}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> "SceneState":
        """The inverse of `to_dict`. Raises UserError for another format, missing or unknown keys."""
        if data.get("format") != FORMAT:
            raise UserError(f"scene state of format {data.get('format')!r}: expected '{FORMAT}'")
        fields = {k: v for k, v in data.items() if k != "format"}
        known = set(cls.__dataclass_fields__)
        for key in fields.keys() - known:
            raise UserError(f"scene state has an unknown key '{key}': {nearest(key, known)}")
        for key in known - fields.keys():
            raise UserError(f"scene state lacks the key '{key}'")
        return cls(**{k: _tuples(v) for k, v in fields.items() if k != "camera"}, camera=_camera(fields["camera"]))

    def save(self, path: Path) -> None:
        """Write as JSON, whole or not at all. Raises UserError where that cannot be."""
        write(path, json.dumps(self.to_dict(), indent=1))

    @classmethod
    def load(cls, path: Path) -> "SceneState":
        """Read what `save` wrote. Raises UserError where it is missing or damaged."""
        try:
            return cls.from_dict(json.loads(path.read_text()))
        except (OSError, ValueError) as error:
            raise UserError(f"scene state {path}: {error}") from error


def _camera(data: dict[str, Any]) -> Pinhole:
    return Pinhole(**{k: _tuples(v) for k, v in data.items()})


def _tuples(value: Any) -> Any:
    return tuple(_tuples(v) for v in value) if isinstance(value, list | tuple) else value
