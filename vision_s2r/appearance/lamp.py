"""The renderer's own light, from its pictures and the normals of what they show; and what another makes of them."""

import numpy as np
import torch
from scipy.optimize import least_squares
from torch import Tensor

from vision_s2r.appearance.effect import Lamp, Scene
from vision_s2r.camera.colour import to_coded, to_linear

_PIXELS = 6000  # that a light is fitted to
_STARTS = ((0.0, 0.0, -1.0), (0.7, 0.0, -0.7), (-0.7, 0.0, -0.7), (0.0, 0.7, -0.7), (0.0, -0.7, -0.7))
_FORGIVEN = 0.05  # relative error beyond which a pixel is texture, shadow or gloss
_DARK, _FULL = 0.03, 0.98  # coded values that show no shading
_BENT, _ANGLE = 0.1, 0.3  # rad between the normals of neighbours: of what is hardly flat; across an edge
_LEAST = 200  # pixels that a label needs to say anything of the light


def relit(light: Tensor, scene: Scene, lamp: Lamp) -> Tensor:
    """Linear light [B, C, H, W] under another lamp than the scene's; unchanged where the normal is not known."""
    assert scene.lamp is not None and scene.normals is not None
    ratio = lamp.shading(scene.normals) / scene.lamp.shading(scene.normals)
    ratio = torch.where(scene.normals.square().sum(1, keepdim=True) > 0.5, ratio, 1.0)
    if lamp.coded and scene.encoding == "srgb":
        return _linear(_coded(light) * ratio)
    return light * ratio


def _linear(coded: Tensor) -> Tensor:
    """Beyond white as the curve goes on: what is brighter than the sensor bears may still be darkened."""
    return torch.where(coded > 1, ((coded.clamp(min=1) + 0.055) / 1.055) ** 2.4, to_linear(coded))


def _coded(light: Tensor) -> Tensor:
    return torch.where(light > 1, 1.055 * light.clamp(min=1) ** (1 / 2.4) - 0.055, to_coded(light))


def lamp_of(pictures: Tensor, labels: Tensor, normals: Tensor, encoding: str) -> Lamp:
    """The light under which a renderer's pictures [N, C, H, W] (coded as `encoding` says) are likeliest.

    Each label [N, H, W] has a colour of its own, or varies about one; its brightness is that times Lambert's shading
    of its `normals` [N, 3, H, W] (Basri and Jacobs 2003: with one distant light over an even one, an affine function
    of the normal where it is lit). Colours are free, so that only how brightness turns with the normal says anything.
    """
    values, normal, group, weight = _samples(pictures, labels, normals)
    if not len(values):
        return Lamp((0.0, 0.0, -1.0), 1.0)
    even, starts = np.ones_like(weight), [np.array(start) for start in _STARTS]
    ends = []
    for coded in (False, True) if encoding == "srgb" else (False,):
        bright = values if coded or encoding != "srgb" else to_linear(torch.from_numpy(values)).numpy()
        bright = np.log(np.maximum(bright, 1e-4))
        # Which form it has shows where surfaces bend; cost is that of light.
        cost, vector = _fitted(bright, normal, group, even * (2.2 if coded else 1.0), starts)
        ends.append((cost, vector, bright, coded))
    _, vector, bright, coded = min(ends, key=lambda end: end[0])
    _, vector = _fitted(bright, normal, group, weight, [vector])
    size = float(np.linalg.norm(vector))
    towards = vector / size if size > 1e-6 else np.array([0.0, 0.0, -1.0])
    return Lamp((float(towards[0]), float(towards[1]), float(towards[2])), 1 / (1 + size), coded)


def _samples(
    pictures: Tensor, labels: Tensor, normals: Tensor
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Brightness [n], normals [n, 3], number of the label [n] and weight [n] of pixels that show shading."""
    grey, weight = pictures.mean(1), _flat(labels, normals)
    usable = (weight > 0) & (pictures.amin(1) > _DARK) & (pictures.amax(1) < _FULL)
    found = [label for label in labels.unique().tolist() if int((usable & (labels == label)).sum()) >= _LEAST]
    parts = []
    for k, label in enumerate(found):
        at = (usable & (labels == label)).nonzero()
        at = at[:: max(len(at) * len(found) // _PIXELS, 1)]
        frame, row, column = at.T
        own = torch.full((len(at),), k)
        parts.append((grey[frame, row, column], normals[frame, :, row, column], own, weight[frame, row, column]))
    if not parts:
        return np.empty(0), np.empty((0, 3)), np.empty(0, int), np.empty(0)
    return tuple(torch.cat(each).double().numpy() for each in zip(*parts, strict=True))[:4]  # type: ignore[return-value]


def _flat(labels: Tensor, normals: Tensor) -> Tensor:
    """Weights [N, H, W] in [0, 1]: 0 beside an edge, where a renderer may mix what meets, little where it bends.

    On what bends as much as a small ball does, normals from depth are off, and all to the same side.
    """
    alike, facing = normals.square().sum(1) > 0.5, torch.ones_like(normals[:, 0])
    for axis in (1, 2):
        for turn in (1, -1):
            alike &= labels == labels.roll(turn, axis)
            facing = torch.minimum(facing, (normals * normals.roll(turn, axis + 1)).sum(1))
    for edge in (alike[:, 0], alike[:, -1], alike[:, :, 0], alike[:, :, -1]):
        edge.zero_()
    bent = facing.clamp(-1, 1).acos()
    return torch.where(alike & (bent < _ANGLE), 1 / (1 + (bent / _BENT) ** 2), 0.0)


def _fitted(
    bright: np.ndarray, normal: np.ndarray, group: np.ndarray, weight: np.ndarray, starts: list[np.ndarray]
) -> tuple[float, np.ndarray]:
    """Cost and the vector towards the light whose length is that of the directed light over the even one.

    `bright` [n] is a logarithm; `weight` [n] is what its residual is multiplied by.
    """
    group = group.astype(int)
    count = np.bincount(group)

    def residual(vector: np.ndarray) -> np.ndarray:
        left = bright - np.log1p(np.maximum(normal @ vector, 0.0))
        centre = np.array([np.median(left[group == k]) for k in range(len(count))])
        return np.asarray((left - centre[group]) * weight / np.sqrt(count)[group])

    scale = _FORGIVEN / np.sqrt(count.mean())
    ends = [
        least_squares(residual, start, loss="soft_l1", f_scale=scale, max_nfev=60, bounds=(-60, 60)) for start in starts
    ]
    best = min(ends, key=lambda end: float(end.cost))
    return float(best.cost), np.asarray(best.x)
