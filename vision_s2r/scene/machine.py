"""The robot that stands in the scene: its camera, its arm's drives, and what its fingers and objects are made of.

A machine is what separates a robot from the scene's simulator, in the vocabulary of effects. Joint and contact effects
change what becomes of a grasp; camera effects change the pictures, and are applied where pictures are taken.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from vision_s2r import files
from vision_s2r.camera import CAMERA_EFFECTS, CameraConfig
from vision_s2r.contact import CONTACT_EFFECTS
from vision_s2r.effects import Registry
from vision_s2r.errors import UserError, check_keys
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.randomize.files import read

DRIVES = ("shoulder", "elbow", "lift", "wrist")
PARTS = ("camera", *DRIVES, "contact")
# A body's shape and mass are those of its mesh.
CONTACTS = (
    "lateral_friction", "restitution", "rolling_friction", "spinning_friction", "contact_compliance", "support_tilt"
)  # fmt: skip
REFERENCE_SIZE = 64  # px, for which parameters in px are meant

Values = Mapping[str, Mapping[str, float]]  # by effect, its parameters by name
Key = tuple[str, str]  # part and effect


@dataclass(frozen=True)
class Machine:
    """Effects by part (camera, each drive of the arm, contact) and name, their parameters by name; none: neutral."""

    parts: Mapping[str, Values] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_keys(self.parts, PARTS, "machine")
        for part, effects in self.parts.items():
            for name, values in effects.items():
                registry_of(part)[name].check(values, f"machine: {part}: {name}")
                if part == "contact" and name not in CONTACTS:
                    raise UserError(f"machine: contact: the scene does not simulate {name}: {', '.join(CONTACTS)}")

    @property
    def keys(self) -> list[Key]:
        """(part, effect) of every effect."""
        return [(part, name) for part in PARTS for name in self.parts.get(part, {})]

    @property
    def drives(self) -> dict[str, Values]:
        """The drives that have effects."""
        return {name: self.parts[name] for name in DRIVES if self.parts.get(name)}

    @property
    def contact(self) -> Values:
        """Of fingers and objects."""
        return self.parts.get("contact", {})

    @property
    def camera(self) -> CameraConfig:
        """The camera that takes the pictures."""
        effects = {name: dict(values) for name, values in self.parts.get("camera", {}).items()}
        return CameraConfig(effects=effects, reference_size=REFERENCE_SIZE)

    def only(self, keys: Iterable[Key]) -> "Machine":
        """The machine with these effects alone."""
        kept = set(keys)
        parts = {
            part: {name: values for name, values in effects.items() if (part, name) in kept}
            for part, effects in self.parts.items()
        }
        return Machine({part: effects for part, effects in parts.items() if effects})

    def to_dict(self) -> dict[str, Any]:
        """JSON-able."""
        return {part: {name: dict(values) for name, values in each.items()} for part, each in self.parts.items()}

    def save(self, path: Path) -> Path:
        """Write as YAML, whole or not at all. Raises UserError where that cannot be."""
        return files.write(path, yaml.safe_dump(self.to_dict(), sort_keys=False))

    @classmethod
    def load(cls, path: Path) -> "Machine":
        """Read a YAML file of parts. Raises UserError where it is missing or says what cannot be."""
        content = read(path, "machine")
        for part, effects in content.items():
            known = isinstance(effects, dict) and all(isinstance(values, dict) for values in effects.values())
            if not known:
                raise UserError(f"machine {path}: {part} is {effects!r:.60}, expected effects with their parameters")
        try:
            return cls(content)
        except UserError as error:
            raise UserError(f"machine {path}: {error}") from error


NEUTRAL = Machine()


def registry_of(part: str) -> Registry[Any]:
    """The effects that a part may have."""
    registries: dict[str, Registry[Any]] = {"camera": CAMERA_EFFECTS, "contact": CONTACT_EFFECTS}
    return registries.get(part, JOINT_EFFECTS)


def source_of(key: Key) -> str:
    """The source of an effect: its part, or the drives."""
    return "drives" if key[0] in DRIVES else key[0]
