"""Folders of photographs, and what their EXIF says."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

from vision_s2r.errors import UserError

SUFFIXES = (".png", ".jpg", ".jpeg")
_EXIF_IFD, _EXPOSURE, _APERTURE, _ISO, _FOCAL_35 = 0x8769, 0x829A, 0x829D, 0x8827, 0xA405
_FILM_WIDTH = 36.0  # mm, of the format that a 35 mm equivalent refers to


@dataclass(frozen=True)
class Photograph:
    """A picture file as it lies there."""

    path: Path
    pixels: np.ndarray  # uint8 or uint16 [H, W] or [H, W, 3] (BGR)
    exif: Mapping[str, float]  # of exposure_time (s), aperture, iso, focal_35 (mm), those that it has

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width."""
        return self.pixels.shape[0], self.pixels.shape[1]


def photographs(folder: Path) -> list[Photograph]:
    """The pictures of a folder by name. UserError where there are none, or they differ in size."""
    if not folder.is_dir():
        raise UserError(f"{folder}: no such folder, expected photographs in it")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise UserError(f"{folder}: no picture, expected files ending in {', '.join(SUFFIXES)}")
    found = [photograph(path) for path in paths]
    for each in found:
        if each.pixels.shape != found[0].pixels.shape or each.pixels.dtype != found[0].pixels.dtype:
            raise UserError(
                f"{each.path}: {_form(each)}, but {paths[0].name} has {_form(found[0])}, expected the same in all"
            )
    return found


def photograph(path: Path) -> Photograph:
    """A picture file. UserError where it is none."""
    pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if pixels is None or pixels.dtype not in (np.uint8, np.uint16):
        raise UserError(f"{path}: cannot be decoded as a picture of 8 or 16 bits")
    if pixels.ndim == 3:
        pixels = pixels[..., 0] if pixels.shape[2] == 1 else pixels[..., :3]
    return Photograph(path, pixels, _exif(path))


def _form(photograph: Photograph) -> str:
    height, width = photograph.shape
    channels = photograph.pixels.shape[2] if photograph.pixels.ndim == 3 else 1
    return f"{width} x {height} px, {channels} channels of {8 * photograph.pixels.itemsize} bits"


def _exif(path: Path) -> dict[str, float]:
    with Image.open(path) as image:
        ifd = image.getexif().get_ifd(_EXIF_IFD)
    tags = {"exposure_time": _EXPOSURE, "aperture": _APERTURE, "iso": _ISO, "focal_35": _FOCAL_35}
    return {
        name: float(ifd[tag]) for name, tag in tags.items() if isinstance(ifd.get(tag), int | float) or ifd.get(tag)
    }


def grey(photograph: Photograph) -> np.ndarray:
    """uint8 [H, W]."""
    pixels = photograph.pixels
    eight = pixels if pixels.dtype == np.uint8 else (pixels >> 8).astype(np.uint8)
    return np.asarray(cv2.cvtColor(eight, cv2.COLOR_BGR2GRAY) if eight.ndim == 3 else eight)


def camera(found: Sequence[Photograph]) -> dict[str, float] | None:
    """recording.yaml's `camera` that EXIF's focal length proposes, the principal point in the middle; None without."""
    focal = [each.exif["focal_35"] for each in found if each.exif.get("focal_35", 0) > 0]
    if not focal:
        return None
    height, width = found[0].shape
    pixels = float(np.median(focal)) / _FILM_WIDTH * max(height, width)
    return {"width": width, "height": height, "fx": pixels, "fy": pixels, "cx": (width - 1) / 2, "cy": (height - 1) / 2}


def exposures(found: Sequence[Photograph]) -> np.ndarray | None:
    """The light that each photograph let in, EV against the first; None where EXIF does not say."""
    needed = ("exposure_time", "aperture", "iso")
    if not all(all(each.exif.get(name, 0) > 0 for name in needed) for each in found):
        return None
    value = np.array([each.exif["exposure_time"] * each.exif["iso"] / each.exif["aperture"] ** 2 for each in found])
    return np.asarray(np.log2(value / value[0]))


def said(found: Sequence[Photograph]) -> dict[str, Any]:
    """What there is, for people."""
    stops = exposures(found)
    return {
        "photographs": len(found),
        "form": _form(found[0]),
        "exposures": None if stops is None else [round(float(each), 2) for each in stops],
    }
