"""What a recording cannot show."""

from collections.abc import Iterable

import torch

from vision_s2r.fit.camera.coordinates import at_scale
from vision_s2r.fit.camera.effect import CAMERA_FITS, NEEDS, between
from vision_s2r.fit.camera.prediction import Pictures
from vision_s2r.fit.camera.weighing import detail
from vision_s2r.fit.case import Values

_EDGE = 6 / 255  # how far an edge stands out
_DARK = 0.02  # coded value below which there is no light to change
_BETWEEN = 0.05  # of the pixels, that a third brightness must have
_RANGE = 0.08  # coded values that a tone curve must span to be told from an exposure


def faint(name: str, values: Values, scale: float) -> bool:
    """Whether this is a blur no stronger than the difference of two kernels by which another looks between pixels."""
    found = CAMERA_FITS[name].faint
    if found is None or not between() & values.keys() - {name}:
        return False
    return found(at_scale(name, values[name], scale))


def not_excited(pictures: Pictures, names: Iterable[str]) -> dict[str, str]:
    """Those of `names` that these pictures could not show, with the reason."""
    meant = pictures.meant > 0.5
    edges = detail(pictures.sim)[meant]
    brightness = pictures.sim.mean(1, keepdim=True)[meant]
    lacking = set()
    if pictures.sim.shape[1] == 1:
        lacking.add("colour")
    if float((edges > _EDGE).float().mean()) < 0.005:
        lacking.add("edges")
    low, high = (float(torch.quantile(_few(brightness), q)) for q in (0.02, 0.98))
    if high < _DARK:
        lacking.add("light")
    elif high - low < _RANGE:
        lacking.add("contrast")
    needs = {name: [need for need in CAMERA_FITS[name].needs if need in lacking] for name in names}
    return {name: NEEDS[missing[-1]].lacking for name, missing in needs.items() if missing}


def two_toned(pictures: Pictures) -> bool:
    """Whether nearly all that is meant has one of two brightnesses, as a board has: no tone between them is seen."""
    meant = (pictures.meant > 0.5) & (detail(pictures.sim) < _EDGE)
    values = _few(pictures.sim.mean(1, keepdim=True)[meant])
    if not len(values):
        return False
    low, high = values.quantile(0.1), values.quantile(0.9)
    between = (values > low + 0.2 * (high - low)) & (values < high - 0.2 * (high - low))
    return float(between.float().mean()) < _BETWEEN


def _few(values: torch.Tensor) -> torch.Tensor:
    return values[:: max(len(values) // 100_000, 1)]
