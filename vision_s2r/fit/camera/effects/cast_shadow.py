"""How a shadow's edge is fitted: found among many on small pictures, then moved."""

import math

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, Chart, Setting

KEYS = ("strength", "offset", "angle")


def starts(width: int) -> list[Setting]:
    """Shadows from all sides, over less and more of the picture, of hard and soft edges."""
    return [
        {"strength": 0.3, "offset": offset * width, "angle": angle, "softness": softness * width}
        for angle in range(0, 360, 45)
        for offset in (-0.25, 0.0, 0.25)
        for softness in (0.03, 0.12)
    ]


CAMERA_FITS.register(
    "cast_shadow",
    CameraFit(
        stage="light",
        chart=Chart(
            lambda values: [*(values[key] for key in KEYS), math.log(values["softness"])],
            lambda point: dict(zip(KEYS, point, strict=False)) | {"softness": math.exp(min(max(point[3], -4.6), 6.9))},
            lambda optics: [0.02, 0.004 * optics.width, 1.0, 0.06],
            [15, 40, 25, 15],
        ),
        starts=starts,
        along=("region",),
        needs=("light",),
        confusable=frozenset({"exposure"}),  # of a shadow over all of the picture
        unpaired="without pairs a soft shadow cannot be told from a scene's own light",
    ),
)
