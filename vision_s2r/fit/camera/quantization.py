"""JPEG's grid: the coefficients of a picture that went through it are multiples of its quantizer's steps."""

import functools
import io

import cv2
import numpy as np
from PIL import Image

_SPREAD = 0.45  # standard deviation that rounding to whole pixels leaves around the grid, in units of a coefficient
_BLOCKS = 600  # looked at, at most
_CERTAIN = 60.0  # nats


def jpeg_quality(pictures: np.ndarray) -> tuple[int, float] | None:
    """The quality of the JPEG that pictures [N, H, W, 3] in [0, 1] went through, and its evidence in nats; or None.

    Luminance alone is looked at, of blocks that nowhere reach black or white, where clipping bends the grid.
    """
    coefficients = _coefficients(np.rint(pictures.astype(np.float32) * 255))
    if len(coefficients) < 8:
        return None
    evidence = np.array([_evidence(coefficients, luminance_steps(quality)) for quality in range(1, 101)])
    best = int(evidence.argmax())
    if evidence[best] < _CERTAIN:
        return None
    return best + 1, float(evidence[best])


@functools.cache
def luminance_steps(quality: int) -> np.ndarray:
    """libjpeg's quantization steps [64] of luminance, row by row: those that it writes itself."""
    stream = io.BytesIO()
    Image.new("L", (8, 8)).save(stream, "JPEG", quality=quality)
    with Image.open(stream) as image:
        tables: dict[int, list[int]] = image.quantization  # type: ignore[attr-defined]
    return np.array(tables[0], np.float32)


def _coefficients(pictures: np.ndarray) -> np.ndarray:
    """Cosine coefficients [blocks, 64] of the luminance of unclipped 8 x 8 blocks, spread over the pictures."""
    count, height, width = pictures.shape[:3]
    pictures = pictures[:, : height // 8 * 8, : width // 8 * 8]
    luminance = pictures @ np.array([0.299, 0.587, 0.114], np.float32) - 128

    def blocks(planes: np.ndarray) -> np.ndarray:
        return planes.reshape(count, height // 8, 8, width // 8, 8).swapaxes(2, 3).reshape(-1, 8, 8)

    whole = (blocks(pictures.min(-1)).min((1, 2)) > 0) & (blocks(pictures.max(-1)).max((1, 2)) < 255)
    chosen = blocks(luminance)[whole]
    busy = chosen.std((1, 2)) > 2
    chosen = chosen[busy] if busy.sum() >= 8 else chosen
    chosen = chosen[:: max(len(chosen) // _BLOCKS, 1)]
    cosines = cv2.dct(np.eye(8, dtype=np.float32), flags=cv2.DCT_ROWS).T
    return (cosines @ chosen @ cosines.T).reshape(-1, 64)


def _evidence(coefficients: np.ndarray, steps: np.ndarray) -> float:
    """Log-likelihood of the grid of these steps [64] against none, over coefficients that are not its zero."""
    steps = steps.astype(np.float32)
    usable = steps >= 2
    coefficients, steps = coefficients[:, usable], steps[usable]
    off = coefficients - np.rint(coefficients / steps) * steps
    far = np.abs(coefficients) > steps / 2
    # A twentieth of anything, for a block that was clipped on the way.
    near = np.exp(-0.5 * (off / _SPREAD) ** 2) / (_SPREAD * np.sqrt(2 * np.pi))
    ratio = np.log(0.95 * near * steps + 0.05)
    return float(ratio[far].sum())
