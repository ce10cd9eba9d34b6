"""Three looks of the same state: randomized (training), canonical (what a policy sees), real (what is tested).

A look is data: a surface for each named part, a light, and distractors beside the bin. It is drawn here and
rendered in `renderer.py`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vision_s2r.randomize import Range
from vision_s2r.scene import arm, tray
from vision_s2r.scene.config import SceneConfig
from vision_s2r.scene.sampling import Stream, generator
from vision_s2r.scene.state import SceneState

CLASSES = ("background", "bin", "arm", "gripper", "object")
TABLE = "table"

DISTRACTOR_SIZES = (  # m
    (0.03, 0.02, 0.01),
    (0.04, 0.04, 0.02),
    (0.06, 0.02, 0.008),
    (0.05, 0.035, 0.03),
    (0.07, 0.05, 0.006),
    (0.025, 0.025, 0.025),
    (0.045, 0.03, 0.012),
    (0.065, 0.065, 0.01),
)

CANONICAL_COLOURS = {
    "background": (0.20, 0.22, 0.26),
    "bin": (0.80, 0.78, 0.70),
    "arm": (0.25, 0.45, 0.75),
    "gripper": (0.85, 0.25, 0.25),
    "object": (0.30, 0.75, 0.35),
}


@dataclass(frozen=True)
class Surface:
    """A colour (RGB in [0, 1]) times a texture: its place in the bank, -1 for none; specular strength."""

    colour: tuple[float, float, float]
    texture: int = -1
    specular: float = 0.0


@dataclass(frozen=True)
class Light:
    """One distant light: direction towards it, colour (RGB), coefficients as in getCameraImage."""

    direction: tuple[float, float, float]
    colour: tuple[float, float, float]
    ambient: float
    diffuse: float
    specular: float
    shadow: bool


@dataclass(frozen=True)
class LightRanges:
    """What a look's light is drawn from: its angle (rad) from the zenith, and coefficients as in getCameraImage."""

    angle: Range
    ambient: Range
    diffuse: Range
    specular: Range


RANDOMIZED_LIGHT = LightRanges(Range(0.0, 0.8), Range(0.3, 0.7), Range(0.3, 0.8), Range(0.0, 0.6))
ALIKE = 0.15  # how many objects of the randomized look are made of what the floor is made of
RANDOMIZED_TINT = Range(0.75, 1.0)  # of each colour of the light
REAL_LIGHT = LightRanges(Range(0.8, 1.05), Range(0.35, 0.5), Range(0.55, 0.85), Range(0.2, 0.8))


@dataclass(frozen=True)
class Distractor:
    """A box on the table beside the bin: which of DISTRACTOR_SIZES, place (x, y), yaw, its surface."""

    shape: int
    place: tuple[float, float]
    yaw: float
    surface: Surface


@dataclass(frozen=True)
class Appearance:
    """A look: a surface for each part of the scene, objects in their order; light; distractors.

    bank: the textures that surfaces number, "randomized" or "real".
    """

    bank: str
    parts: dict[str, Surface]
    objects: tuple[Surface, ...]
    light: Light
    distractors: tuple[Distractor, ...] = ()


def class_of(part: str) -> str:
    """The class of a named part."""
    if part == TABLE:
        return "background"
    return "bin" if part.startswith("bin_") else arm.KINDS[part]


def palette() -> list[tuple[float, float, float]]:
    """The canonical colour (RGB in [0, 1]) of each of CLASSES, before it is shaded."""
    return [CANONICAL_COLOURS[name] for name in CLASSES]


PARTS = (TABLE, *(part.name for part in tray.PARTS), *arm.KINDS)

CANONICAL_LIGHT = Light((-0.66, 0.44, 0.61), (1.0, 1.0, 1.0), ambient=0.3, diffuse=0.9, specular=0.0, shadow=False)


def canonical(state: SceneState) -> Appearance:
    """One flat colour a class, one fixed light that shades shapes, no shadows, no distractors."""
    surfaces = {kind: Surface(colour) for kind, colour in CANONICAL_COLOURS.items()}
    return Appearance(
        "randomized",
        {part: surfaces[class_of(part)] for part in PARTS},
        (surfaces["object"],) * len(state.object_ids),
        CANONICAL_LIGHT,
    )


def randomized(cfg: SceneConfig, state: SceneState, view: int = 0) -> Appearance:
    """Every surface textured and tinted at random, one light of random direction and colour, distractors.

    Some objects are made of what the floor is made of.
    """
    rng = generator(state.seed, state.index, Stream.RANDOMIZED, view)

    def surface() -> Surface:
        tint = rng.uniform(0.45, 1.0) * rng.uniform(0.6, 1.0, size=3)
        return Surface(_rgb(tint), int(rng.integers(cfg.appearance.textures)), float(rng.uniform(0, 1)))

    light = Light(
        _direction(rng, RANDOMIZED_LIGHT.angle),
        _rgb(RANDOMIZED_TINT.uniform(rng, 3)),
        ambient=float(RANDOMIZED_LIGHT.ambient.uniform(rng)),
        diffuse=float(RANDOMIZED_LIGHT.diffuse.uniform(rng)),
        specular=float(RANDOMIZED_LIGHT.specular.uniform(rng)),
        shadow=bool(rng.uniform() < 0.7),
    )
    look = _dress("randomized", cfg, state, rng, surface, light)
    floor = look.parts["bin_floor"]
    alike = rng.uniform(size=len(look.objects)) < ALIKE
    objects = (floor if same else own for same, own in zip(alike, look.objects, strict=True))
    return replace(look, objects=tuple(objects))


def real(cfg: SceneConfig, state: SceneState) -> Appearance:
    """Materials, lights and backgrounds that `randomized` never draws, always with shadows.

    The textures come from other families and are not tinted, or only where the material is dyed or painted; the light
    is low, warm or cold, over a weak ambient.
    """
    rng = generator(state.seed, state.index, Stream.REAL)

    def surface() -> Surface:
        tint = rng.uniform(0.8, 1.0) * (np.ones(3) if rng.uniform() < 0.5 else rng.uniform(0.55, 1.0, size=3))
        return Surface(_rgb(tint), int(rng.integers(cfg.appearance.real_textures)), float(rng.uniform(0, 1)))

    warmth = rng.uniform(-1, 1)
    light = Light(
        _direction(rng, REAL_LIGHT.angle),
        _rgb(np.array([1.0, 0.93, 0.80]) if warmth > 0 else np.array([0.86, 0.93, 1.0])),
        ambient=float(REAL_LIGHT.ambient.uniform(rng)),
        diffuse=float(REAL_LIGHT.diffuse.uniform(rng)),
        specular=float(REAL_LIGHT.specular.uniform(rng)),
        shadow=True,
    )
    return _dress("real", cfg, state, rng, surface, light)


def _dress(
    bank: str,
    cfg: SceneConfig,
    state: SceneState,
    rng: np.random.Generator,
    surface: Callable[[], Surface],
    light: Light,
) -> Appearance:
    """A surface for everything; the bin's walls share one, and so do the parts of the arm half of the time."""
    parts = {TABLE: surface(), "bin_floor": surface()}
    wall = surface()
    parts |= {part.name: wall for part in tray.PARTS if part.name != "bin_floor"}
    if rng.uniform() < 0.4:
        parts["bin_floor"] = wall
    links, jaws = surface(), surface()
    one_arm = rng.uniform() < 0.5
    for part, kind in arm.KINDS.items():
        parts[part] = (links if kind == "arm" else jaws) if one_arm else surface()
    objects = tuple(surface() for _ in state.object_ids)
    return Appearance(bank, parts, objects, light, tuple(_distractors(cfg, rng, surface)))


def _distractors(cfg: SceneConfig, rng: np.random.Generator, surface: Callable[[], Surface]) -> list[Distractor]:
    """Low clutter on the table, beside or before the bin, where it hides nothing of it; each shape at most once."""
    count = Range(*cfg.appearance.distractors).integer(rng)
    shapes = rng.choice(len(DISTRACTOR_SIZES), size=count, replace=False)
    return [_distractor(rng, int(shape), surface()) for shape in shapes]


def _distractor(rng: np.random.Generator, shape: int, surface: Surface) -> Distractor:
    reach = max(DISTRACTOR_SIZES[shape][:2]) * 0.75
    beside = tray.INNER / 2 + tray.WALL + reach + float(rng.uniform(0.0, 0.03))
    along = float(rng.uniform(-0.16, 0.16))
    place = [(beside, along), (-beside, along), (along, -beside)][rng.integers(3)]
    return Distractor(shape, place, float(rng.uniform(0, np.pi)), surface)


def _direction(rng: np.random.Generator, from_zenith: Range) -> tuple[float, float, float]:
    """Towards a light that stands so far (rad) from the zenith, anywhere around."""
    angle, turn = from_zenith.uniform(rng), rng.uniform(0, 2 * np.pi)
    return (
        float(np.sin(angle) * np.cos(turn)),
        float(np.sin(angle) * np.sin(turn)),
        float(np.cos(angle)),
    )


def _rgb(values: np.ndarray) -> tuple[float, float, float]:
    red, green, blue = np.clip(values, 0, 1)
    return float(red), float(green), float(blue)
