"""How the share of light without direction is fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, plain

CAMERA_FITS.register(
    "ambient",
    CameraFit(
        stage="scene",
        chart=plain(("share",), lambda optics: [0.02], [20]),
        starts=lambda width: [{"share": share} for share in (0.15, 0.4, 0.7)],
        needs=("light", "directions"),
        coarse=0.0,
        unpaired="without pairs light cannot be told from what is in the pictures",
    ),
)
