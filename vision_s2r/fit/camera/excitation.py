"""What a recording cannot show, and which effects pass for each other."""

from collections.abc import Iterable, Mapping

import torch

from vision_s2r.fit.camera.prediction import BLURS, NOISES, WARPS, Pictures
from vision_s2r.fit.camera.weighing import detail

_CONFUSABLE: tuple[frozenset[str], ...] = (
    frozenset({"defocus_blur", "low_resolution", "motion_blur"}),
    frozenset({"gamma", "exposure"}),
    frozenset({"read_noise", "shot_noise"}),
    frozenset({"uneven_illumination", "cast_shadow"}),
    frozenset({"vignetting", "cast_shadow"}),
    frozenset({"camera_pose_offset", "lens_distortion"}),
)
_EDGE = 6 / 255  # how far an edge stands out
_DARK = 0.02  # coded value below which there is no light to change
_RANGE = 0.08  # coded values that a tone curve must span to be told from an exposure


def confusable(name: str) -> frozenset[str]:
    """Effects that are hard to tell from this one when it is weak."""
    return frozenset(rival for group in _CONFUSABLE if name in group for rival in group) - {name}


def faint_blur(name: str, values: Mapping[str, float]) -> bool:
    """Whether this is a blur no stronger than the difference of two interpolation kernels."""
    limits = {"defocus_blur": ("radius", 0.72), "motion_blur": ("length", 1.1), "low_resolution": ("factor", 1.08)}
    if name not in limits:
        return False
    key, limit = limits[name]
    return values[key] < limit


def not_excited(pictures: Pictures, names: Iterable[str]) -> dict[str, str]:
    """Those of `names` that these pictures could not show, with the reason."""
    meant = pictures.meant > 0.5
    edges = detail(pictures.sim)[meant]
    brightness = pictures.sim.mean(1, keepdim=True)[meant]
    reasons: dict[str, str] = {}
    if pictures.sim.shape[1] == 1:
        reasons |= dict.fromkeys(("white_balance", "chromatic_aberration"), "the pictures have no colour")
    if float((edges > _EDGE).float().mean()) < 0.005:
        reasons |= dict.fromkeys(sorted(WARPS | BLURS), "the pictures have no edges")
    low, high = (float(torch.quantile(_few(brightness), q)) for q in (0.02, 0.98))
    if high < _DARK:
        light = ("uneven_illumination", "cast_shadow", "vignetting", "exposure", "white_balance", "gamma")
        reasons |= dict.fromkeys(light, "the pictures are black")
        reasons |= dict.fromkeys(sorted(NOISES), "the pictures are black")
    elif high - low < _RANGE:
        reasons["gamma"] = "the pictures have one brightness only"
    return {name: reasons[name] for name in names if name in reasons}


def _few(values: torch.Tensor) -> torch.Tensor:
    return values[:: max(len(values) // 100_000, 1)]
