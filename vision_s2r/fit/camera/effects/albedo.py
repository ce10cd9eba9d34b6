"""How the colour of a label is fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, logarithmic

CAMERA_FITS.register(
    "albedo",
    CameraFit(
        stage="scene",
        chart=logarithmic(("red", "green", "blue"), lambda optics: [0.02] * 3, [60] * 3),
        starts=lambda width: [
            {"red": red, "green": green, "blue": blue}
            for red, green, blue in (
                (1.0, 1.0, 1.0),
                (0.5, 0.5, 0.5),
                (2.0, 2.0, 2.0),
                (1.5, 1.0, 0.7),
                (0.7, 1.0, 1.5),
            )
        ],
        along=("class",),
        needs=("colour", "light", "other labels"),
        coarse=0.0,
        unpaired="without pairs a colour cannot be told from what is in the pictures",
    ),
)
