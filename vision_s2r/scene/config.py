"""What the scene is made of, in metres, radians, seconds and newtons."""

from dataclasses import dataclass

from vision_s2r.options import option, validate
from vision_s2r.randomize import Range
from vision_s2r.scene import textures

MAX_OBJECTS = 8
MAX_DISTRACTORS = 8


@dataclass
class ObjectsConfig:
    """Which procedural objects may lie in the bin."""

    split: str = option(
        "train", "Which of PyBullet's 1,000 random_urdfs: train (0 to 899) or test (900 to 999, never trained on)."
    )
    count: list[int] = option([3, 6], "How many lie in the bin: [fewest, most].", length=2, low=1, high=MAX_OBJECTS)
    scale: float = option(0.0095, "Metres per unit of their meshes; 0.0095 makes most 4 to 8 cm long.", above=0)


@dataclass
class PhysicsConfig:
    """The world in which objects settle and grasps are tried."""

    time_step: float = option(1 / 240, "Of the engine, s.", above=0)
    solver_iterations: int = option(30, "Of the contact solver in each step.", low=1)
    object_mass: float = option(0.1, "Of each object, kg.", above=0)
    object_friction: float = option(
        0.7, "Coefficient of lateral friction of objects; the engine multiplies the two in contact.", low=0
    )
    finger_friction: float = option(1.0, "Coefficient of lateral friction of the fingers.", low=0)
    settle_time: float = option(
        2.5, "Seconds in which dropped objects must come to rest, or the scene is drawn again.", above=0
    )
    squeeze_force: float = option(20.0, "With which each finger closes, at most, N.", above=0)
    floor_clearance: float = option(
        0.004, "Over the bin's floor, m, at which the descent ends where nothing was touched.", low=0
    )
    lift_height: float = option(0.12, "Of the lift after which the object must still be held, m.", above=0)


@dataclass
class ViewpointConfig:
    """Where the camera is meant to hang, and how far a scene's own camera departs from that.

    Nobody is told how far: canonical pictures are taken where the camera is meant to be, so a translator must see it
    and undo it.
    """

    height: float = option(0.8, "Of the camera over the bin's floor, m.", above=0)
    tilt: float = option(0.05, "By which it leans towards the arm, rad.")
    field_of_view: float = option(0.46, "Across the picture, rad.", above=0)
    position_jitter: float = option(0.01, "Most by which a scene's own camera is displaced, m.", low=0)
    angle_jitter: float = option(0.01, "Most by which it is turned, rad.", low=0)
    field_of_view_jitter: float = option(0.02, "Most by which its field of view differs, as a part of it.", low=0)


@dataclass
class AppearanceConfig:
    """The bank of procedural textures, and how many distractors lie around the bin."""

    families: list[str] = option(
        [],
        "Texture families of the randomized look, by name; empty: all that training draws. bricks, plaid, confetti, "
        "contours and scribble are held out: a look to tune on.",
    )
    textures: int = option(
        850, "How many the randomized look draws from; the families of the two looks never overlap.", low=8
    )
    real_textures: int = option(96, "How many the real look draws from.", low=8)
    texture_size: int = option(64, "Side of a texture, which covers 12 cm of surface, pixels.", low=8)
    texture_seed: int = option(7, "Of the textures themselves.", low=0)
    distractors: list[int] = option(
        [0, 3],
        "How many boxes lie on the table beside the bin: [fewest, most].",
        length=2,
        low=0,
        high=MAX_DISTRACTORS,
    )


@dataclass
class SceneConfig:
    """A bin, an arm with a parallel-jaw gripper, and objects, as seen by one camera."""

    objects: ObjectsConfig = option(ObjectsConfig, "Which objects lie in the bin.")
    physics: PhysicsConfig = option(PhysicsConfig, "The world in which objects settle and grasps are tried.")
    viewpoint: ViewpointConfig = option(ViewpointConfig, "Where the camera hangs.")
    appearance: AppearanceConfig = option(AppearanceConfig, "Textures and distractors.")


def check(cfg: SceneConfig) -> None:
    """Raise UserError where a value cannot be simulated."""
    validate(cfg, "scene")
    Range(*cfg.objects.count, where="scene.objects.count")
    Range(*cfg.appearance.distractors, where="scene.appearance.distractors")
    textures.chosen(cfg.appearance.families)
