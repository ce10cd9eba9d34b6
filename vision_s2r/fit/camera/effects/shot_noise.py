"""How noise that grows with the light is fitted: pairs show it by what it adds to a measured noise."""

import math

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, Chart, UnpairedFit

CAMERA_FITS.register(
    "shot_noise",
    CameraFit(
        stage="noise",
        starts=lambda width: [{"full_well": 1000.0}],
        along=("brightness",),
        needs=("light",),
        unpaired=UnpairedFit(
            chart=Chart(
                lambda values: [math.log(values["full_well"])],
                lambda point: {"full_well": math.exp(min(max(point[0], 0.0), 20.0))},
                lambda optics: [0.1],
                [20.0],
            ),
            starts=lambda width: [{"full_well": well} for well in (3e4, 5e3, 800.0, 150.0, 40.0)],
            negligible=lambda values, width: values["full_well"] > 2e5,
            turn=1,
        ),
    ),
)
