"""The class of a pixel, read from a picture of the canonical look."""

import numpy as np

from vision_s2r.scene import CLASSES
from vision_s2r.scene.appearance import CANONICAL_COLOURS, CANONICAL_LIGHT

SHADES = (CANONICAL_LIGHT.ambient, CANONICAL_LIGHT.ambient + CANONICAL_LIGHT.diffuse)  # of a colour, in shade and light


def classes_of(picture: np.ndarray) -> np.ndarray:
    """Class ids int64 [..., H, W] of a picture uint8 [..., H, W, 3]: places in `vision_s2r.scene.CLASSES`.

    A pixel is of the class whose colour, in the shade that suits the pixel best, is nearest to it in RGB. In true
    canonical pictures that is the segmentation itself, pixel for pixel.
    """
    pixels = picture.astype(np.float32)[..., None, :] / 255
    colours = np.array([CANONICAL_COLOURS[name] for name in CLASSES], np.float32)
    shade = np.clip((pixels * colours).sum(-1) / np.square(colours).sum(-1), *SHADES)
    shaded = np.minimum(shade[..., None] * colours, 1)
    nearest: np.ndarray = np.square(pixels - shaded).sum(-1).argmin(-1)
    return nearest
