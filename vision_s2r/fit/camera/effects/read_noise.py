"""How noise that is everywhere the same is fitted: pairs show it by what it adds to a measured noise."""

import math

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, Chart, UnpairedFit

CAMERA_FITS.register(
    "read_noise",
    CameraFit(
        stage="noise",
        starts=lambda width: [{"sigma": 0.01}],
        along=("brightness",),
        needs=("light",),
        confusable=frozenset({"shot_noise"}),
        unpaired=UnpairedFit(
            chart=Chart(
                lambda values: [math.log(max(values["sigma"], 3e-4))],
                lambda point: {"sigma": math.exp(min(max(point[0], -8.1), 0.0))},
                lambda optics: [0.05],
                [20.0],
            ),
            starts=lambda width: [{"sigma": sigma} for sigma in (0.002, 0.006, 0.018, 0.05)],
            negligible=lambda values, width: abs(values["sigma"]) < 1e-3,
            turn=0,
            confusable=frozenset({"shot_noise"}),
        ),
    ),
)
