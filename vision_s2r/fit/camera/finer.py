"""Warps of photographs, fitted once more on finer pictures than those that were worked on.

Small pictures are averages of what the simulator drew, warped; a photograph's pixels are averages of what was warped.
A pixel of the small ones is several of the recording's, and a lens that bends things by no more than a few of these
is off by a tenth there.
"""

from collections.abc import Sequence
from dataclasses import replace

from vision_s2r.fit.camera.effect import CAMERA_FITS, at_stage
from vision_s2r.fit.camera.fitting import gauss_newton
from vision_s2r.fit.camera.light import STEADY, FrameLight
from vision_s2r.fit.camera.prediction import Pictures
from vision_s2r.fit.camera.reference import pyramid, rough_target
from vision_s2r.fit.case import Values

_VALUES = 1_500_000  # of grey pictures, that are looked at, at most
_ITERATIONS = 8


def with_finer_warps(whole: Pictures, worked: Pictures, values: Values) -> Values:
    """`values` with their warps moved to the likeliest on the finest of the `whole` pictures that are not too many.

    As they are where those are no finer than the `worked` ones. Grey tells where things are, and of light that differs
    between frames the most that they may have of their own is none of a warp's.
    """
    grey = [name for name in values if "colour" not in CAMERA_FITS[name].needs]
    moving = at_stage(grey, "warp")
    pictures = _finest(whole, worked.scale) if moving else None
    if pictures is None:
        return values
    if worked.light != STEADY:
        pictures = replace(pictures, light=FrameLight("field"))
    begun = {name: values[name] for name in at_stage(grey, "warp", "light", "blur", "tone")}
    found, _ = gauss_newton(rough_target(pictures, begun), begun, moving, range(len(pictures.sim)), _ITERATIONS)
    return dict(values) | {name: found[name] for name in moving}


def _finest(whole: Pictures, scale: float) -> Pictures | None:
    sim, real = (each.mean(1, keepdim=True) for each in (whole.sim, whole.real))
    levels: Sequence[Pictures] = pyramid(replace(whole, sim=sim, real=real, surfaces=None))
    finer = (level for level in levels if level.scale > scale and level.sim.numel() <= _VALUES)
    return next(finer, None)
