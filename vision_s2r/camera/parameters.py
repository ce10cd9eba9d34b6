"""The parameters of a batch of pictures, as data: what the camera did, to be kept and replayed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS
from vision_s2r.errors import UserError, nearest


@dataclass(frozen=True)
class CameraParameters:
    """What the camera does to each of B pictures.

    `values` holds, by effect and parameter, a tensor [B]; a sample at an effect's neutral value is without
    it, and an effect that is not named is neutral for all. `seeds` [B] int64 in [0, 2**31) fix each sample's
    noise. Both lie on the CPU, except where a value wants a gradient.
    """

    values: dict[str, dict[str, Tensor]]
    seeds: Tensor

    @classmethod
    def of(
        cls, effects: Mapping[str, Mapping[str, float | Tensor]], batch: int, seeds: Tensor | None = None
    ) -> "CameraParameters":
        """These effects for a batch: each parameter a number for all samples, or a tensor [batch].

        `seeds` [batch] default to 0, 1, 2 … Raises UserError for unknown or missing names and values out of
        bounds.
        """
        values: dict[str, dict[str, Tensor]] = {}
        for name, given in effects.items():
            tensors = {key: _as_batch(value, batch, f"{name}: {key}") for key, value in given.items()}
            effect = CAMERA_EFFECTS[name]
            for sample in zip(*(tensor.tolist() for tensor in tensors.values()), strict=True):
                effect.check(dict(zip(tensors, sample, strict=True)))
            values[name] = tensors
        return cls(values, _as_seeds(torch.arange(batch) if seeds is None else seeds, batch))

    def __len__(self) -> int:
        return len(self.seeds)

    def select(self, index: Tensor) -> "CameraParameters":
        """The parameters of these samples; `index` [K] int64, or a mask [B]."""
        values = {
            name: {key: value[index.to(value.device)] for key, value in given.items()}
            for name, given in self.values.items()
        }
        return CameraParameters(values, self.seeds[index])

    def on(self, effect: str) -> Tensor:
        """Which samples [B] (bool, on the CPU) have the effect."""
        if effect not in self.values:
            return torch.zeros(len(self), dtype=torch.bool)
        return ~CAMERA_EFFECTS[effect].is_neutral(self.values[effect]).detach().cpu()

    def to_dict(self) -> dict[str, Any]:
        """Numbers, strings, lists and dicts only, for JSON; null stands for an infinite neutral value."""
        effects = {
            name: {
                key: [number if abs(number) < float("inf") else None for number in value.tolist()]
                for key, value in given.items()
            }
            for name, given in self.values.items()
        }
        return {"seeds": self.seeds.tolist(), "effects": effects}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "CameraParameters":
        """The inverse of `to_dict`, exact; UserError for what it cannot have written."""
        for key in data:
            if key not in ("seeds", "effects"):
                raise UserError(f"camera parameters: unknown key '{key}', {nearest(key, ('seeds', 'effects'))}")
        try:
            seeds = torch.tensor(data["seeds"], dtype=torch.int64)
            effects = {
                name: {key: _from_list(name, key, numbers) for key, numbers in given.items()}
                for name, given in data["effects"].items()
            }
        except (KeyError, AttributeError, TypeError, ValueError) as error:
            raise UserError(f"camera parameters: {error!r}, expected what to_dict wrote") from error
        return cls.of(effects, len(seeds), seeds)


def _from_list(effect: str, parameter: str, numbers: list[float | None]) -> Tensor:
    neutral = CAMERA_EFFECTS[effect].parameter(parameter).neutral
    return torch.tensor([neutral if number is None else number for number in numbers], dtype=torch.float64)


def _as_batch(value: float | Tensor, batch: int, where: str) -> Tensor:
    if not isinstance(value, Tensor):
        return torch.full((batch,), float(value), dtype=torch.float64)
    if value.shape != (batch,):
        raise UserError(f"{where} has shape {tuple(value.shape)}, expected ({batch},): one value a picture")
    return value


def _as_seeds(seeds: Tensor, batch: int) -> Tensor:
    if seeds.shape != (batch,) or (batch and not (seeds.min() >= 0 and seeds.max() < 2**31)):
        raise UserError(f"noise seeds of shape {tuple(seeds.shape)}: expected ({batch},), each in [0, 2**31)")
    return seeds.cpu()
