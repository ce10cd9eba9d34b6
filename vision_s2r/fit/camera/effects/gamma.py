"""How the exponent of a tone curve is fitted."""

import math

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit, logarithmic

CHART = logarithmic(("gamma",), lambda optics: [0.01], [40])

CAMERA_FITS.register(
    "gamma",
    CameraFit(
        stage="tone",
        chart=CHART,
        along=("brightness",),
        needs=("light", "contrast"),
        confusable=frozenset({"exposure"}),
        coarse=0.0,
        unpaired=UnpairedFit(
            chart=CHART,
            negligible=lambda values, width: abs(math.log(values["gamma"])) < 0.004,
            confusable=frozenset({"exposure"}),
        ),
    ),
)
