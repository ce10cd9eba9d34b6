"""How a lens that bends lines is fitted."""

from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, Optics, Setting, plain


def bends(optics: Optics) -> list[Setting]:
    """Lenses that move the corner by an eighth of its distance, and none."""
    squared = optics.corner**2
    return [{"k1": max(min(bend / squared, 1.0), -1.0), "k2": 0.0} for bend in (0.0, -0.12, 0.12)]


CAMERA_FITS.register(
    "lens_distortion",
    CameraFit(
        stage="warp",
        chart=plain(
            ("k1", "k2"),
            lambda optics: [0.2 / optics.focal / optics.corner**3, 0.2 / optics.focal / optics.corner**5],
            [60, 60],
        ),
        along=("radius",),
        needs=("edges",),
        coarse=0.0,
        bends=bends,
        otherwise=0.05,  # more terms of the radius, and elements that are not quite centred
        unpaired="without pairs nothing says which lines are straight",
    ),
)
