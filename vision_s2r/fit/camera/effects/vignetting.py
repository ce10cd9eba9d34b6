"""How dark corners are fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit, plain

CHART = plain(("strength",), lambda optics: [0.02], [30])

CAMERA_FITS.register(
    "vignetting",
    CameraFit(
        stage="light",
        chart=CHART,
        along=("radius",),
        needs=("light",),
        confusable=frozenset({"cast_shadow"}),
        coarse=0.0,
        unpaired=UnpairedFit(
            chart=CHART,
            negligible=lambda values, width: abs(values["strength"]) < 0.01,
        ),
    ),
)
