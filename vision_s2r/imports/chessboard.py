"""Photographs of a chessboard as a paired recording: beside each, the same board through an ideal pinhole.

Corners and calibration are OpenCV's (Zhang, IEEE PAMI 22(11), 2000); what the lens does is left out of the simulator's
pictures, so that a diagnosis finds it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.imports.photographs import Photograph, grey, photographs

BOARDS = (
    (9, 6),
    (8, 6),
    (8, 5),
    (7, 6),
    (7, 5),
    (10, 7),
    (11, 8),
    (7, 7),
    (6, 5),
    (5, 4),
)  # inner corners, tried in turn
LEAST = 4  # photographs that show the board whole
LOOKED_AT = 3  # photographs, to see which board it is
_SAMPLES = 4  # of a rendered pixel, along each axis
_BACKGROUND = 0.5  # coded value of what is no board
_RIM = 0.3  # squares around the inner corners of which the simulation is meant: some boards' outer squares are cut
_ENOUGH = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)


@dataclass(frozen=True)
class Board:
    """A board in one photograph."""

    photograph: Photograph
    corners: np.ndarray  # [corners, 2] px, row by row


@dataclass(frozen=True)
class Calibration:
    """What OpenCV makes of the corners."""

    matrix: np.ndarray  # [3, 3]
    distortion: np.ndarray  # k1, k2, p1, p2, k3
    rotations: Sequence[np.ndarray]
    translations: Sequence[np.ndarray]
    rms: float  # px


def load(
    folder: Path, inner: Sequence[int]
) -> tuple[list[Photograph], list[np.ndarray], list[np.ndarray], dict[str, Any]]:
    """The photographs that show the board, the simulator's pictures of it, masks, and the header and what was found.

    `inner` is the number of inner corners along the board and across it; where it is empty, common boards are tried.
    Pictures are uint8 [H, W]. Raises UserError where fewer than four photographs show it.
    """
    given = photographs(folder)
    size, boards, missing = _boards(given, inner)
    if len(boards) < LEAST:
        raise UserError(
            f"{folder}: {len(boards)} of {len(given)} photographs show a whole board of {size[0]} x {size[1]} inner "
            f"corners, expected {LEAST} at least (inner=[COLUMNS,ROWS] says what board it is)"
        )
    found = _calibrated(boards, size)
    tones = _tones(boards, found, size)
    pictures = [_rendered(boards[k], found, k, size, tones) for k in range(len(boards))]
    height, width = boards[0].photograph.shape
    matrix = found.matrix
    about = {
        "camera": {
            "width": width,
            "height": height,
            "fx": float(matrix[0, 0]),
            "fy": float(matrix[1, 1]),
            "cx": float(matrix[0, 2]),
            "cy": float(matrix[1, 2]),
        },
        "inner_corners": list(size),
        "rms_px": found.rms,
        "calibration": dict(zip(("k1", "k2", "p1", "p2", "k3"), found.distortion.tolist(), strict=True)),
        "left_out": {path.name: "no whole board is seen" for path in missing},
    }
    kept = [board.photograph for board in boards]
    return kept, [sim for sim, _ in pictures], [mask for _, mask in pictures], about


def _boards(given: Sequence[Photograph], inner: Sequence[int]) -> tuple[tuple[int, int], list[Board], list[Path]]:
    """The board that most photographs show, where they do, and the photographs that do not."""
    if inner and (len(inner) != 2 or min(inner) < 3):
        raise UserError(f"inner is {list(inner)}, expected two numbers of inner corners, at least 3 each: inner=[9,6]")
    tried = [(int(inner[0]), int(inner[1]))] if inner else BOARDS
    first = list(given)[:LOOKED_AT]
    seen = {each: sum(_corners(photograph, each) is not None for photograph in first) for each in tried}
    # A part of a board passes for a whole one, and is seen more often where a picture is small.
    often = [each for each in tried if 2 * seen[each] >= max(seen.values())]
    size = max(often, key=lambda each: each[0] * each[1])
    boards, missing = [], []
    for photograph in given:
        corners = _corners(photograph, size)
        if corners is None:
            missing.append(photograph.path)
        else:
            boards.append(Board(photograph, corners))
    return size, boards, missing


def _corners(photograph: Photograph, size: tuple[int, int]) -> np.ndarray | None:
    picture = grey(photograph)
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_NORMALIZE_IMAGE + cv2.CALIB_CB_FAST_CHECK
    seen, corners = cv2.findChessboardCorners(picture, size, flags=flags)
    if not seen:
        return None
    corners = corners.reshape(-1, 1, 2).astype(np.float32)
    steps = np.linalg.norm(np.diff(corners.reshape(size[1], size[0], 2), axis=1), axis=2)
    reach = int(np.clip(steps.min() / 3, 2, 11))  # no window reaches the next corner
    return cv2.cornerSubPix(picture, corners, (reach, reach), (-1, -1), _ENOUGH).reshape(-1, 2)


def _points(size: tuple[int, int]) -> np.ndarray:
    """The inner corners [corners, 3] in squares."""
    return np.c_[np.mgrid[: size[0], : size[1]].T.reshape(-1, 2), np.zeros(size[0] * size[1])].astype(np.float32)


def _calibrated(boards: Sequence[Board], size: tuple[int, int]) -> Calibration:
    height, width = boards[0].photograph.shape
    rms, matrix, distortion, rotations, translations = cv2.calibrateCamera(
        [_points(size)] * len(boards),
        [board.corners.reshape(-1, 1, 2) for board in boards],
        (width, height),
        None,
        None,
    )
    return Calibration(matrix, distortion.ravel()[:5], rotations, translations, float(rms))


def _tones(boards: Sequence[Board], found: Calibration, size: tuple[int, int]) -> tuple[float, float]:
    """Coded values of the squares of even and of odd number: the medians at their centres in all photographs."""
    across, down = np.meshgrid(np.arange(size[0] - 1) + 0.5, np.arange(size[1] - 1) + 0.5)
    centres = np.c_[across.ravel(), down.ravel(), np.zeros(across.size)]
    odd = (np.floor(across) + np.floor(down)).ravel() % 2 > 0
    values = []
    for k, board in enumerate(boards):
        at, _ = cv2.projectPoints(centres, found.rotations[k], found.translations[k], found.matrix, found.distortion)
        x, y = np.rint(at.reshape(-1, 2)).astype(int).T
        picture = grey(board.photograph)
        values.append(picture[y.clip(0, picture.shape[0] - 1), x.clip(0, picture.shape[1] - 1)] / 255)
    stacked = np.array(values)
    return float(np.median(stacked[:, ~odd])), float(np.median(stacked[:, odd]))


def _rendered(
    board: Board, found: Calibration, k: int, size: tuple[int, int], tones: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """The board through the pinhole, and where it is meant: uint8 [H, W] each."""
    height, width = board.photograph.shape
    turned, _ = cv2.Rodrigues(found.rotations[k])
    to_board = np.linalg.inv(found.matrix @ np.c_[turned[:, :2], found.translations[k].ravel()])
    offsets = (np.arange(_SAMPLES) + 0.5) / _SAMPLES - 0.5
    total, meant = np.zeros((height, width)), np.ones((height, width), bool)
    for dy in offsets:
        for dx in offsets:
            x, y = np.meshgrid(np.arange(width) + dx, np.arange(height) + dy)
            u, v, w = np.tensordot(to_board, np.stack([x, y, np.ones_like(x)]), 1)
            ahead = w * np.sign(to_board[2] @ [*board.corners.mean(0), 1.0]) > 0
            u, v = u / np.where(w == 0, 1, w), v / np.where(w == 0, 1, w)
            outside = np.maximum(np.maximum(-u, u - (size[0] - 1)), np.maximum(-v, v - (size[1] - 1)))
            squares = np.where((np.floor(u) + np.floor(v)) % 2 > 0, tones[1], tones[0])
            light = max(tones) if min(tones) < max(tones) else _BACKGROUND
            value = np.where(outside < 1, squares, np.where(outside < 2, light, _BACKGROUND))
            total += np.where(ahead, value, _BACKGROUND)
            meant &= ahead & (outside < _RIM)
    sim = np.rint(total / _SAMPLES**2 * 255).astype(np.uint8)
    return sim, meant.astype(np.uint8) * np.uint8(255)
