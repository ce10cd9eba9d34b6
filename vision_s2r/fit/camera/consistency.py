"""Whether an effect is as large wherever one looks, as its own model says.

A parameter is one number for the whole recording. What only stands in for an effect that nobody taught is fitted to
one part of the pixels at the cost of another: a rotation for rows that are displaced, too large where edges are
upright and too small where they lie; an exposure for scattered light, too small in the dark. In each bin of each axis
the size of the effect is estimated anew, as a share of what it was found to be. A true one is as large everywhere,
whatever else is wrong in some of the pictures: what differs from frame to frame, as the light of a second picture on
the first does, is an error of the estimate, and a stand-in is wrong in the same place of all of them.

And a picture that is blurred lacks fine detail, wherever that is. Frames that shake, or are seen through warm air, have
it, only elsewhere; pixel by pixel a blur is less wrong of them than what is sharp in the wrong place.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from vision_s2r.fit.camera.smoothing import smoothed
from vision_s2r.fit.camera.student import forgiving

ALLOWED = 0.08  # of its size, by which a true effect may differ beside something unknown: definitions allow a twentieth
ALLOWED_WITHIN = 0.15  # … of a warp or a blur along these: what scales the light of a channel scales its edges too
_COLOURS = ("channel", "site", "colour")  # where a sensor's mosaic of colours, and what fills its gaps, shows
WITHIN = {  # a warp moves what is fine and what is coarse alike; what sharpens beside a blur does the work of the fine
    "warp": (*_COLOURS, "scale"),
    "blur": _COLOURS,
}
PARITY = ("row parity", "column parity")  # where no maker's kernel or definition of a true effect shows
DIRECTION = "direction of edges"
_PLACES = ("region", "radius")
OF_EDGES = (*PARITY, DIRECTION, "straightness", *_PLACES)  # what takes out noise leaves straight edges, as no blur does
OF_LIGHT = (*PARITY, DIRECTION, *_PLACES, "brightness", "channel")
_LEAST = 0.01  # share of the effect's work, that a bin must have to be asked
_CLEAR = 25.0  # squared standard deviations of noise, likewise
_MOST = 1.0  # that one bin says of it: a place where something else is far off decides nothing
SHARP = 0.6  # of the detail that a blur is to take away: pictures that lack less, or have less more, are as without
_FINE = 4  # px to either side, over which what is finer than their mean is detail
_HEARD = 0.5  # of the noise's own detail: less tells nothing
_SECTORS, _RINGS, _LEVELS, _CELLS = 4, 4, 5, 3
_STRAIGHT = (0.5, 0.8, 0.95)  # coherence of the gradients around: no edge, one that bends, and one that hardly does


def disagreement(change: Tensor, residual: Tensor, weight: Tensor, picture: Tensor) -> dict[str, float]:
    """By axis, how much (of its size) an effect differs between bins: root mean square by the work that it does there.

    `change` [B, C, H, W] is what the effect makes of a predicted `picture` that lacks it, `residual` what is left with
    it, `weight` one over the variance, 0 where a pixel does not count.
    """
    weight = weight.expand_as(residual)
    weight = weight * forgiving(weight * residual.square())
    work = (weight * change.square()).double().reshape(-1)
    more = (weight * change * residual).double().reshape(-1)
    frames = len(residual)
    frame = torch.arange(frames)[:, None, None, None]
    tables = {}
    for name, (bins, count) in _axes(picture).items():
        at = (bins + count * frame).expand_as(residual).reshape(-1)
        tables[name] = tuple(torch.bincount(at, of, count * frames).reshape(frames, count) for of in (work, more))
    tables["colour"] = _between(change, residual, weight, _shared)
    tables["scale"] = _between(change, residual, weight, _by_scale)
    sizes = {name: _surely_unlike(each, off) for name, (each, off) in tables.items()}
    return {name: size for name, size in sizes.items() if size is not None}


def detail_lacking(real: Tensor, blurred: Tensor, sharp: Tensor, noise: Tensor, counted: Tensor) -> float | None:
    """Of the fine detail that a blur takes away, the share that real pictures [B, C, H, W] lack: 1 of a true one.

    `blurred` and `sharp` are predicted with it and without, `noise` its variance, `counted` [B, 1, H, W] where pixels
    count. None where the noise hides it.
    """
    own = noise * (1 - 1 / (2 * _FINE + 1) ** 2)
    is_real, is_blurred, is_sharp = (_detail(each) for each in (real, blurred, sharp))
    taken, lacking, added = (
        float((each * counted).double().sum()) for each in (is_sharp - is_blurred, is_sharp + own - is_real, own)
    )
    return lacking / taken if taken > _HEARD * added else None


def _detail(picture: Tensor) -> Tensor:
    """Squares [B, C, H, W] of what is finer than the mean of the pixels around."""
    return (picture - smoothed(picture, _FINE)).square()


def _surely_unlike(each: Tensor, off: Tensor) -> float | None:
    """`_unlike` without the frame that it hangs on most: of a few photographs, one may be off in a place of its own."""
    kept = [[k for k in range(len(each)) if k != out] for out in range(len(each))] if len(each) > 2 else []
    sizes = [_unlike(each[some], off[some]) for some in kept]
    return min((size for size in sizes if size is not None), default=_unlike(each, off))


def _unlike(each: Tensor, off: Tensor) -> float | None:
    """How much the size differs between bins, from its work and what more is asked for [frames, bins].

    None where too few bins show it.
    """
    frames, done = len(each), each.sum(0)
    told = (done > _LEAST * done.sum()) & (done > _CLEAR)
    if int(told.sum()) < 2:
        return None
    each, off, done = each[:, told], off[:, told], done[told]
    away = off.sum(0) / done
    share = done / done.sum()
    whole_size = float((share * (1 + away)).sum())
    if whole_size <= 0:
        return _MOST
    between = (off - away * each).square().sum(0) / done.square() * frames / max(frames - 1, 1)
    by_chance = torch.maximum(1 / done, between)  # the variance that noise and other frames would make of a size
    squared = (((1 + away) / whole_size - 1).square() - by_chance).clamp(0, _MOST)
    return float((share * squared).sum().sqrt())


def _between(
    change: Tensor, residual: Tensor, weight: Tensor, parts: Callable[[Tensor], list[Tensor]]
) -> tuple[Tensor, Tensor]:
    """Work and what more is asked for [frames, parts], of parts [B, C, H, W] that make up a change and what is left."""
    changes, lefts = (parts(each * (weight > 0)) for each in (change, residual))

    def over(others: list[Tensor]) -> Tensor:
        each = [(weight * of * other).double().sum((1, 2, 3)) for of, other in zip(changes, others, strict=True)]
        return torch.stack(each, 1)

    return over(changes), over(lefts)


def _shared(of: Tensor) -> list[Tensor]:
    """What all channels share, and what they do not."""
    shared = of.mean(1, keepdim=True).expand_as(of)
    return [shared, of - shared]


def _by_scale(of: Tensor) -> list[Tensor]:
    """What is fine, of a few pixels, and coarse."""
    near, far = smoothed(of), smoothed(of, _FINE)
    return [of - near, near - far, far]


def _axes(picture: Tensor) -> dict[str, tuple[Tensor, int]]:
    """The bin of each pixel, broadcastable to a picture [B, C, H, W], and how many there are, by axis."""
    channels, height, width = picture.shape[1:]
    y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    grey = picture.mean(1, keepdim=True)
    across, down = torch.gradient(grey, dim=(3, 2))
    turn = torch.atan2(down, across) / torch.pi % 1  # an edge has no sign
    xx, yy, xy = (smoothed(each) for each in (across * across, down * down, across * down))
    coherence = ((xx - yy).square() + 4 * xy.square()).sqrt() / (xx + yy).clamp(min=1e-8)
    away = ((y - (height - 1) / 2) ** 2 + (x - (width - 1) / 2) ** 2).sqrt() / (height**2 + width**2) ** 0.5 * 2
    return {
        "row parity": (y % 2, 2),
        "column parity": (x % 2, 2),
        DIRECTION: ((turn * _SECTORS + 0.5).long() % _SECTORS, _SECTORS),
        "straightness": (torch.bucketize(coherence, torch.tensor(_STRAIGHT)), len(_STRAIGHT) + 1),
        "brightness": ((grey * _LEVELS).long().clamp(0, _LEVELS - 1), _LEVELS),
        "region": (y * _CELLS // height * _CELLS + x * _CELLS // width, _CELLS**2),
        "radius": ((away * _RINGS).long().clamp(max=_RINGS - 1), _RINGS),
        "channel": (torch.arange(channels)[:, None, None], channels),
        "site": (y % 2 * 2 + x % 2 + 4 * torch.arange(channels)[:, None, None], 4 * channels),
    }
