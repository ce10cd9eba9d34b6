"""How the direction of the light is fitted: in stereographic projection, smooth but where it shines from behind."""

import math

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, Chart, EffectValues, Point, Setting


def inward(values: EffectValues) -> Point:
    """Its place in the projection: 0 where it shines along the view, on the unit circle where across it."""
    reach = math.tan((math.pi / 2 - values["elevation"]) / 2)
    return [reach * math.cos(values["azimuth"]), reach * math.sin(values["azimuth"])]


def outward(point: Point) -> Setting:
    """The inverse."""
    return {
        "azimuth": math.atan2(point[1], point[0]),
        "elevation": math.pi / 2 - 2 * math.atan(math.hypot(*point)),
    }


CAMERA_FITS.register(
    "light_direction",
    CameraFit(
        stage="scene",
        chart=Chart(inward, outward, lambda optics: [0.02, 0.02], [20, 20], 2 * math.pi),
        starts=lambda width: [
            {"azimuth": turn * math.pi / 4, "elevation": rise}
            for rise in (-0.2, 0.15, 0.5, 0.9, 1.3)
            for turn in range(-3, 5)
        ],
        needs=("light", "directions"),
        confusable=frozenset({"ambient"}),
        coarse=0.0,
        unpaired="without pairs light cannot be told from what is in the pictures",
    ),
)
