"""How an exposure is fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit, plain

CHART = plain(("stops",), lambda optics: [0.02], [60])

CAMERA_FITS.register(
    "exposure",
    CameraFit(
        stage="light",
        chart=CHART,
        along=("brightness",),
        needs=("light",),
        coarse=0.0,
        unpaired=UnpairedFit(
            chart=CHART,
            negligible=lambda values, width: abs(values["stops"]) < 0.01,
            confusable=frozenset({"vignetting"}),
        ),
    ),
)
