"""How motion blur is fitted: as a vector whose opposite is the same."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, UnpairedFit, polar

CHART = polar("length", 2.0, lambda optics: [0.12 * optics.pixel] * 2, [20, 20])

CAMERA_FITS.register(
    "motion_blur",
    CameraFit(
        stage="blur",
        chart=CHART,
        starts=lambda width: [
            {"length": length, "angle": angle}
            for length in (2.0, 5.0, 11.0)
            for angle in (0.0, 30.0, 60.0, 90.0, 120.0, 150.0)
        ],
        along=("frequency",),
        needs=("edges",),
        between=True,
        confusable=frozenset({"low_resolution"}),
        faint=lambda values: values["length"] < 1.1,
        unpaired=UnpairedFit(
            chart=CHART,
            starts=lambda width: [
                {"length": r, "angle": float(a)} for r in (2.0, 4.5, 10.0, 17.0) for a in range(0, 180, 30)
            ],
            negligible=lambda values, width: abs(values["length"]) < 0.4,
            turn=4,
            confusable=frozenset({"low_resolution"}),
        ),
    ),
)
