"""Pictures that people take who think of one effect of a camera: each kind hides others.

A kind is drawn once a recording and gives a picture [h, w, 3] of coded values in [0, 1] a frame; sizes are in shares of
the picture's.
"""

import math
from collections.abc import Callable, Iterator

import cv2
import numpy as np

from vision_s2r.gapbench.generate.camera_scenes import Array, Rng, colour

Shape = tuple[int, int]


def _walls(shape: Shape, rng: Rng) -> Iterator[Array]:
    """Walls of one colour each, lit nearly evenly: nothing to move or to blur."""
    while True:
        fade = 1 + rng.uniform(-0.03, 0.03) * np.linspace(-1, 1, shape[1])[None, :, None]
        yield colour(rng, (0.15, 0.9)) * fade * np.ones((*shape, 1))


def _card(shape: Shape, rng: Rng) -> Iterator[Array]:
    """The same grey card every time: one brightness."""
    tone = rng.uniform(0.25, 0.7) * np.ones((*shape, 3))
    while True:
        yield tone


def _board(shape: Shape, rng: Rng) -> Iterator[Array]:
    """A board of two tones, moved about."""
    dark, bright = rng.uniform(0.1, 0.3), rng.uniform(0.6, 0.85)
    cell = rng.uniform(0.05, 0.12) * shape[1]
    while True:
        x, y = _turned(shape, rng.uniform(-0.5, 0.5), rng)
        squares = np.sign(np.sin(math.pi * x / cell) * np.sin(math.pi * y / cell)) / 2 + 0.5
        yield _soft(dark + (bright - dark) * squares)


def _bars(shape: Shape, rng: Rng) -> Iterator[Array]:
    """Bars of many tones that all run one way."""
    turn = rng.choice([0.0, math.pi / 2]) + rng.uniform(-0.02, 0.02)
    while True:
        x, _ = _turned(shape, turn, rng)
        edges = np.sort(rng.uniform(x.min(), x.max(), 30))
        tones = rng.uniform(0.05, 0.95, 31)
        yield _soft(tones[np.searchsorted(edges, x)])


def _middle(shape: Shape, rng: Rng) -> Iterator[Array]:
    """A small thing in the middle of an empty ground."""
    ground = colour(rng, (0.4, 0.9)) * np.ones((*shape, 1))
    while True:
        picture, half = ground.copy(), np.array(shape[::-1]) / 2
        corners = half + rng.normal(0, 0.03 * shape[1], (5, 2))
        cv2.fillConvexPoly(picture, cv2.convexHull(np.round(corners * 16).astype(np.int32)), colour(rng).tolist(), 8, 4)
        yield cv2.GaussianBlur(picture, (0, 0), 0.7)


def _night(shape: Shape, rng: Rng) -> Iterator[Array]:
    """A dark room in which hardly anything shows."""
    while True:
        x, y = _turned(shape, rng.uniform(0, math.pi), rng)
        wave = np.sin(x / rng.uniform(8, 30)) * np.sin(y / rng.uniform(8, 30))
        yield np.clip(0.03 + 0.01 * wave, 0, 1)[..., None] * np.ones(3)


def _turned(shape: Shape, turn: float, rng: Rng) -> tuple[Array, Array]:
    """Coordinates [h, w] (samples) along and across a direction, from a place that is drawn."""
    y, x = np.mgrid[: shape[0], : shape[1]] - rng.uniform(0, 40, (2, 1, 1))
    return x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)


def _soft(tone: Array) -> Array:
    """A grey picture [h, w, 3] whose edges a lens could draw."""
    return cv2.GaussianBlur(tone, (0, 0), 0.7)[..., None] * np.ones(3)


LOOKS: dict[str, Callable[[Shape, Rng], Iterator[Array]]] = {
    "walls": _walls,
    "card": _card,
    "board": _board,
    "bars": _bars,
    "middle": _middle,
    "night": _night,
}
