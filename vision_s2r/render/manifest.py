"""What a folder of shards holds: its configuration, the versions that made it, a checksum for each shard."""

import json
from dataclasses import asdict, dataclass, field, fields
from importlib.metadata import version
from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError, check_keys
from vision_s2r.files import write
from vision_s2r.render import shard as shards
from vision_s2r.render.config import RenderConfig
from vision_s2r.scene import SceneConfig

FORMAT = "vision-s2r/renders/1"
NAME = "manifest.json"
ENGINE = ("pybullet", "numpy", "vision-s2r")
HOW = {"out", "backend", "store", "workers"}  # keys that change where and how, not what


@dataclass
class Manifest:
    """The folder's contents. checksums: shard number to SHA-256, of the shards that are there."""

    scene: dict[str, Any]
    render: dict[str, Any]
    versions: dict[str, str]
    checksums: dict[int, str] = field(default_factory=dict)

    @classmethod
    def new(cls, scene: SceneConfig, cfg: RenderConfig) -> "Manifest":
        """For a folder not yet begun."""
        render = {key: value for key, value in asdict(cfg).items() if key not in HOW}
        return cls(asdict(scene), render, {"renderer": "TinyRenderer", **{n: version(n) for n in ENGINE}})

    @classmethod
    def load(cls, folder: Path) -> "Manifest":
        """Read a folder's manifest. Raises UserError where it is missing or no manifest of ours."""
        path = folder / NAME
        try:
            data = json.loads(path.read_text())
        except OSError as error:
            raise UserError(f"{path} cannot be read: expected a folder that `vision-s2r render` wrote") from error
        except (ValueError, RecursionError) as error:
            raise UserError(f"{path} is not JSON: {error}") from error
        if not isinstance(data, dict) or data.pop("format", None) != FORMAT:
            raise UserError(f"{path}: expected format '{FORMAT}'")
        check_keys(data, [each.name for each in fields(cls)], str(path), [each.name for each in fields(cls)])
        for name, part in data.items():
            if not isinstance(part, dict):
                raise UserError(f"{path}: {name} is {part!r:.40}, expected keys and values")
        for key in ("scenes", "shard_size", "size", "source_scale", "margin"):
            value = data["render"].get(key)
            if not isinstance(value, int) or value < (key != "margin"):
                raise UserError(f"{path}: render.{key} is {value!r:.40}, expected a whole number")
        try:
            data["checksums"] = {int(k): str(v) for k, v in data["checksums"].items()}
        except ValueError as error:
            raise UserError(f"{path}: checksums: {error}, expected the number of each shard") from error
        if min(data["checksums"], default=0) < 0:
            raise UserError(f"{path}: checksums of shard {min(data['checksums'])}, expected numbers from 0")
        return cls(**data)

    def save(self, folder: Path) -> None:
        """Write, whole or not at all. Raises UserError where that cannot be."""
        content = {"format": FORMAT, **asdict(self), "checksums": dict(sorted(self.checksums.items()))}
        write(folder / NAME, json.dumps(content, indent=1))

    @property
    def shard_count(self) -> int:
        """How many shards the finished folder has."""
        return -(-self.render["scenes"] // self.render["shard_size"])

    def require_same(self, other: "Manifest", folder: Path) -> None:
        """Raise UserError, naming the first key that differs, where `other` describes other data."""
        for section in ("scene", "render", "versions"):
            ours, theirs = _flat(getattr(self, section)), _flat(getattr(other, section))
            for key in sorted(ours.keys() | theirs.keys()):
                if ours.get(key) != theirs.get(key):
                    raise UserError(
                        f"{folder} holds shards of another configuration: {section}.{key} is {ours.get(key)!r} "
                        f"there, {theirs.get(key)!r} here; choose another folder or remove it"
                    )

    def damaged(self, folder: Path) -> list[Path]:
        """The listed shards that are missing or whose bytes are not what was written."""
        found = []
        for number, digest in self.checksums.items():
            path = shard_path(folder, number)
            if not path.is_file() or shards.checksum(path) != digest:
                found.append(path)
        return found


def shard_path(folder: Path, number: int) -> Path:
    """The file of a shard."""
    return folder / f"shard-{number:05d}.safetensors"


def _flat(data: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in data.items():
        found |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return found
