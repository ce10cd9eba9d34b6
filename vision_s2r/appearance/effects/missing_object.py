"""Something stands in the real pictures that was not rendered."""

from collections.abc import Mapping

from torch import Tensor

from vision_s2r.appearance.effect import APPEARANCE_EFFECTS, AppearanceEffect, Scene
from vision_s2r.effects import Parameter

_FAR = 100_000.0  # px, beyond any picture


@APPEARANCE_EFFECTS.register
class MissingObject(AppearanceEffect):
    """A rectangle of the picture, from its upper left corner, that shows something else in every frame.

    What it shows is no part of the effect: here it is a surface of the frame's mean color.
    """

    name = "missing_object"
    order = 90
    labelled = False
    parameters = (
        Parameter("x", "px", low=0.0, high=_FAR, neutral=None, moderate=48.0),
        Parameter("y", "px", low=0.0, high=_FAR, neutral=None, moderate=48.0),
        Parameter("width", "px", low=0.0, high=_FAR, neutral=0.0, moderate=24.0),
        Parameter("height", "px", low=0.0, high=_FAR, neutral=0.0, moderate=24.0),
    )

    def apply(self, light: Tensor, values: Mapping[str, float], scene: Scene, region: Tensor) -> Tensor:
        rows, columns = rectangle(values)
        shown = light.clone()
        shown[..., rows, columns] = light.mean((2, 3), keepdim=True)
        return shown


def rectangle(values: Mapping[str, float], scale: float = 1.0) -> tuple[slice, slice]:
    """Rows and columns of the area, in pictures of `scale` times the size that its pixels are of."""

    def along(start: str, extent: str) -> slice:
        first, last = (scale * each for each in (values[start], values[start] + values[extent]))
        return slice(round(first), round(last))

    return along("y", "height"), along("x", "width")
