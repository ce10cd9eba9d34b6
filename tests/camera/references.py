"""Each camera effect a second time, one picture at a time, in NumPy, OpenCV or Pillow.

A picture here is float64 [H, W, 3] in [0, 1], coded. Intrinsics are fx, fy, cx, cy.
"""

import io
import math
from collections.abc import Callable

import cv2
import numpy as np
from PIL import Image

Picture = np.ndarray
_BORDER = 24  # OpenCV 5 fills the outside of bicubic warps with black whatever is asked: pad first


def linear(coded: Picture) -> Picture:
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def coded(light: Picture) -> Picture:
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


def _camera_matrix(intrinsics: Picture) -> Picture:
    fx, fy, cx, cy = intrinsics
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def _remap(picture: Picture, x: Picture, y: Picture) -> Picture:
    wide = cv2.copyMakeBorder(picture, *[_BORDER] * 4, borderType=cv2.BORDER_REPLICATE)
    maps = (x + _BORDER).astype(np.float32), (y + _BORDER).astype(np.float32)
    return cv2.remap(wide, *maps, cv2.INTER_CUBIC)


def _grid(picture: Picture) -> tuple[Picture, Picture]:
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]].astype(np.float64)
    return x, y


def _along(picture: Picture, angle: float) -> Picture:
    x, y = _grid(picture)
    a = math.radians(angle)
    dx, dy = x - (picture.shape[1] - 1) / 2, y - (picture.shape[0] - 1) / 2
    return (dx * math.cos(a) + dy * math.sin(a))[..., None]


def camera_pose_offset(picture: Picture, intrinsics: Picture, yaw: float, pitch: float, roll: float) -> Picture:
    matrix = _camera_matrix(intrinsics)
    homography = matrix @ cv2.Rodrigues(np.array([pitch, yaw, roll]))[0] @ np.linalg.inv(matrix)
    x, y = _grid(picture)
    points = np.stack([x, y], -1).reshape(-1, 1, 2)
    source = cv2.perspectiveTransform(points, np.linalg.inv(homography)).reshape(*x.shape, 2)
    return _remap(picture, source[..., 0], source[..., 1])


def uneven_illumination(picture: Picture, intrinsics: Picture, strength: float, angle: float) -> Picture:
    return coded(linear(picture) * (1 + strength * _along(picture, angle) / (picture.shape[1] / 2)))


def cast_shadow(
    picture: Picture, intrinsics: Picture, strength: float, offset: float, angle: float, softness: float
) -> Picture:
    shade = 1 / (1 + np.exp(-(_along(picture, angle) - offset) / softness))
    return coded(linear(picture) * (1 - strength * shade))


def lens_distortion(picture: Picture, intrinsics: Picture, k1: float, k2: float) -> Picture:
    matrix = _camera_matrix(intrinsics)
    x, y = _grid(picture)
    points = np.stack([x, y], -1).reshape(-1, 1, 2)
    stop = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    source = cv2.undistortPoints(points, matrix, np.array([k1, k2, 0, 0]), P=matrix, criteria=stop)
    source = source.reshape(*x.shape, 2)
    return _remap(picture, source[..., 0], source[..., 1])


def chromatic_aberration(picture: Picture, intrinsics: Picture, red: float, blue: float) -> Picture:
    cx, cy = intrinsics[2:]
    x, y = _grid(picture)
    channels = [
        _remap(picture[..., i], (x - cx) * (1 + value) + cx, (y - cy) * (1 + value) + cy)
        for i, value in enumerate((red, 0.0, blue))
    ]
    return np.stack(channels, -1)


def vignetting(picture: Picture, intrinsics: Picture, strength: float) -> Picture:
    squared = _along(picture, 0) ** 2 + _along(picture, 90) ** 2
    return coded(linear(picture) * (1 - strength * squared / squared.max()))


def defocus_blur(picture: Picture, intrinsics: Picture, radius: float) -> Picture:
    fine = 41
    reach = math.ceil(radius) + 1
    position = (np.arange((2 * reach + 1) * fine) + 0.5) / fine - reach - 0.5
    inside = position[:, None] ** 2 + position**2 <= radius**2
    kernel = inside.reshape(2 * reach + 1, fine, 2 * reach + 1, fine).mean((1, 3))
    return cv2.filter2D(picture, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REPLICATE)


def motion_blur(picture: Picture, intrinsics: Picture, length: float, angle: float) -> Picture:
    x, y = _grid(picture)
    a = math.radians(angle)
    steps = (np.arange(301) + 0.5) / 301 - 0.5
    moved = [_remap(picture, x + s * length * math.cos(a), y + s * length * math.sin(a)) for s in steps]
    return np.mean(moved, axis=0)


def low_resolution(picture: Picture, intrinsics: Picture, factor: float) -> Picture:
    height, width = picture.shape[:2]
    small = cv2.resize(picture, (round(width / factor), round(height / factor)), interpolation=cv2.INTER_AREA)
    return cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)


def exposure(picture: Picture, intrinsics: Picture, stops: float) -> Picture:
    return coded(linear(picture) * 2**stops)


def white_balance(picture: Picture, intrinsics: Picture, red: float, blue: float) -> Picture:
    return picture * np.array([red, 1, blue])


def gamma(picture: Picture, intrinsics: Picture, gamma: float) -> Picture:
    return picture**gamma


def jpeg_compression(picture: Picture, intrinsics: Picture, quality: float) -> Picture:
    code = io.BytesIO()
    Image.fromarray(np.round(picture * 255).astype(np.uint8)).save(
        code, "JPEG", quality=int(quality), subsampling="4:2:0"
    )
    return np.asarray(Image.open(code)) / 255


REFERENCES: dict[str, Callable[..., Picture]] = {
    function.__name__: function
    for function in (
        camera_pose_offset,
        uneven_illumination,
        cast_shadow,
        lens_distortion,
        chromatic_aberration,
        vignetting,
        defocus_blur,
        motion_blur,
        low_resolution,
        exposure,
        white_balance,
        gamma,
        jpeg_compression,
    )
}
