"""How a pose that differs is fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, plain

CAMERA_FITS.register(
    "camera_pose_offset",
    CameraFit(
        stage="warp",
        chart=plain(
            ("yaw", "pitch", "roll"),
            lambda optics: [0.2 / optics.focal, 0.2 / optics.focal, 0.4 / optics.width],
            [40, 40, 40],
        ),
        needs=("edges",),
        confusable=frozenset({"lens_distortion"}),
        coarse=0.0,
        unpaired="without pairs nothing says where a thing should appear",
    ),
)
