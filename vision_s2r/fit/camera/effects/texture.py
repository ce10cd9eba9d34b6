"""How the grain of a label is fitted: it has no mean, so by how what is left of the label is correlated."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit

CAMERA_FITS.register(
    "texture",
    CameraFit(
        stage="grain",
        starts=lambda width: [{"amplitude": 0.1, "scale": 6.0}],
        along=("class",),
        needs=("light",),
        unpaired="without pairs the grain of a label cannot be told from what is in the pictures",
    ),
)
