"""What cameras do that the library of effects does not hold: the unknown of generated recordings.

Each kind is a function (strength in (0, 1], generator) -> (stage, step): where in the camera it happens, and what it
does there, the same at every call. Kinds for tuning and for reporting are disjoint.
"""

from collections.abc import Callable

import numpy as np

from vision_s2r.gapbench.generate import camera_unknown_optics as optics
from vision_s2r.gapbench.generate import camera_unknown_processing as processing
from vision_s2r.gapbench.generate import camera_unknown_sensor as sensor
from vision_s2r.gapbench.generate.camera_effects import Stage

Kind = Callable[[float, np.random.Generator], tuple[str, Stage]]

UNKNOWN: dict[str, tuple[Kind, ...]] = {
    "tuning": (
        sensor.row_banding,
        optics.ghost_reflection,
        processing.posterization,
        optics.bloom,
        sensor.colour_crosstalk,
        sensor.salt_and_pepper,
        optics.tangential_distortion,
        processing.sharpening_halo,
        processing.tone_curve,
        optics.lens_dirt,
        optics.aspect_ratio,
        sensor.black_level,
        sensor.line_jitter,
        sensor.column_gains,
        sensor.dark_current,
        optics.lens_breathing,
        optics.field_curvature,
        optics.mechanical_vignetting,
        processing.denoising,
        processing.auto_exposure,
        processing.local_tone_mapping,
        sensor.fixed_pattern_noise,
        optics.spherical_aberration,
        sensor.lamp_drift,
        optics.astigmatism,
        sensor.uneven_shutter,
        optics.greasy_cover,
        sensor.still_bands,
        sensor.blooming,
        sensor.charge_diffusion,
        processing.colour_smear,
        sensor.image_lag,
        optics.coma,
        optics.approaching_camera,
    ),
    "reporting": (
        optics.tilted_sensor,
        optics.axial_colour,
        sensor.dead_pixels,
        optics.veiling_glare,
        optics.rolling_shutter_skew,
        sensor.interlacing,
        processing.hue_clipping,
        optics.local_warping,
        sensor.bayer_demosaicing,
        sensor.temporal_flicker,
        sensor.moire,
        optics.frame_jitter,
        optics.lens_flare,
        optics.heat_haze,
        sensor.ccd_smear,
        sensor.mains_banding,
        sensor.sensor_dust,
        processing.auto_white_balance,
        processing.chroma_subsampling,
        processing.temporal_denoising,
        optics.turning_camera,
        optics.drops,
        processing.lost_blocks,
    ),
}

# Those that statistics of two sets without a scene in common can show: no warps, nothing that stays at its place, and
# nothing that exposure, gamma, colour, falloff and blurs imitate to first order but for a third
SHOWN_BY_SETS: dict[str, tuple[Kind, ...]] = {
    "tuning": (
        sensor.row_banding,
        processing.posterization,
        optics.bloom,
        sensor.colour_crosstalk,
        sensor.salt_and_pepper,
        processing.sharpening_halo,
        sensor.column_gains,
        optics.mechanical_vignetting,
        processing.denoising,
        optics.ghost_reflection,
    ),
    "reporting": (
        sensor.interlacing,
        processing.hue_clipping,
        sensor.moire,
        optics.coma,
        optics.lens_flare,
        sensor.ccd_smear,
        sensor.mains_banding,
        processing.chroma_subsampling,
        sensor.dead_pixels,
        optics.axial_colour,
    ),
}
