"""Pictures of what a policy saw and chose."""

import base64

import cv2
import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.scene import arm

TILE = 128  # px: pictures are enlarged by a whole factor to about this
FRAME = 3  # px
LABEL = 110  # px, left of a strip
SUCCESS, FAILURE, NEUTRAL, INK = (46, 160, 67), (218, 54, 51), (208, 215, 222), (255, 0, 200)  # RGB
GRASP_HEIGHT = 0.02  # m over the floor: about where the fingers meet an object
SUBPIXEL = 4  # bits of a coordinate's fraction that OpenCV draws with


def project(points: np.ndarray, intrinsics: np.ndarray, extrinsics: np.ndarray) -> np.ndarray:
    """Pixels [K, 2] of world points [K, 3]; intrinsics [4], extrinsics [4, 4] (world to camera)."""
    x, y, z = (points @ extrinsics[:3, :3].T + extrinsics[:3, 3]).T
    fx, fy, cx, cy = intrinsics
    return np.stack([fx * x / z + cx, fy * y / z + cy], axis=1)


def grasp_lines(grasp: np.ndarray) -> np.ndarray:
    """World segments [3, 2, 3] of a grasp (x, y, yaw): the closing axis between the open fingers, and both fingers."""
    x, y, yaw = grasp
    along = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0]) * arm.FINGER_SIZE[1] / 2
    left, right = along * arm.MAX_OPENING, -along * arm.MAX_OPENING
    segments = [[left, right], [left - across, left + across], [right - across, right + across]]
    return np.array([x, y, GRASP_HEIGHT]) + np.array(segments)


def tile(
    picture: np.ndarray,
    intrinsics: np.ndarray,
    extrinsics: np.ndarray,
    grasp: np.ndarray | None = None,
    success: bool | None = None,
) -> np.ndarray:
    """The picture [H, W, 3], enlarged, with the grasp over it and framed green or red: uint8 RGB."""
    scale = max(1, round(TILE / len(picture)))
    drawn = np.repeat(np.repeat(picture, scale, axis=0), scale, axis=1)
    if grasp is not None:
        ends = project(grasp_lines(grasp).reshape(-1, 3), intrinsics, extrinsics).reshape(3, 2, 2)
        ends = (ends + 0.5) * scale - 0.5  # centres of pixels lie at integers in both
        for segment, width in zip(ends, (1, 3, 3), strict=True):
            start, end = (tuple(int(v) for v in np.round(point * 2**SUBPIXEL)) for point in segment)
            cv2.line(drawn, start, end, INK, width, cv2.LINE_AA, SUBPIXEL)
    colour = NEUTRAL if success is None else SUCCESS if success else FAILURE
    return cv2.copyMakeBorder(drawn, FRAME, FRAME, FRAME, FRAME, cv2.BORDER_CONSTANT, value=colour)


def strip(tiles: list[np.ndarray]) -> np.ndarray:
    """Tiles side by side with a gap, uint8 [H, W, 3]."""
    gap = np.full((len(tiles[0]), 2 * FRAME, 3), 255, np.uint8)
    return np.concatenate([part for each in tiles for part in (each, gap)][:-1], axis=1)


def sheet(strips: dict[str, np.ndarray]) -> np.ndarray:
    """Strips [H, W, 3] of the same size under each other, their labels to the left: uint8 RGB."""
    rows = []
    for label, picture in strips.items():
        margin = np.full((len(picture) + 2 * FRAME, LABEL, 3), 255, np.uint8)
        for line, word in enumerate(label.split("_")):
            cv2.putText(margin, word, (4, 24 + 18 * line), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (40, 40, 40), 1, cv2.LINE_AA)
        wide = cv2.copyMakeBorder(picture, FRAME, FRAME, 0, FRAME, cv2.BORDER_CONSTANT, value=(255, 255, 255))
        rows.append(np.concatenate([margin, wide], axis=1))
    return np.concatenate(rows)


def png(picture: np.ndarray) -> bytes:
    """uint8 RGB [H, W, 3] as a PNG file."""
    done, encoded = cv2.imencode(".png", picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 6])
    if not done:
        raise UserError(f"a picture of shape {picture.shape} cannot be encoded as PNG")
    return encoded.tobytes()


def data_uri(picture: np.ndarray) -> str:
    """The picture as PNG inside an address, for a page that stands alone."""
    return "data:image/png;base64," + base64.b64encode(png(picture)).decode()
