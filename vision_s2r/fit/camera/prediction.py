"""What the simulator's pictures become under camera effects, without their noise: the mean that a fit compares.

The effects are those of `vision_s2r.camera`, called in its order; what is added is only that a pass remembers its
stages, so that a change of a late effect does not repeat the early ones.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.appearance import PICTURE_EFFECTS, Scene, is_appearance
from vision_s2r.appearance.apply import after, in_order, passed
from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.camera.colour import Curve, linear_to_power, power_to_linear
from vision_s2r.camera.effect import CameraEffect, Frame, Interpolation
from vision_s2r.camera.effects.jpeg_compression import libjpeg
from vision_s2r.errors import UserError
from vision_s2r.fit.camera import effects as _effects  # noqa: F401  (fills CAMERA_FITS)
from vision_s2r.fit.camera.coordinates import at_scale
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, Optics, of_stage
from vision_s2r.fit.camera.light import STEADY, FrameLight
from vision_s2r.fit.camera.noise import Tail
from vision_s2r.fit.camera.resampling import KERNELS, resampled
from vision_s2r.fit.camera.surfaces import Surfaces
from vision_s2r.fit.case import Values

# Functions of a pixel's light alone, which `Tail` holds together; and the encoder.
BEHIND = frozenset({"white_balance", "gamma", "read_noise", "shot_noise", "jpeg_compression"})

Stages = dict[
    tuple[object, ...], tuple[Tensor, bool]
]  # by the effects passed, the pictures, and whether they are light


def chosen(frames: Tensor, segments: Sequence[int]) -> Tensor:
    """Those of `frames` [N, …], which are not to be changed in place: a fit asks for the same ones again and again."""
    wanted = tuple(segments)
    if wanted and wanted == tuple(range(wanted[0], wanted[-1] + 1)):
        return frames[wanted[0] : wanted[-1] + 1]
    return _kept(frames, wanted)


@lru_cache(maxsize=32)  # a tensor is its own key
def _kept(frames: Tensor, wanted: tuple[int, ...]) -> Tensor:
    return frames[list(wanted)]


def on_the_way(names: Iterable[str]) -> list[str]:
    """Effects in the order in which light meets them: those of the scene, then those of the camera."""
    names = list(names)
    return in_order(names) + sorted(
        (name for name in names if name in CAMERA_EFFECTS), key=lambda name: CAMERA_EFFECTS[name].order
    )


def front(names: Iterable[str]) -> Sequence[str]:
    """Those of `names` from the scene to the light that falls on the sensor, on its way.

    UserError where an effect is said to act behind it: those have their place in `Tail`.
    """
    return _front(frozenset(names))


@lru_cache(maxsize=256)
def _front(names: frozenset[str]) -> Sequence[str]:
    found = []
    for name in on_the_way(names):
        if name in BEHIND:
            continue
        stage = CAMERA_FITS[name].stage
        if stage not in ("scene", *APART, "warp", "light", "blur"):
            raise UserError(f"camera effect '{name}': stage is {stage}, expected warp, light or blur")
        if stage not in APART:
            found.append(name)
    return found


@dataclass(frozen=True)
class Prediction:
    """Coded values [B, C, H, W] in [0, 1]."""

    mean: Tensor
    light: Tensor  # coded, before noise
    tail: Tail

    @property
    def variance(self) -> Tensor | None:
        """Of the noise effects, before JPEG; None without them. Few ask for it."""
        return self.tail.variance(self.light)


@dataclass(frozen=True)
class Pictures:
    """Pairs at one size: the recording's own, or smaller for the start of a fit.

    `sim` and `real` are [N, C, H, W] in [0, 1], C = 1 where they are grey; `meant` [N, 1, H, W] is 1 where the
    simulator's picture is meant; `intrinsics` [4]; `scale` is the size against the recording's.
    """

    sim: Tensor
    real: Tensor
    meant: Tensor
    intrinsics: Tensor
    encoding: Curve
    scale: float = 1.0
    kernel: str = KERNELS[0]  # of what looks between pixels
    light: FrameLight = STEADY  # what frames have of their own
    surfaces: Surfaces | None = None  # what was rendered, where labels tell it

    @property
    def optics(self) -> Optics:
        """Size and focal length."""
        nominal = self.surfaces.nominal if self.surfaces is not None else {}
        height, width = self.sim.shape[-2:]
        return Optics(width, height, float(self.intrinsics[:2].mean()), 1 / self.scale, nominal)

    def half(self) -> "Pictures":
        """At half the size; a pixel is the mean of the four that it covers, its centre theirs."""
        intrinsics = self.intrinsics.clone()
        intrinsics[:2] /= 2
        intrinsics[2:] = (intrinsics[2:] - 0.5) / 2
        return replace(
            self,
            sim=F.avg_pool2d(self.sim, 2),
            real=F.avg_pool2d(self.real, 2),
            meant=(F.avg_pool2d(self.meant, 2) > 0.99).float(),
            intrinsics=intrinsics,
            scale=self.scale / 2,
            surfaces=None if self.surfaces is None else self.surfaces.half(),
        )

    def predict(
        self, values: Values, segments: Sequence[int], stages: Stages | None = None, keep: bool = False
    ) -> Prediction:
        """What these effects make of the simulator's pictures of `segments`; JPEG where it is among them."""
        light = self.front(values, segments, stages, keep)
        tail = Tail.of(values, self.encoding, self.sim.shape[1])
        return Prediction(self.through_encoder(tail.mean(light), values), light, tail)

    def through_encoder(self, mean: Tensor, values: Values) -> Tensor:
        """Behind the encoder, where there is one among `values` and these are whole pictures."""
        return encoded(mean, values["jpeg_compression"]["quality"]) if self.encodes(values) else mean

    def encodes(self, values: Values) -> bool:
        """Whether there is an encoder among `values`, and these are whole pictures."""
        return "jpeg_compression" in values and self.scale == 1.0

    @torch.no_grad()
    def front(
        self, values: Values, segments: Sequence[int], stages: Stages | None = None, keep: bool = False
    ) -> Tensor:
        """Coded pictures [B, C, H, W] of the light that the sensor is given.

        `stages` is searched for what has been passed already, and with `keep` remembers this pass.
        """
        pictures, light = chosen(self.sim, segments), False
        scene: Scene | None = None
        if self.surfaces is not None and any(is_appearance(name) for name in values):
            scene = self.surfaces.of(segments)
        key: tuple[object, ...] = ()
        for name in front(values):
            given, of_scene = values[name], is_appearance(name)
            if PICTURE_EFFECTS[name].is_neutral(given) or (of_scene and scene is None):
                continue
            key = (*key, name, *given.values())
            if stages is not None and key in stages:
                pictures, light = stages[key]
                scene = scene if scene is None or not of_scene else after(scene, name, given)
                continue
            in_light = of_scene or CAMERA_EFFECTS[name].linear_light
            if light != in_light:
                pictures = (linear if in_light else coded)(pictures, self.encoding)
            light = in_light
            if of_scene and scene is not None:
                pictures, scene = passed(pictures, name, given, scene)
            else:
                pictures = self._apply(CAMERA_EFFECTS[name], pictures, given)
            if keep and stages is not None:
                stages[key] = pictures, light
        pictures = coded(pictures, self.encoding) if light else pictures
        return pictures.clamp(0, 1)  # the sensor is full

    def seen(self, values: Values, segments: Sequence[int]) -> Tensor:
        """Where [B, 1, H, W] (bool) a picture under these effects shows only what the simulator drew and meant."""
        present = self.meant[list(segments)]
        moved = values.keys() & of_stage("warp", "blur")
        if not moved:
            return present > 0.5
        present = present.clone()
        for edge in (present[..., 0, :], present[..., -1, :], present[..., :, 0], present[..., :, -1]):
            edge.zero_()  # what a warp looks for beyond the picture is its edge repeated
        flat = replace(self, kernel="bilinear")
        for name in front(moved):
            effect = CAMERA_EFFECTS[name]
            if not effect.is_neutral(values[name]):
                channels = present.expand(-1, 3, -1, -1) if CAMERA_FITS[name].by_channel else present
                present = flat._apply(effect, channels, values[name]).amin(1, keepdim=True)
        return present > 0.98

    def _apply(self, effect: CameraEffect, pictures: Tensor, values: Mapping[str, float]) -> Tensor:
        fit = CAMERA_FITS[effect.name]
        values = at_scale(effect.name, values, self.scale)
        if fit.stage != "warp":
            interpolation: Interpolation = "bilinear" if self.kernel == "bilinear" else "bicubic"
            return effect.apply(pictures, _tensors(values, len(pictures)), self._frame(len(pictures), interpolation))
        looked = self.looked(effect, values)
        return resampled(pictures, looked[0], looked[1], self.kernel)

    def looked(self, effect: CameraEffect, values: Mapping[str, float]) -> Tensor:
        """Where a warp of values at this scale looks for each pixel: x and y [2, 1 or 3, H, W], px."""
        height, width = self.sim.shape[-2:]
        return _looked(effect.name, tuple(values.items()), height, width, tuple(self.intrinsics.tolist()))

    def places(self, channels: int) -> Tensor:
        """Every pixel's own x and y [2, channels, H, W], px."""
        height, width = self.sim.shape[-2:]
        return _places(height, width, channels)

    def _frame(self, count: int, interpolation: Interpolation) -> Frame:
        height, width = self.sim.shape[-2:]
        return _frame(height, width, self.intrinsics, count, interpolation)


@lru_cache(maxsize=16)  # one warp moves at a time, and frames come one after the other
def _looked(
    name: str, values: tuple[tuple[str, float], ...], height: int, width: int, intrinsics: tuple[float, ...]
) -> Tensor:
    """The effect says it by what it makes of pictures of the coordinates, which are linear."""
    frame = _frame(height, width, torch.tensor(intrinsics), 2, "bilinear")
    here = _places(height, width, 3 if CAMERA_FITS[name].by_channel else 1)
    return CAMERA_EFFECTS[name].apply(here, _tensors(dict(values), 2), frame)


def _places(height: int, width: int, channels: int) -> Tensor:
    axes = (torch.arange(size, dtype=torch.float32) for size in (height, width))
    y, x = torch.meshgrid(*axes, indexing="ij")
    return torch.stack([x, y])[:, None].expand(-1, channels, -1, -1)


def _frame(height: int, width: int, intrinsics: Tensor, count: int, interpolation: Interpolation) -> Frame:
    seeds = torch.zeros(count, dtype=torch.int64)
    return Frame(height, width, 0, intrinsics.expand(count, 4), seeds, interpolation, "codec")


def linear(pictures: Tensor, curve: Curve) -> Tensor:
    """Coded values to light, as `vision_s2r.camera.colour` has it, and beyond white and black as the curve goes on:

    what is brighter than the sensor bears may still be darkened by a lens.
    """
    if curve == "linear":
        return pictures
    if curve == "power":
        return power_to_linear(pictures)
    power = ((pictures.clamp(min=0.04045) + 0.055) / 1.055).log_().mul_(2.4).exp_()
    return power.add_((pictures.clamp(max=0.04045) - 0.04045).div_(12.92))


def coded(light: Tensor, curve: Curve) -> Tensor:
    """The inverse of `linear`."""
    if curve == "linear":
        return light
    if curve == "power":
        return linear_to_power(light)
    power = light.clamp(min=0.0031308).log_().mul_(1 / 2.4).exp_().mul_(1.055).sub_(0.055)
    return power.add_((light.clamp(max=0.0031308) - 0.0031308).mul_(12.92))


def without_encoder(values: Values) -> dict[str, Mapping[str, float]]:
    """The effects before the encoder."""
    return {name: value for name, value in values.items() if name != "jpeg_compression"}


def encoded(pictures: Tensor, quality: float) -> Tensor:
    """Pictures [B, 1 or 3, H, W] through libjpeg."""
    three = pictures.expand(-1, 3, -1, -1)
    return libjpeg(three, torch.full((len(three),), quality))[:, : pictures.shape[1]]


def _tensors(values: Mapping[str, float], count: int) -> dict[str, Tensor]:
    return {key: torch.full((count,), value, dtype=torch.float32) for key, value in values.items()}
