"""The reference: every effect that moves the mean of a picture, fitted together, from coarse to fine.

It is no answer, since it names too much. It is where the fits of single answers start, and what a recording's noise
is measured about.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.camera.colour import Curve
from vision_s2r.fit.camera.coordinates import neutral, starts
from vision_s2r.fit.camera.effect import CAMERA_FITS, Setting, at_stage, between, of_stage
from vision_s2r.fit.camera.elimination import without_idle
from vision_s2r.fit.camera.fitting import Target, best_start, gauss_newton, search_factor
from vision_s2r.fit.camera.light import STEADY
from vision_s2r.fit.camera.prediction import Pictures, on_the_way
from vision_s2r.fit.camera.resampling import KERNELS
from vision_s2r.fit.camera.weighing import detail
from vision_s2r.fit.case import Values

_COARSEST = 28  # px, of the shorter side
_EDGES, _PHOTOGRAPHED = 0.1, 0.5  # of an edge's height, that is not known; in light that differs between frames
_CURVE_GAIN = 0.95  # of the mean loss, that another curve must leave at most
_LIGHT_GAIN = 0.02  # by which a shadow must lower the mean loss to stay


def pyramid(pictures: Pictures) -> list[Pictures]:
    """The pictures, then each at half the size of the one before, down to about 30 px."""
    levels = [pictures]
    while min(levels[-1].sim.shape[-2:]) >= 2 * _COARSEST:
        levels.append(levels[-1].half())
    return levels


def rough_target(pictures: Pictures, values: Values) -> Target:
    """A target whose noise is not known: so much everywhere, and more where the picture is busy."""
    every = range(len(pictures.sim))
    return Target(pictures, rough_variance(pictures, every), pictures.seen(values, every))


def rough_variance(pictures: Pictures, segments: Sequence[int]) -> Tensor:
    """The variance [B, 1, H, W] of a target whose noise is not known."""
    level = 3.0 / 255 * (pictures.scale + 0.2)
    edges = _EDGES if pictures.light == STEADY else _PHOTOGRAPHED
    return level**2 + (edges * detail(pictures.real[list(segments)])).square()


def fitted_variance(pictures: Pictures, yardstick: Tensor) -> Tensor:
    """The variance [N, 1 or C, H, W] that fits weigh by: that of the yardstick; of photographs, the rough one.

    Theirs is no simulator's error, and what forgives single pixels would forgive every edge of a lens that is not
    quite right yet.
    """
    return yardstick if pictures.light == STEADY else rough_variance(pictures, range(len(pictures.sim)))


def coarse(levels: Sequence[Pictures], names: Collection[str], start: Values, segments: Sequence[int]) -> Values:
    """Geometry and light among `names`, with no start of their own, fitted on pictures from small to half size."""
    values = dict(start)
    first, later = _coarse(names)
    optics = levels[0].optics
    values |= {name: neutral(name, optics) for name in first if name not in values}
    for name in first:
        if (bends := CAMERA_FITS[name].bends) and name not in start:
            values = dict(_bent(levels[-1], values, first, segments, name, bends(levels[-1].optics)))
    for level in reversed(levels[1:]):
        joining = [name for name in later if level.scale >= (CAMERA_FITS[name].coarse or 0.0)]
        values |= {name: neutral(name, optics) for name in joining if name not in values}
        moving = [*first, *joining]
        for _ in range(2):  # what is seen depends on what is fitted
            target = rough_target(level, _without_blurs(values))
            values = dict(gauss_newton(target, values, moving, segments, 5 if level.light == STEADY else 15)[0])
    return values


def _coarse(names: Collection[str]) -> tuple[list[str], list[str]]:
    """Those of `names` that a coarse fit begins with, warps first, and those that join it at larger pictures."""
    found = [name for name in on_the_way(names) if CAMERA_FITS[name].coarse is not None]
    warps = of_stage("warp")
    found = [name for name in found if name in warps] + [name for name in found if name not in warps]
    first = [name for name in found if CAMERA_FITS[name].coarse == 0]
    return first, [name for name in found if name not in first]


def _bent(
    level: Pictures, values: Values, names: Sequence[str], segments: Sequence[int], name: str, bends: Sequence[Setting]
) -> Values:
    """The likeliest of several settings of an effect, each with all of `names` fitted a little."""
    ends = []
    for bend in bends:
        trial = dict(values) | {name: bend}
        ends.append(gauss_newton(rough_target(level, trial), trial, names, segments, 6))
    return min(ends, key=lambda end: end[1])[0]


def fit_reference(
    levels: Sequence[Pictures], begun: Values, names: Collection[str], fixed: Values, segments: Sequence[int]
) -> Values:
    """All of `names` that move the mean, fitted together on these segments of the pyramid, beside what is `fixed`.

    `begun` is their coarse fit.
    """
    values = dict(begun)
    if len(levels) > 1:
        values = dict(without_idle(rough_target(levels[1], values), values, segments, fixed))
    smooth = [name for name in values if name not in fixed]
    target = rough_target(levels[0], values)
    values = dict(gauss_newton(target, values, smooth, segments, 2)[0])
    values = dict(add_blur(target, values, names, segments))
    for name in sorted(of_stage("light")):
        if name in names and CAMERA_FITS[name].coarse is None:
            values = dict(add_light(levels, values, name, segments))
    free = [name for name in values if name not in fixed]
    target = rough_target(levels[0], values)
    return gauss_newton(target, values, free, segments, 4)[0]


def add_blur(target: Target, values: Values, names: Collection[str], segments: Sequence[int]) -> Values:
    """With the blur that is likeliest beside the rest, if any is; then with a second one."""
    best, loss = values, target.loss(values, segments)
    for _ in range(2):
        rivals = [
            fit_blur(target, best, name, segments)
            for name in sorted(of_stage("blur"))
            if name in names and name not in best
        ]
        if not rivals:
            break
        rival, rival_loss = min(rivals, key=lambda each: each[1])
        if rival_loss > loss - max(0.004, 0.01 * loss):
            break
        best, loss = rival, rival_loss
    return best


def fit_blur(target: Target, values: Values, name: str, segments: Sequence[int]) -> tuple[Values, float]:
    """With a blur fitted from the best of its starts, the rest fixed; and the mean loss."""
    few = list(segments)[:2]
    started = best_start(target, values, name, few, starts(name, target.pictures.optics))
    if CAMERA_FITS[name].chart is None:
        return search_factor(target, started, few)
    return gauss_newton(target, started, [name], segments, 4)


def add_light(levels: Sequence[Pictures], values: Values, name: str, segments: Sequence[int]) -> Values:
    """With the likeliest of a shadow's starts beside the rest, if one is: found on small pictures, refined on them."""
    level = levels[min(2, len(levels) - 1)]
    target = rough_target(level, _without_blurs(values))
    before = target.loss(values, segments)
    ends = []
    candidates = starts(name, levels[0].optics)
    losses = torch.tensor([target.loss(dict(values) | {name: each}, segments) for each in candidates])
    grey = [each for each in _coarse(values)[0] if "colour" not in CAMERA_FITS[each].needs]
    light = [name, *(each for each in grey if each in of_stage("light", "tone"))]
    for k in losses.argsort()[:3].tolist():
        ends.append(gauss_newton(target, dict(values) | {name: candidates[k]}, light, segments, 8))
    lit, after = min(ends, key=lambda end: end[1])
    return lit if after < before - _LIGHT_GAIN * min(before, 1.0) else values


def _without_blurs(values: Values) -> Values:
    blurs = of_stage("blur")
    return {name: value for name, value in values.items() if name not in blurs}


def likeliest_kernel(pictures: Pictures, values: Values, names: Collection[str], segments: Sequence[int]) -> str:
    """The kernel by which the recording looks between pixels: the one that predicts best, after a little fitting.

    `values` were fitted under the first: a blur among them may stand in for what another kernel makes of a warp, or
    for a blur among `names` that looks between pixels.
    """
    few, looking, blurs = list(segments)[:2], between(), of_stage("blur")
    if not values.keys() & (looking | blurs):
        return pictures.kernel
    kernels = KERNELS if values.keys() & of_stage("warp") else (KERNELS[0], "bilinear")  # blurs know no others
    bare, blurred = _without_blurs(values), bool(values.keys() & blurs)
    rivals = sorted(set(names) & blurs & looking - values.keys()) if blurred else []

    def loss(kernel: str) -> float:
        target = rough_target(replace(pictures, kernel=kernel), values)
        begun = (values, bare) if blurred else (values,)
        ends = [gauss_newton(target, some, sorted(some.keys() & (looking | blurs)), few, 2) for some in begun]
        return min(end[1] for end in [*ends, *(fit_blur(target, bare, name, few) for name in rivals)])

    losses = {kernel: loss(kernel) for kernel in kernels}
    return min(losses, key=lambda kernel: losses[kernel])


def likeliest_curve(pictures: Pictures, values: Values, segments: Sequence[int]) -> Curve:
    """The curve of the recording's coded values, likewise: sRGB's, unless a power predicts much better."""
    of_light = at_stage(values, "light")
    if pictures.encoding != "srgb" or not of_light:
        return pictures.encoding
    bare = {name: value for name, value in values.items() if name != "gamma"}  # which may make up for the curve

    def loss(curve: Curve, some: Values) -> float:
        moving = [*of_light, *(name for name in some if name in of_stage("tone"))]
        target = rough_target(replace(pictures, encoding=curve), some)
        return gauss_newton(target, some, moving, list(segments)[:2], 3)[1]

    whole = loss("srgb", values)
    for some in (bare, values):
        power = loss("power", some)
        if power < _CURVE_GAIN * loss("srgb", some) and power < whole / _CURVE_GAIN:
            return "power"
    return "srgb"


def informative(pictures: Pictures, most: int) -> list[int]:
    """The frames that show most edges, at most so many, in order."""
    edges = F.avg_pool2d(detail(pictures.sim) * pictures.meant, pictures.sim.shape[-2:]).flatten()
    return sorted(edges.argsort(descending=True)[:most].tolist())
