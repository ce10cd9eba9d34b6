"""How defocus is fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit, plain

CHART = plain(("radius",), lambda optics: [0.06 * optics.pixel], [20])

CAMERA_FITS.register(
    "defocus_blur",
    CameraFit(
        stage="blur",
        chart=CHART,
        starts=lambda width: [{"radius": radius} for radius in (0.8, 1.4, 2.4, 4.0, 7.0)],
        along=("frequency",),
        needs=("edges",),
        confusable=frozenset({"low_resolution", "motion_blur"}),
        faint=lambda values: values["radius"] < 0.72,
        unpaired=UnpairedFit(
            chart=CHART,
            starts=lambda width: [{"radius": radius} for radius in (0.8, 1.3, 2.2, 3.6, 6.0)],
            negligible=lambda values, width: abs(values["radius"]) < 0.55,  # a disk within its pixel is no blur
            turn=3,
            confusable=frozenset({"low_resolution", "motion_blur"}),
        ),
    ),
)
