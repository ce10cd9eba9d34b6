"""The reference: every effect that moves the mean of a picture, fitted together, from coarse to fine.

It is no answer, since it names too much. It is where the fits of single answers start, and what a recording's noise
is measured about.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import torch
import torch.nn.functional as F

from vision_s2r.fit.camera.elimination import without_idle
from vision_s2r.fit.camera.fitting import Target, best_start, gauss_newton, search_factor, starts
from vision_s2r.fit.camera.prediction import BLURS, WARPS, Pictures
from vision_s2r.fit.camera.resampling import KERNELS
from vision_s2r.fit.camera.weighing import detail
from vision_s2r.fit.case import Values

GEOMETRY = ("camera_pose_offset", "lens_distortion")
LIGHT = ("uneven_illumination", "vignetting", "exposure", "white_balance", "gamma")
_NEUTRAL: dict[str, dict[str, float]] = {
    "camera_pose_offset": {"yaw": 0.0, "pitch": 0.0, "roll": 0.0},
    "lens_distortion": {"k1": 0.0, "k2": 0.0},
    "chromatic_aberration": {"red": 0.0, "blue": 0.0},
    "uneven_illumination": {"strength": 0.0, "angle": 0.0},
    "vignetting": {"strength": 0.0},
    "exposure": {"stops": 0.0},
    "white_balance": {"red": 1.0, "blue": 1.0},
    "gamma": {"gamma": 1.0},
}
_COARSEST = 28  # px, of the shorter side
_SHADOW_GAIN = 0.02  # by which a shadow must lower the mean loss to stay


def pyramid(pictures: Pictures) -> list[Pictures]:
    """The pictures, then each at half the size of the one before, down to about 30 px."""
    levels = [pictures]
    while min(levels[-1].sim.shape[-2:]) >= 2 * _COARSEST:
        levels.append(levels[-1].half())
    return levels


def rough_target(pictures: Pictures, values: Values) -> Target:
    """A target whose noise is not known: so much everywhere, and more where the picture is busy."""
    level = 3.0 / 255 * (pictures.scale + 0.2)
    variance = level**2 + (0.1 * detail(pictures.real)).square()
    counted = pictures.seen(values, range(len(pictures.sim)))
    return Target(pictures, variance, counted)


def coarse(levels: Sequence[Pictures], names: Collection[str], start: Values, segments: Sequence[int]) -> Values:
    """Geometry and light among `names`, with no start of their own, fitted on pictures from small to half size."""
    values = dict(start)
    fresh = [name for name in (*GEOMETRY, *LIGHT) if name in names]
    values |= {name: dict(_NEUTRAL[name]) for name in fresh if name not in values}
    if "lens_distortion" in fresh and "lens_distortion" not in start:
        values = dict(_bent(levels[-1], values, fresh, segments))
    for level in reversed(levels[1:]):
        moving = fresh
        if "chromatic_aberration" in names and level.scale == 0.5:
            values.setdefault("chromatic_aberration", dict(_NEUTRAL["chromatic_aberration"]))
            moving = [*fresh, "chromatic_aberration"]
        for _ in range(2):  # what is seen depends on what is fitted
            target = rough_target(level, {name: value for name, value in values.items() if name not in BLURS})
            values = dict(gauss_newton(target, values, moving, segments, 5)[0])
    return values


def _bent(level: Pictures, values: Values, names: Sequence[str], segments: Sequence[int]) -> Values:
    """The likeliest of several bends of the lens, each with the rest fitted a little."""
    corner_squared = float(
        (level.sim.shape[-1] / 2 / level.intrinsics[0]) ** 2 + (level.sim.shape[-2] / 2 / level.intrinsics[1]) ** 2
    )
    ends = []
    for bend in (0.0, -0.12, 0.12):  # of the corner's radius
        trial = dict(values) | {"lens_distortion": {"k1": max(min(bend / corner_squared, 1.0), -1.0), "k2": 0.0}}
        target = rough_target(level, trial)
        ends.append(gauss_newton(target, trial, names, segments, 6))
    return min(ends, key=lambda end: end[1])[0]


def fit_reference(levels: Sequence[Pictures], names: Collection[str], fixed: Values, segments: Sequence[int]) -> Values:
    """All of `names` that move the mean, fitted together on these segments of the pyramid, beside what is `fixed`."""
    values = dict(coarse(levels, names, fixed, segments))
    if len(levels) > 1:
        values = dict(without_idle(rough_target(levels[1], values), values, segments, fixed))
    smooth = [name for name in values if name not in fixed]
    target = rough_target(levels[0], values)
    values = dict(gauss_newton(target, values, smooth, segments, 2)[0])
    values = dict(add_blur(target, values, names, segments))
    if "cast_shadow" in names:
        values = dict(add_shadow(levels, values, segments))
    free = [name for name in values if name not in fixed]
    target = rough_target(levels[0], values)
    return gauss_newton(target, values, free, segments, 4)[0]


def add_blur(target: Target, values: Values, names: Collection[str], segments: Sequence[int]) -> Values:
    """With the blur that is likeliest beside the rest, if any is; then with a second one."""
    best, loss = values, target.loss(values, segments)
    for _ in range(2):
        rivals = [
            fit_blur(target, best, name, segments) for name in sorted(BLURS) if name in names and name not in best
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
    started = best_start(target, values, name, few, starts(name, target.pictures.optics.width))
    if name == "low_resolution":
        return search_factor(target, started, few)
    return gauss_newton(target, started, [name], segments, 4)


def add_shadow(levels: Sequence[Pictures], values: Values, segments: Sequence[int]) -> Values:
    """With the likeliest shadow beside the rest, if one is: found on small pictures, refined on them."""
    level = levels[min(2, len(levels) - 1)]
    target = rough_target(level, {name: value for name, value in values.items() if name not in BLURS})
    before = target.loss(values, segments)
    width = levels[0].optics.width
    ends = []
    candidates = starts("cast_shadow", width)
    losses = torch.tensor([target.loss(dict(values) | {"cast_shadow": each}, segments) for each in candidates])
    light = [
        "cast_shadow",
        *[name for name in ("uneven_illumination", "vignetting", "exposure", "gamma") if name in values],
    ]
    for k in losses.argsort()[:3].tolist():
        ends.append(gauss_newton(target, dict(values) | {"cast_shadow": candidates[k]}, light, segments, 8))
    shadowed, after = min(ends, key=lambda end: end[1])
    return shadowed if after < before - _SHADOW_GAIN * min(before, 1.0) else values


def likeliest_kernel(pictures: Pictures, values: Values, segments: Sequence[int]) -> str:
    """The kernel of the recording's warps: that under which they predict best, after a little fitting."""
    warps = [name for name in values if name in WARPS]
    if not warps:
        return pictures.kernel
    ends = {}
    for kernel in KERNELS:
        target = rough_target(replace(pictures, kernel=kernel), values)
        ends[kernel] = gauss_newton(target, values, warps, list(segments)[:2], 2)[1]
    return min(ends, key=lambda kernel: ends[kernel])


def informative(pictures: Pictures, most: int) -> list[int]:
    """The frames that show most edges, at most so many, in order."""
    edges = F.avg_pool2d(detail(pictures.sim) * pictures.meant, pictures.sim.shape[-2:]).flatten()
    return sorted(edges.argsort(descending=True)[:most].tolist())
