"""How a coarser sensor is fitted: its effect goes by whole cells, which are counted out."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit

CAMERA_FITS.register(
    "low_resolution",
    CameraFit(
        stage="blur",
        starts=lambda width: [{"factor": factor} for factor in (1.15, 1.35, 1.6, 2.0, 2.6, 3.4, 4.5, 6.5)],
        along=("frequency",),
        needs=("edges",),
        faint=lambda values: values["factor"] < 1.08,
        sized=True,
        unpaired=UnpairedFit(
            starts=lambda width: [
                {"factor": width / round(width / factor)} for factor in (1.1, 1.3, 1.6, 2.0, 2.6, 3.4, 4.5, 6.5)
            ],
            negligible=lambda values, width: round(width / values["factor"]) >= width,
            turn=2,
        ),
    ),
)
