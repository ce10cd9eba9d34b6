"""What a picture is like, whatever it shows: statistics that camera effects move and that scenes only scatter."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.camera.colour import to_linear
from vision_s2r.camera.effect import Encoding

GROUPS = ("tone", "position", "spectrum", "noise", "blocks")
BANDS = (0.02, 0.04, 0.06, 0.09, 0.13, 0.18, 0.24, 0.31, 0.39, 0.5, 0.72)  # edges, cycles/px
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of brightness
NODES = (0.15, 0.45, 0.75)  # coded brightness at which noise is measured
_LUMA = torch.tensor([0.299, 0.587, 0.114])
_TURNS = ("level against upright", "rising against falling")  # of the spectrum
_SECTORS = 12  # of direction, over half a turn
_WIDTH = 0.15  # of the weight around a node
_PATCH = 8  # px
_QUIET = 1.0 / 255  # noise and detail below this are alike
_LEVEL = 0.01  # light below this is black
_IMMERKAER = (
    torch.tensor([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]]) / 6
)  # 1996, unit gain for white noise


@dataclass(frozen=True)
class Statistic:
    """One number of a summary."""

    group: str
    label: str


class PictureStatistics:
    """Measures pictures of one size: `summary(pictures)` is [B, K], the K numbers that `statistics` names."""

    def __init__(self, height: int, width: int, encoding: Encoding, grey: bool, region: np.ndarray | None) -> None:
        """`region` bool [H, W]: where both sets mean something; None for everywhere."""
        self.encoding, self.grey = encoding, grey
        inside = torch.ones(height, width) if region is None else torch.from_numpy(region).float()
        self._weight = inside / inside.sum()
        sample = torch.zeros(height, width)
        sample[1::3, 1::3] = 1
        self._sampled = ((sample * inside).flatten() > 0).nonzero()[:, 0]
        self._patches = F.avg_pool2d(inside[None, None, 1:-1, 1:-1], _PATCH).flatten() == 1
        self._shapes = _shapes(self._weight)
        window = torch.outer(torch.hann_window(height, False), torch.hann_window(width, False)) * inside
        self._window = window / window.square().sum().sqrt()
        self._cells, self._turns = _cells(height, width)
        self.statistics = self._names()

    def __call__(self, pictures: Tensor) -> np.ndarray:
        """Statistics [B, K] of coded pictures [B, 3, H, W] in [0, 1]."""
        luma = torch.einsum("c,bchw->bhw", _LUMA, pictures)
        parts = [
            self._tone(pictures, luma),
            self._position(luma),
            self._spectrum(luma),
            self._noise(pictures[:, 1:2] if self.grey else pictures),
            self._blocks(luma),
        ]
        return torch.cat(parts, 1).double().numpy()

    def _names(self) -> tuple[Statistic, ...]:
        tone = [f"brightness, {quantile:.0%} quantile" for quantile in QUANTILES] + [
            "mean light",
            "white share",
            "black share",
        ]
        if not self.grey:
            tone += [f"{name}/green, {part}" for part in ("darker half", "lighter half") for name in ("red", "blue")]
            tone += [f"{name}/green, contrast" for name in ("red", "blue")]
        position = ["towards the corners", "towards the right", "towards the bottom"]
        bands = [f"{low:g}-{high:g} cycles/px" for low, high in itertools.pairwise(BANDS)]
        spectrum = bands + [f"direction of {band} ({turn})" for turn in _TURNS for band in bands[2:]]
        channels = ("grey",) if self.grey else ("red", "green", "blue")
        noise = [f"{channel} at {node:g}" for channel in channels for node in NODES]
        listed = zip(GROUPS, (tone, position, spectrum, noise, ["at the 8 px grid"]), strict=True)
        return tuple(Statistic(group, label) for group, labels in listed for label in labels)

    def _light(self, coded: Tensor) -> Tensor:
        return coded if self.encoding == "linear" else to_linear(coded)

    def _tone(self, pictures: Tensor, luma: Tensor) -> Tensor:
        sampled = luma.flatten(1)[:, self._sampled].sort(1).values
        at = [round(q * (sampled.shape[1] - 1)) for q in QUANTILES]
        colours = pictures.flatten(2)[..., self._sampled]
        white = (colours.amax(1) >= 0.996).float().mean(1)
        black = (colours.amin(1) <= 0.004).float().mean(1)
        light = self._light(luma.flatten(1)[:, self._sampled]).mean(1)
        rows = [*sampled[:, at].unbind(1), (light + _LEVEL).log(), (white + 0.01).log(), (black + 0.01).log()]
        if not self.grey:
            middle = sampled[:, sampled.shape[1] // 2, None]
            brightness = luma.flatten(1)[:, self._sampled]
            for half in ((brightness <= middle).float(), (brightness > middle).float()):
                mean = (colours * half[:, None]).sum(2) / half.sum(1, keepdim=True).clamp(min=1) + _LEVEL
                rows += [(mean[:, 0] / mean[:, 1]).log(), (mean[:, 2] / mean[:, 1]).log()]
            rows += [((colours[:, k] - colours[:, 1]).std(1) + _QUIET).log() for k in (0, 2)]
        return torch.stack(rows, 1)

    def _position(self, luma: Tensor) -> Tensor:
        return (self._light(luma) + _LEVEL).log().flatten(1) @ self._shapes

    def _spectrum(self, luma: Tensor) -> Tensor:
        mean = (luma * self._weight).sum((1, 2), keepdim=True)
        power = torch.fft.rfft2((luma - mean) * self._window).abs().square()
        cells = (power.flatten(1) @ self._cells).reshape(len(luma), len(BANDS) - 1, _SECTORS)
        level = (cells + (1.5 / 255) ** 2).log()
        # By cells of like power, so that neither one direction nor one frequency rules a band
        return torch.cat([level.mean(2), (level[:, 2:] @ self._turns).transpose(1, 2).flatten(1)], 1)

    def _noise(self, pictures: Tensor) -> Tensor:
        batch, channels = pictures.shape[:2]
        filtered = (
            _second_difference(_second_difference(pictures).mT).mT / 6
        )  # Immerkaer 1996: unit gain for white noise
        energy = F.avg_pool2d(filtered.square(), _PATCH).flatten(2)[..., self._patches] + _QUIET**2
        level = F.avg_pool2d(pictures[..., 1:-1, 1:-1], _PATCH).flatten(2)[..., self._patches]
        near = (level[..., None] - torch.tensor(NODES)).div(_WIDTH).square().mul(-0.5).exp() + 1e-3
        # The harmonic mean: flat patches rule, for there noise is all that there is
        harmonic = near.sum(2) / (near / energy[..., None]).sum(2)
        return harmonic.log().reshape(batch, channels * len(NODES))

    def _blocks(self, luma: Tensor) -> Tensor:
        ratio = []
        for lines in (luma, luma.mT):
            bend = (lines[..., 3:] - 3 * lines[..., 2:-1] + 3 * lines[..., 1:-2] - lines[..., :-3]).abs().mean(1)
            phase = (torch.arange(bend.shape[1]) + 1) % 8  # the step lies between pixels k + 1 and k + 2
            ratio.append(((bend[:, phase == 7].mean(1) + _QUIET) / (bend[:, phase != 7].mean(1) + _QUIET)).log())
        return torch.stack(ratio, 1).mean(1, keepdim=True)


def _second_difference(pictures: Tensor) -> Tensor:
    return pictures[..., :-2] - 2 * pictures[..., 1:-1] + pictures[..., 2:]


def _shapes(weight: Tensor) -> Tensor:
    """Maps [H·W, 3] whose products with a picture are its least-squares slopes along r², x and y."""
    height, width = weight.shape
    x = (torch.arange(width) - (width - 1) / 2) / (width / 2)
    y = (torch.arange(height) - (height - 1) / 2)[:, None] / (width / 2)
    ones = torch.ones(height, width)
    design = torch.stack([ones, (x * x + y * y) * ones, x * ones, y * ones], -1).reshape(-1, 4).double()
    weighed = design * weight.reshape(-1, 1)
    return torch.linalg.solve(design.T @ weighed, weighed.T)[1:].T.float()


def _cells(height: int, width: int) -> tuple[Tensor, Tensor]:
    """Means over bands and sectors of the half plane of frequencies, and the two turns of the sectors' harmonic."""
    x, y = torch.fft.rfftfreq(width), torch.fft.fftfreq(height)[:, None]
    radius = torch.hypot(x.expand(height, -1), y.expand(-1, len(x))).flatten()
    angle = torch.atan2(y.expand(-1, len(x)), x.expand(height, -1)).flatten() % math.pi
    band = torch.bucketize(radius, torch.tensor(BANDS), right=True) - 1
    sector = ((angle / math.pi * _SECTORS + 0.5).long()) % _SECTORS
    inside = (band >= 0) & (band < len(BANDS) - 1)
    cells = torch.zeros(len(radius), (len(BANDS) - 1) * _SECTORS)
    cells[inside.nonzero()[:, 0], (band * _SECTORS + sector)[inside]] = 1
    middle = torch.arange(_SECTORS) * (math.pi / _SECTORS)
    turns = torch.stack([torch.cos(2 * middle), torch.sin(2 * middle)], 1) * (2 / _SECTORS)
    return cells / cells.sum(0).clamp(min=1), turns
