"""What the scene is made of, in metres, radians, seconds and newtons."""

from dataclasses import dataclass, field

from vision_s2r.errors import UserError


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
    low, high = _pair(cfg.objects.count, "scene.objects.count")
    if not 1 <= low <= high <= MAX_OBJECTS:
        raise UserError(f"scene.objects.count = [{low}, {high}]: expected 1 <= low <= high <= {MAX_OBJECTS}")
    low, high = _pair(cfg.appearance.distractors, "scene.appearance.distractors")
    if not 0 <= low <= high <= MAX_DISTRACTORS:
        raise UserError(
            f"scene.appearance.distractors = [{low}, {high}]: expected 0 <= low <= high <= {MAX_DISTRACTORS}"
        )
    for name in ("textures", "real_textures", "texture_size"):
        if getattr(cfg.appearance, name) < 8:
            raise UserError(f"scene.appearance.{name} = {getattr(cfg.appearance, name)}: expected at least 8")
    for name in ("time_step", "settle_time", "object_mass", "squeeze_force", "lift_height"):
        if getattr(cfg.physics, name) <= 0:
            raise UserError(f"scene.physics.{name} = {getattr(cfg.physics, name)}: expected above 0")


def _pair(values: list[int], name: str) -> tuple[int, int]:
    if len(values) != 2:
        raise UserError(f"{name} = {list(values)}: expected two numbers, [low, high]")
    return values[0], values[1]


MAX_OBJECTS = 8
MAX_DISTRACTORS = 8
