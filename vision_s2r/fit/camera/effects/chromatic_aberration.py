"""How a lens that bends colours apart is fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, plain

CAMERA_FITS.register(
    "chromatic_aberration",
    CameraFit(
        stage="warp",
        chart=plain(("red", "blue"), lambda optics: [0.3 / optics.width] * 2, [30, 30]),
        along=("radius", "channel"),
        needs=("colour", "edges"),
        coarse=0.5,
        by_channel=True,
        unpaired="without pairs nothing says where a colour's edge should appear",
    ),
)
