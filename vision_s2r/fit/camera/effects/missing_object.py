"""How an area that shows something else is fitted: as where most frames are far from what was rendered."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit

CAMERA_FITS.register(
    "missing_object",
    CameraFit(
        stage="area",
        starts=lambda width: [{"x": 0.4 * width, "y": 0.4 * width, "width": 0.2 * width, "height": 0.2 * width}],
        needs=("light",),
        unpaired="without pairs what a picture shows is not known",
    ),
)
