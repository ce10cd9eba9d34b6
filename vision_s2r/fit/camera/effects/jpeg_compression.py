"""How JPEG is fitted: pairs show its quality by the grid of its coefficients, which is exact."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit

CAMERA_FITS.register(
    "jpeg_compression",
    CameraFit(
        stage="encoder",
        starts=lambda width: [{"quality": 90.0}],
        unpaired=UnpairedFit(
            starts=lambda width: [{"quality": quality} for quality in (92.0, 80.0, 60.0, 35.0, 15.0)],
            negligible=lambda values, width: False,
            turn=5,
        ),
    ),
)
