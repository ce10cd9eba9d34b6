"""How the gains of red and blue are fitted."""

import math

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit, logarithmic

CHART = logarithmic(("red", "blue"), lambda optics: [0.01, 0.01], [40, 40])

CAMERA_FITS.register(
    "white_balance",
    CameraFit(
        stage="tone",
        chart=CHART,
        along=("channel",),
        needs=("colour", "light"),
        coarse=0.0,
        unpaired=UnpairedFit(
            chart=CHART,
            negligible=lambda values, width: all(abs(math.log(value)) < 0.004 for value in values.values()),
        ),
    ),
)
