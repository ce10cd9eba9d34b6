"""Which surfaces and lights seem to differ: found one by one beside the camera's own light, on small pictures.

A camera acts on all labels alike. Where every label had its own gain, an exposure would be told as well by all of them
together; so a label is only given one where what the labels share does not explain it.
"""

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.appearance import APPEARANCE_EFFECTS
from vision_s2r.fit.camera.coordinates import neutral, starts
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, at_stage
from vision_s2r.fit.camera.elimination import without_idle
from vision_s2r.fit.camera.fitting import Target, gauss_newton
from vision_s2r.fit.camera.prediction import Pictures, without_encoder
from vision_s2r.fit.camera.reference import rough_target
from vision_s2r.fit.case import Values

_WORTH = 0.004  # nats a pixel that an effect must bring to be looked at
_BESIDE = ("exposure", "white_balance", "gamma", "vignetting", "uneven_illumination", "camera_pose_offset")
_STARTED = 3  # settings of an effect that it is fitted from
_FACING = 0.05  # of the change that another light makes, that normals from depth in mm get wrong
_MIXED = 0.3  # of the difference between two labels' changes, that is not known of a pixel which both share


def appearing(levels: Sequence[Pictures], names: Sequence[str], segments: Sequence[int]) -> Values:
    """Those effects of the scene among `names` that bring most, and are not told better by the camera's; fitted."""
    level = levels[-1]
    waiting = at_stage(names, "scene")
    if not waiting or level.surfaces is None:
        return {}
    camera: Values = {name: neutral(name, level.optics) for name in _BESIDE if name in names}
    target = rough_target(level, {})
    found, least = _fitted(target, camera, None, segments)
    chosen: list[str] = []
    while waiting:
        ends = {name: _fitted(target, _restarted(target, camera, found, chosen), name, segments) for name in waiting}
        best = min(ends, key=lambda name: ends[name][1])
        if ends[best][1] > least - _WORTH:
            break
        found, least = ends[best]
        chosen.append(best)
        waiting.remove(best)
    return {name: found[name] for name in chosen}


def _restarted(target: Target, camera: Values, found: Values, chosen: Sequence[str]) -> Values:
    """What the camera does forgotten, since it may have stood in for a surface; what surfaces do kept."""
    return dict(camera) | {name: found.get(name, neutral(name, target.pictures.optics)) for name in chosen}


def _fitted(target: Target, values: Values, name: str | None, segments: Sequence[int]) -> tuple[Values, float]:
    """`values` and one effect more, fitted together; and the mean loss with a price for every effect that matters."""
    if name is not None:
        begun = [{**values, name: setting} for setting in starts(name, target.pictures.optics)]
        likely = sorted(begun, key=lambda each: target.loss(each, segments))[:_STARTED]
        values = min((gauss_newton(target, each, [name], segments, 5) for each in likely), key=lambda end: end[1])[0]
    values, loss = gauss_newton(target, values, list(values), segments, 8)
    return values, loss + _WORTH / 2 * len(without_idle(target, values, segments))


def mixed(pictures: Pictures, values: Values, segments: Sequence[int]) -> Tensor:
    """The variance [B, 1, H, W] of pixels that two labels share, or surfaces that face apart, where effects change one.

    A renderer gives a pixel to one of them; a picture is of both. Which way a surface faces is known to a degree or
    two.
    """
    surfaces, scene = pictures.surfaces, at_stage(values, "scene")
    unknown = torch.zeros_like(pictures.sim[list(segments), :1])
    if surfaces is None or not scene:
        return unknown
    mean = pictures.predict(without_encoder(values), segments).mean
    for own in (True, False):
        there = [name for name in scene if APPEARANCE_EFFECTS[name].labelled == own]
        if there:
            rest = {name: value for name, value in values.items() if name not in there}
            change = mean - pictures.predict(without_encoder(rest), segments).mean
            spread = (F.max_pool2d(change, 3, 1, 1) + F.max_pool2d(-change, 3, 1, 1)).amax(1, keepdim=True)
            unknown = unknown + (_MIXED * spread * (surfaces.borders(segments) if own else 1)).square()
            if not own:
                unknown = unknown + (_FACING * change).square().amax(1, keepdim=True)
    return unknown


def camera_only(names: Sequence[str]) -> list[str]:
    """Those of `names` that are the camera's."""
    return [name for name in names if CAMERA_FITS[name].stage not in ("scene", *APART)]
