"""How light from one side is fitted: as a vector."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit, polar

CHART = polar("strength", 1.0, lambda optics: [0.02, 0.02], [30, 30])


CAMERA_FITS.register(
    "uneven_illumination",
    CameraFit(
        stage="light",
        chart=CHART,
        along=("region",),
        needs=("light",),
        confusable=frozenset({"cast_shadow"}),
        coarse=0.0,
        unpaired=UnpairedFit(chart=CHART, negligible=lambda values, width: abs(values["strength"]) < 0.01),
    ),
)
