"""The camera: draws parameters, and passes pictures through its effects in the order of the light."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import cast

import numpy as np
import torch
from torch import Tensor

from vision_s2r.camera.colour import OF_CURVE, Curve
from vision_s2r.camera.config import CameraConfig, check
from vision_s2r.camera.effect import (
    CAMERA_EFFECTS,
    CameraEffect,
    Encoding,
    Frame,
    Interpolation,
    JpegForm,
)
from vision_s2r.camera.parameters import CameraParameters
from vision_s2r.errors import UserError
from vision_s2r.randomize import EffectRange, effect_ranges

_FOCAL_LENGTH = 1.1  # picture widths: 49 degrees across


def default_intrinsics(height: int, width: int) -> np.ndarray:
    """What is assumed where none are given: fx, fy, cx, cy [4] in pixels of a picture without margin."""
    focal = _FOCAL_LENGTH * width
    return np.array([focal, focal, (width - 1) / 2, (height - 1) / 2])


class Camera:
    """A real camera, or a distribution over real cameras.

    `camera.sample(...)` draws parameters, `camera(images, parameters)` applies any parameters whatever their
    origin; `Camera()` draws none.
    """

    def __init__(
        self,
        ranges: Mapping[str, EffectRange] | None = None,
        encoding: Curve = "srgb",
        interpolation: Interpolation = "bicubic",
        jpeg: JpegForm = "codec",
        reference_size: int | None = None,
    ) -> None:
        self.ranges = dict(ranges or {})
        self.encoding = encoding
        self.interpolation = interpolation
        self.jpeg = jpeg
        self.reference_size = reference_size

    @classmethod
    def from_config(cls, config: CameraConfig) -> "Camera":
        """The camera of a configuration; UserError where a key or value cannot be."""
        check(config)
        return cls(
            effect_ranges(config.effects, CAMERA_EFFECTS),
            cast(Encoding, config.encoding),
            cast(Interpolation, config.interpolation),
            cast(JpegForm, config.jpeg),
            config.reference_size,
        )

    @classmethod
    def single(cls, effect: str, **values: float) -> "Camera":
        """One effect alone, always on, at its moderate setting but for `values`; pixels are pixels at any size."""
        return cls(effect_ranges({effect: CAMERA_EFFECTS[effect].moderate() | values}, CAMERA_EFFECTS))

    def sample(
        self,
        batch: int,
        generator: torch.Generator,
        height: int,
        width: int,
        given: Mapping[str, Mapping[str, Tensor]] | None = None,
        on: Mapping[str, Tensor] | None = None,
    ) -> CameraParameters:
        """Parameters for `batch` pictures of height x width (without margin), drawn on the CPU.

        Each effect is on with its probability; each parameter is uniform in its range, on its own scale. Values `given`
        by effect and parameter (float64 [batch]) take the place of those drawn, and samples that are `on` by effect
        (bool [batch]) have it whatever its probability.
        """
        given, on = given or {}, on or {}
        size_ratio = min(height, width) / self.reference_size if self.reference_size else 1.0
        values: dict[str, dict[str, Tensor]] = {}
        for name, drawn in self.ranges.items():
            effect = CAMERA_EFFECTS[name]
            present = torch.rand(batch, generator=generator, dtype=torch.float64) < drawn.probability
            if name in on:
                present = present | on[name]
            values[name] = {}
            for key, drawn_from in drawn.ranges.items():
                parameter = effect.parameter(key)
                unit = torch.rand(batch, generator=generator, dtype=torch.float64)
                value = given.get(name, {}).get(key, drawn_from.at(unit, parameter.scale))
                if parameter.unit == "px":
                    value = (value * size_ratio).clamp(parameter.low, parameter.high)
                if parameter.neutral is not None:
                    value = torch.where(present, value, parameter.neutral)
                values[name][key] = value
        seeds = torch.randint(2**31, (batch,), generator=generator)
        return CameraParameters(values, seeds)

    def __call__(
        self,
        images: Tensor,
        parameters: CameraParameters,
        margin: int = 0,
        intrinsics: Tensor | None = None,
    ) -> Tensor:
        """What the camera makes of pictures [B, 3, H+2m, W+2m], float in [0, 1]: [B, 3, H, W] in [0, 1].

        Optics see the margin; where they look beyond it, its edge repeats. `intrinsics` [B, 4] (fx, fy, cx,
        cy in pixels of the picture without margin) default to a focal length of 1.1 widths and the centre. A
        sample that has no effect on keeps its pixels bit for bit; a value that wants a gradient is applied
        even where it is neutral, so that it gets one. Raises UserError for shapes that do not fit.
        """
        frame = self._frame(images, parameters, margin, intrinsics)
        with torch.autocast(images.device.type, enabled=False):  # light is not measured in bf16
            return self._pass(images.clone(), parameters, frame)

    def _pass(self, images: Tensor, parameters: CameraParameters, frame: Frame) -> Tensor:
        linear = torch.zeros(len(images), dtype=torch.bool)  # which samples are in linear light at the moment
        for effect in sorted(CAMERA_EFFECTS, key=lambda effect: effect.order):
            active = _active(effect, parameters)
            if not effect.optical and frame.margin:
                images, frame = _crop(images, frame)
            if not active.any():
                continue
            if self.encoding != "linear":
                images = self._convert(images, active & (linear != effect.linear_light), effect.linear_light)
                linear = torch.where(active, effect.linear_light, linear)
            images = _apply(effect, images, parameters.values[effect.name], active, frame)
        return self._convert(_crop(images, frame)[0], linear, False)

    def _convert(self, images: Tensor, chosen: Tensor, to_light: bool) -> Tensor:
        """`images` with the `chosen` samples (mask [B]) brought to linear light, or back."""
        if not chosen.any():
            return images
        return _replace(images, chosen.nonzero()[:, 0], OF_CURVE[self.encoding][0 if to_light else 1])

    def _frame(self, images: Tensor, parameters: CameraParameters, margin: int, intrinsics: Tensor | None) -> Frame:
        batch = len(parameters)
        if images.ndim != 4 or images.shape[:2] != (batch, 3) or not images.is_floating_point():
            raise UserError(
                f"camera: pictures of type {images.dtype} and shape {tuple(images.shape)}, "
                f"expected float [{batch}, 3, H, W], as many as there are parameters"
            )
        height, width = images.shape[-2] - 2 * margin, images.shape[-1] - 2 * margin
        if margin < 0 or height < 2 or width < 2:
            raise UserError(f"camera: a margin of {margin} px does not fit pictures of {tuple(images.shape)}")
        if intrinsics is None:
            intrinsics = torch.from_numpy(default_intrinsics(height, width)).expand(batch, 4)
        if intrinsics.shape != (batch, 4):
            raise UserError(f"camera: intrinsics of shape {tuple(intrinsics.shape)}, expected ({batch}, 4)")
        return Frame(height, width, margin, intrinsics.to(images), parameters.seeds, self.interpolation, self.jpeg)


def _active(effect: CameraEffect, parameters: CameraParameters) -> Tensor:
    """Which samples [B] the effect is to be applied to."""
    values = parameters.values.get(effect.name, {})
    if any(value.requires_grad for value in values.values()):
        return torch.ones(len(parameters), dtype=torch.bool)
    return parameters.on(effect.name)


def _apply(effect: CameraEffect, images: Tensor, values: Mapping[str, Tensor], active: Tensor, frame: Frame) -> Tensor:
    """`images` with the effect on the samples of the mask `active` [B]."""
    index = active.nonzero()[:, 0]
    chosen = {key: value.to(images)[index.to(images.device)] for key, value in values.items()}
    return _replace(images, index, lambda some: effect.apply(some, chosen, frame.select(index)).clamp(0, 1))


def _replace(images: Tensor, index: Tensor, function: Callable[[Tensor], Tensor]) -> Tensor:
    """`images`, the camera's own copy, with `function` applied to the samples of `index` alone."""
    if len(index) == len(images):
        return function(images)
    index = index.to(images.device)
    changed = function(images.index_select(0, index))
    if images.requires_grad or changed.requires_grad:
        return images.index_copy(0, index, changed)
    return images.index_copy_(0, index, changed)  # in place: copying the rest costs more than most effects


def _crop(images: Tensor, frame: Frame) -> tuple[Tensor, Frame]:
    m = frame.margin
    images = images[..., m : m + frame.height, m : m + frame.width]
    return images, replace(frame, margin=0)
