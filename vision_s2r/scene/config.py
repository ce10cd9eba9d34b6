"""What the scene is made of, in metres, radians, seconds and newtons."""

from dataclasses import dataclass, field

from vision_s2r.errors import UserError
from vision_s2r.randomize import Range


@dataclass
class ObjectsConfig:
    """Which procedural objects may lie in the bin."""

    split: str = "train"
    count: list[int] = field(default_factory=lambda: [3, 6])
    scale: float = 0.0095


@dataclass
class PhysicsConfig:
    """The world in which objects settle and grasps are tried."""

    time_step: float = 1 / 240
    solver_iterations: int = 30
    object_mass: float = 0.1
    object_friction: float = 0.7
    finger_friction: float = 1.0
    settle_time: float = 2.5
    squeeze_force: float = 20.0
    floor_clearance: float = 0.004
    lift_height: float = 0.12


@dataclass
class ViewpointConfig:
    """Where the camera is meant to hang, and how far a scene's own camera departs from that."""

    height: float = 0.8
    tilt: float = 0.05
    field_of_view: float = 0.46
    position_jitter: float = 0.01
    angle_jitter: float = 0.01
    field_of_view_jitter: float = 0.02


@dataclass
class AppearanceConfig:
    """The bank of procedural textures, and how many distractors lie around the bin."""

    textures: int = 320
    real_textures: int = 96
    texture_size: int = 64
    texture_seed: int = 7
    distractors: list[int] = field(default_factory=lambda: [0, 3])


@dataclass
class SceneConfig:
    """A bin, an arm with a parallel-jaw gripper, and objects, as seen by one camera."""

    objects: ObjectsConfig = field(default_factory=ObjectsConfig)
    physics: PhysicsConfig = field(default_factory=PhysicsConfig)
    viewpoint: ViewpointConfig = field(default_factory=ViewpointConfig)
    appearance: AppearanceConfig = field(default_factory=AppearanceConfig)


def check(cfg: SceneConfig) -> None:
    """Raise UserError where a value cannot be simulated."""
    _check_range(cfg.objects.count, 1, MAX_OBJECTS, "scene.objects.count")
    _check_range(cfg.appearance.distractors, 0, MAX_DISTRACTORS, "scene.appearance.distractors")
    for name in ("textures", "real_textures", "texture_size"):
        if getattr(cfg.appearance, name) < 8:
            raise UserError(f"scene.appearance.{name} = {getattr(cfg.appearance, name)}: expected at least 8")
    for name in ("time_step", "settle_time", "object_mass", "squeeze_force", "lift_height"):
        if getattr(cfg.physics, name) <= 0:
            raise UserError(f"scene.physics.{name} = {getattr(cfg.physics, name)}: expected above 0")


def _check_range(values: list[int], fewest: int, most: int, name: str) -> None:
    if len(values) != 2:
        raise UserError(f"{name} = {list(values)}: expected two numbers, [low, high]")
    low, high = Range(*values, where=name)
    if not fewest <= low <= high <= most:
        raise UserError(f"{name} = [{low}, {high}]: expected {fewest} <= low <= high <= {most}")


MAX_OBJECTS = 8
MAX_DISTRACTORS = 8
