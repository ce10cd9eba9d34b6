"""What fitting needs of a camera effect: one record an effect, each in a file of `fit/camera/effects`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from vision_s2r.effects import Records

Setting = dict[str, float]  # an effect's parameters by name
EffectValues = Mapping[str, float]
Point = list[float]  # one effect in the fit's coordinates

# Where it acts. Light, blur and warp come before the sensor, in the camera's order; tone and noise are functions of a
# pixel's light alone, which `noise.Tail` holds together; the encoder is JPEG. Surfaces and light of the scene come
# before all of them; grain has no mean, only a spread, and of an area nothing is predicted.
Stage = Literal["scene", "grain", "area", "warp", "light", "blur", "tone", "noise", "encoder"]


@dataclass(frozen=True)
class Optics:
    """What coordinates depend on: the size of the pictures and the focal length, px."""

    width: int
    height: int
    focal: float
    pixel: float = 1.0  # how many pixels of the recording one of these is: parameters are in the recording's
    # What the simulator has itself of effects that replace a value of its own, which vanish there.
    nominal: Mapping[str, Setting] = field(default_factory=dict)

    @property
    def corner(self) -> float:
        """Distance of the picture's corner from its centre, focal lengths."""
        return math.hypot(self.width, self.height) / 2 / self.focal


@dataclass(frozen=True)
class Chart:
    """The fit's coordinates of one effect: smooth where it vanishes, with a step for differences each."""

    inward: Callable[[EffectValues], Point]
    outward: Callable[[Point], Setting]  # not yet within bounds
    steps: Callable[[Optics], Point]  # a change that shows, of each coordinate; also the scale of the damping
    limits: Point  # the longest move of one iteration, in steps
    period: float = 360.0  # after which an angle (deg) or azimuth (rad) is the same again


def plain(keys: tuple[str, ...], steps: Callable[[Optics], Point], limits: Point) -> Chart:
    """Parameters as they are."""
    return Chart(
        lambda values: [values[key] for key in keys],
        lambda point: dict(zip(keys, point, strict=True)),
        steps,
        limits,
    )


def logarithmic(keys: tuple[str, ...], steps: Callable[[Optics], Point], limits: Point) -> Chart:
    """Logarithms of parameters."""
    return Chart(
        lambda values: [math.log(values[key]) for key in keys],
        lambda point: {key: math.exp(min(max(x, -20.0), 20.0)) for key, x in zip(keys, point, strict=True)},
        steps,
        limits,
    )


def polar(size: str, turns: float, steps: Callable[[Optics], Point], limits: Point) -> Chart:
    """A size and an angle as the vector of that length; `turns` 2 where an angle and its opposite are the same."""

    def inward(values: EffectValues) -> Point:
        angle = math.radians(values["angle"]) * turns
        return [values[size] * math.cos(angle), values[size] * math.sin(angle)]

    def outward(point: Point) -> Setting:
        return {size: math.hypot(*point), "angle": math.degrees(math.atan2(point[1], point[0])) / turns}

    return Chart(inward, outward, steps, limits, 360.0 / turns)


@dataclass(frozen=True)
class Need:
    """What pictures must have to show an effect."""

    lacking: str  # why pictures that do not have it could not show the effect
    remedy: str  # what to photograph


NEEDS: dict[str, Need] = {
    "colour": Need("the pictures have no colour", "scenes in colour, recorded in colour"),
    "edges": Need("the pictures have no edges", "a chessboard or print of letters that fills the picture"),
    "steady light": Need(
        "the light differs from frame to frame", "the scene under one lamp, with the camera's exposure locked"
    ),
    "light": Need("the pictures are black", "the scene under at least ten times the light"),
    "contrast": Need("the pictures have one brightness only", "a grey wedge from black to white"),
    "area": Need("the label fills too little of the pictures", "scenes that show more of that label"),
    "other labels": Need("one label fills the pictures, and shares its light with the camera", "two labels at least"),
    "depth": Need(
        "the recording has no depth/ to tell which way surfaces face", "the same scenes with the render's depth"
    ),
    "directions": Need("too few surfaces face another way", "boxes and balls beside what lies flat"),
    "shading": Need("the simulator's pictures have no shading", "renders with a lamp"),
}


@dataclass(frozen=True, kw_only=True)
class UnpairedFit:
    """How sets of pictures without a scene in common show one effect."""

    negligible: Callable[[EffectValues, int], bool]  # (values, width) -> less than what any simulator gets wrong
    chart: Chart | None = None  # None: it goes by whole numbers, as cells and a quality do
    # (width) -> settings from which a fit finds any other. None: the statistics have a slope along the effect at its
    # neutral value.
    starts: Callable[[int], list[Setting]] | None = None
    turn: int = 0  # of effects with several starts, those of a lower one are started first
    confusable: frozenset[str] = frozenset()  # one side of a pair is enough


@dataclass(frozen=True, kw_only=True)
class CameraFit:
    """What fitting needs of one effect."""

    stage: Stage
    # How unpaired sets show it, or why they do not.
    unpaired: UnpairedFit | str
    chart: Chart | None = None  # None: it is no smooth change of the mean, and fitted by its own means
    # (width) -> settings from which a fit finds any other. None: its neutral value.
    starts: Callable[[int], list[Setting]] | None = None
    along: tuple[str, ...] = ()  # axes of `axes` along which it acts more in some places than in others
    needs: tuple[str, ...] = ()  # keys of NEEDS; what they lack is said of the last
    confusable: frozenset[str] = frozenset()  # effects hard to tell from it when it is weak; one side is enough
    # The fit from coarse pictures to fine ones begins with it, at its neutral value, on pictures of this share of the
    # recording's size or more: 0 all of them. None: it is added where the others are known, from the best start.
    coarse: float | None = None
    bends: Callable[[Optics], list[Setting]] | None = None  # settings to choose among before such a fit
    faint: Callable[[EffectValues], bool] | None = None  # whether another interpolation may pass for it
    by_channel: bool = False  # a warp that differs between colours
    otherwise: float = 0.0  # of how far a warp moves things, that a real one may move them otherwise than defined
    between: bool = False  # it looks between pixels: by which kernel is no part of it
    sized: bool = False  # its parameters scale with the pictures, also those not in px


CAMERA_FITS: Records[CameraFit] = Records("camera", "fitting")


APART: tuple[Stage, ...] = ("grain", "area")  # stages that change no mean, fitted to what the others leave


def of_stage(*stages: Stage) -> frozenset[str]:
    """The effects that act there."""
    return frozenset(name for name, fit in CAMERA_FITS.items() if fit.stage in stages)


def at_stage(names: Iterable[str], *stages: Stage) -> list[str]:
    """Those of `names`, in their order, that act there; they may be effects of labels."""
    return [name for name in names if CAMERA_FITS[name].stage in stages]


def between() -> frozenset[str]:
    """The effects that look between pixels."""
    return frozenset(name for name, fit in CAMERA_FITS.items() if fit.between or fit.stage == "warp")


def charted(names: Iterable[str]) -> list[str]:
    """Those of `names`, in their order, that have coordinates."""
    return [name for name in names if CAMERA_FITS[name].chart is not None]
