"""Procedural texture families: those that training draws, others to tune on, and those of the "real" appearance.

A bank is a folder of PNG files in the cache, made once: PyBullet reads textures from files only.
"""

import hashlib
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from vision_s2r.errors import UserError, nearest
from vision_s2r.scene.cache import cache

VERSION = 3  # part of a bank's name: raise it when a family changes
Texture = np.ndarray  # float [S, S, 3] in [0, 1]
Family = Callable[[np.random.Generator, int], Texture]


def chosen(names: Sequence[str]) -> dict[str, Family]:
    """The families of these names, of those that training draws or that are held out; none: all that training draws.

    Raises UserError for another name; the real look's are another.
    """
    known = RANDOMIZED | HELD_OUT
    for name in names:
        if name not in known:
            raise UserError(f"scene.appearance.families: no family '{name}' for training, {nearest(name, known)}")
    return {name: known[name] for name in names} if names else RANDOMIZED


def bank(families: dict[str, Family], count: int, size: int, seed: int) -> list[Path]:
    """`count` textures of size x size pixels, the families in turn, as PNG files; made if not yet there."""
    key = hashlib.sha256(repr((VERSION, sorted(families), count, size, seed)).encode()).hexdigest()[:16]
    folder = cache() / f"textures-{key}"
    names = list(families)
    paths = [folder / f"{k:04d}-{names[k % len(names)]}.png" for k in range(count)]
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(dir=folder.parent))
        for k, path in enumerate(paths):
            rng = np.random.default_rng([seed, k])
            picture = families[names[k % len(names)]](rng, size)
            cv2.imwrite(str(temporary / path.name), np.round(picture.clip(0, 1) * 255).astype(np.uint8)[..., ::-1])
        try:
            temporary.rename(folder)
        except OSError:  # another process was first; its bank is the same
            shutil.rmtree(temporary)
    return paths


def _colours(rng: np.random.Generator, count: int) -> np.ndarray:
    """Colours [count, 3] over the whole cube."""
    return rng.uniform(0.05, 1, size=(count, 3))


def _blend(mask: np.ndarray, first: np.ndarray, second: np.ndarray) -> Texture:
    return mask[..., None] * first + (1 - mask[..., None]) * second


def _grid(size: int) -> tuple[np.ndarray, np.ndarray]:
    axis = np.arange(size) / size
    return np.meshgrid(axis, axis)


def _noise(rng: np.random.Generator, size: int, octaves: int, stretch: tuple[int, int] = (1, 1)) -> np.ndarray:
    """Smooth value noise [S, S] in [0, 1], tileable, stretched by whole numbers along (x, y)."""
    total = np.zeros((size, size))
    for octave in range(octaves):
        cells = 2 ** (octave + 2)
        shape = (max(cells // stretch[1], 1), max(cells // stretch[0], 1))
        lattice = np.pad(rng.uniform(size=shape), 2, mode="wrap").astype(np.float32)
        full = cv2.resize(
            lattice,
            (round(size * lattice.shape[1] / shape[1]), round(size * lattice.shape[0] / shape[0])),
            interpolation=cv2.INTER_CUBIC,
        )
        top, left = round(2 * size / shape[0]), round(2 * size / shape[1])
        total += full[top : top + size, left : left + size] / 2**octave
    low, high = total.min(), total.max()
    return (total - low) / (high - low + 1e-9)


def _flat(rng: np.random.Generator, size: int) -> Texture:
    return np.tile(_colours(rng, 1)[0], (size, size, 1))


def _gradient(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    angle = rng.uniform(0, 2 * np.pi)
    wave = 0.5 + 0.5 * np.sin(2 * np.pi * (np.round(np.cos(angle) * 2) * x + np.round(np.sin(angle) * 2) * y))
    return _blend(wave, *_colours(rng, 2))


def _checker(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    a, b = rng.integers(2, 9, size=2) * 2
    mask = (np.floor(x * a) + np.floor(y * b)) % 2
    return _blend(mask, *_colours(rng, 2))


def _stripes(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    a, b = rng.integers(-8, 9, size=2)
    mask = ((a * x + (b if a or b else 5) * y) % 1 < rng.uniform(0.2, 0.8)).astype(float)
    return _blend(mask, *_colours(rng, 2))


def _dots(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    count = rng.integers(2, 8)
    distance = np.hypot((x * count) % 1 - 0.5, (y * count) % 1 - 0.5)
    return _blend((distance < rng.uniform(0.15, 0.45)).astype(float), *_colours(rng, 2))


def _clouds(rng: np.random.Generator, size: int) -> Texture:
    return _blend(_noise(rng, size, int(rng.integers(1, 5))), *_colours(rng, 2))


def _colour_noise(rng: np.random.Generator, size: int) -> Texture:
    octaves = int(rng.integers(1, 4))
    return np.stack([_noise(rng, size, octaves) for _ in range(3)], axis=-1)


def _cells(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    sites = rng.uniform(size=(rng.integers(6, 30), 2))
    dx = np.abs(x[..., None] - sites[:, 0])
    dy = np.abs(y[..., None] - sites[:, 1])
    nearest = np.hypot(np.minimum(dx, 1 - dx), np.minimum(dy, 1 - dy)).argmin(axis=-1)
    return _colours(rng, len(sites))[nearest]


def _speckle(rng: np.random.Generator, size: int) -> Texture:
    mask = (rng.uniform(size=(size, size)) < rng.uniform(0.05, 0.5)).astype(float)
    return _blend(mask, *_colours(rng, 2))


def _rings(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    distance = np.hypot(x - 0.5, y - 0.5) * rng.integers(2, 8)
    return _blend((distance % 1 < 0.5).astype(float), *_colours(rng, 2))


def _threshold(rng: np.random.Generator, size: int) -> Texture:
    mask = (_noise(rng, size, int(rng.integers(1, 4))) > rng.uniform(0.35, 0.65)).astype(float)
    return _blend(mask, *_colours(rng, 2))


PLAIN: dict[str, Family] = {
    "flat": _flat,
    "gradient": _gradient,
    "checker": _checker,
    "stripes": _stripes,
    "dots": _dots,
    "clouds": _clouds,
    "colour_noise": _colour_noise,
    "cells": _cells,
    "speckle": _speckle,
    "rings": _rings,
    "threshold": _threshold,
}


def _plain(rng: np.random.Generator, size: int) -> Texture:
    """Of any plain family."""
    return list(PLAIN.values())[rng.integers(len(PLAIN))](rng, size)


def _collage(rng: np.random.Generator, size: int) -> Texture:
    """Pieces of some textures laid on another, one over the other (dead leaves: Lee, Mumford and Huang 2001)."""
    page = _plain(rng, size)
    sheets = [_plain(rng, size) for _ in range(rng.integers(1, 4))]
    for _ in range(rng.integers(2, 16)):
        piece = np.zeros((size, size), np.uint8)
        centre, reach = rng.uniform(0, size, size=2), rng.uniform(0.05, 0.3) * size
        corners = rng.integers(3, 9)
        turns = np.sort(rng.uniform(0, 2 * np.pi, size=corners))
        if rng.uniform() < 0.5:  # a rectangle
            turns = rng.uniform(0, np.pi) + np.array([-1, 1, np.pi - 1, np.pi + 1]) * rng.uniform(0.2, 1)
        outline = centre + reach * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        cv2.fillPoly(piece, [np.round(outline).astype(np.int32)], 1)
        page = np.where(piece[..., None] > 0, sheets[rng.integers(len(sheets))], page)
    return page


def _patchwork(rng: np.random.Generator, size: int) -> Texture:
    """Fields of some textures beside each other."""
    rows, columns = rng.integers(2, 9, size=2)
    sheets = np.stack([_plain(rng, size) for _ in range(rng.integers(2, 5))])
    x, y = _grid(size)
    which = rng.integers(len(sheets), size=(rows, columns))[(y * rows).astype(int), (x * columns).astype(int)]
    return np.take_along_axis(sheets, which[None, ..., None], axis=0)[0]


def _mixture(rng: np.random.Generator, size: int) -> Texture:
    """Two textures, one showing through the other."""
    mask = _noise(rng, size, int(rng.integers(1, 4)))
    sharp = 10 ** rng.uniform(0, 1.5)
    return _blend((0.5 + sharp * (mask - rng.uniform(0.3, 0.7))).clip(0, 1), _plain(rng, size), _plain(rng, size))


def _muted(rng: np.random.Generator, size: int) -> Texture:
    """A texture with little contrast and little colour."""
    picture = _plain(rng, size) if rng.uniform() < 0.5 else _mixture(rng, size)
    grey = picture.mean(axis=-1, keepdims=True)
    dull = grey + rng.uniform(0, 0.6) * (picture - grey)
    tone = rng.uniform(0.15, 0.9) + rng.uniform(-0.1, 0.1, size=3)
    return tone + rng.uniform(0.1, 0.6) * (dull - dull.mean())


def _warped(rng: np.random.Generator, size: int) -> Texture:
    """A texture, drawn out of shape."""
    x, y = _grid(size)
    reach = rng.uniform(0.05, 0.4)
    places = [axis + reach * _noise(rng, size, int(rng.integers(1, 4))) for axis in (x, y)]
    across, down = ((place % 1 * size).astype(int) for place in places)
    return _plain(rng, size)[down, across]


def _spectrum(rng: np.random.Generator, size: int) -> Texture:
    """Noise whose heights have several colours."""
    colours = _colours(rng, int(rng.integers(3, 7)))
    height = _noise(rng, size, int(rng.integers(1, 6))) * (len(colours) - 1)
    return np.stack([np.interp(height, np.arange(len(colours)), channel) for channel in colours.T], axis=-1)


RANDOMIZED: dict[str, Family] = PLAIN | {
    "collage": _collage,
    "patchwork": _patchwork,
    "mixture": _mixture,
    "muted": _muted,
    "warped": _warped,
    "spectrum": _spectrum,
}


def _bricks(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    rows = int(rng.integers(2, 6)) * 2
    row = np.floor(y * rows)
    across = (x * rows / 2 + 0.5 * (row % 2)) % (rows // 2)
    joint = (y * rows % 1 < 0.15) | (across % 1 < 0.08)
    stones = _colours(rng, 1)[0] * rng.uniform(0.7, 1.2, size=(rows, rows // 2, 1))
    return np.where(joint[..., None], _colours(rng, 1)[0], stones[row.astype(int), across.astype(int)])


def _plaid(rng: np.random.Generator, size: int) -> Texture:
    bands = int(rng.integers(4, 9))
    threads = np.repeat(_colours(rng, bands), rng.integers(1, size // 4, size=bands), axis=0)
    threads = np.resize(threads, (size, 3))
    return (threads[None] + threads[:, None]) / 2


def _confetti(rng: np.random.Generator, size: int) -> Texture:
    page = np.tile(_colours(rng, 1)[0], (size, size, 1))
    for colour in _colours(rng, int(rng.integers(10, 60))):
        top, left = rng.integers(0, size, size=2)
        height, width = rng.integers(2, size // 6, size=2)
        page[top : top + height, left : left + width] = colour
    return page


def _contours(rng: np.random.Generator, size: int) -> Texture:
    height = _noise(rng, size, int(rng.integers(1, 4))) * rng.integers(3, 9)
    return _blend((height % 1 < rng.uniform(0.1, 0.3)).astype(float), *_colours(rng, 2))


def _scribble(rng: np.random.Generator, size: int) -> Texture:
    page = np.tile(_colours(rng, 1)[0], (size, size, 1))
    for colour in _colours(rng, int(rng.integers(1, 4))):
        line = np.cumsum(rng.normal(0, size / 12, size=(60, 2)), axis=0) + rng.uniform(0, size, size=2)
        cv2.polylines(page, [np.round(line % size).astype(np.int32)], False, colour.tolist(), int(rng.integers(1, 3)))
    return page


# Never trained on unless they are asked for by name: a look to tune on that is not the one that is tested.
HELD_OUT: dict[str, Family] = {
    "bricks": _bricks,
    "plaid": _plaid,
    "confetti": _confetti,
    "contours": _contours,
    "scribble": _scribble,
}


def _wood(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    warp = _noise(rng, size, 3, (1, 4)) - 0.5
    grain = 0.5 + 0.5 * np.sin(2 * np.pi * (rng.integers(3, 9) * x + 1.5 * warp + 0.3 * np.sin(2 * np.pi * y)))
    fibre = _noise(rng, size, 5, (1, 8))
    dark, light = np.array([0.36, 0.22, 0.11]), np.array([0.80, 0.62, 0.40])
    tone = rng.uniform(0.7, 1.15)
    return _blend((0.65 * grain + 0.35 * fibre) ** 1.2, light * tone, dark * tone)


def _cloth(rng: np.random.Generator, size: int) -> Texture:
    x, y = _grid(size)
    threads = size // rng.integers(3, 6)
    over = (np.floor(x * threads) + np.floor(y * threads) * rng.integers(1, 3)) % 2
    relief = np.where(over, np.sin(np.pi * (x * threads % 1)), np.sin(np.pi * (y * threads % 1)))
    warp, weft = _colours(rng, 2) * 0.7
    shade = (0.55 + 0.45 * relief) * (0.85 + 0.3 * _noise(rng, size, 3))
    return _blend(over, warp, weft) * shade[..., None]


def _brushed_metal(rng: np.random.Generator, size: int) -> Texture:
    streaks = 0.6 * _noise(rng, size, 5, (8, 1)) + 0.4 * rng.uniform(size=(size, 1))
    base = rng.uniform(0.45, 0.75) * np.array([1, 1, 1.04])
    return base * (0.7 + 0.5 * streaks[..., None])


def _print(rng: np.random.Generator, size: int) -> Texture:
    """A printed page: lines of words, a picture block, a headline."""
    page = np.ones((size, size, 3)) * rng.uniform(0.8, 0.97)
    line = int(rng.integers(3, 6))
    ink = rng.uniform(0, 0.25, size=3)
    for top in range(1, size - line, line):
        left = 1
        while left < size - 2:
            width = int(rng.integers(2, 9))
            page[top : top + max(line - 2, 1), left : min(left + width, size - 1)] = ink
            left += width + 2
    top, left = rng.integers(0, size // 2, size=2)
    height, width = rng.integers(size // 5, size // 2, size=2)
    block = page[top : top + height, left : left + width]
    block[:] = _blend(_noise(rng, size, 3), *_colours(rng, 2))[: block.shape[0], : block.shape[1]]
    return page


def _cardboard(rng: np.random.Generator, size: int) -> Texture:
    x, _ = _grid(size)
    flutes = 0.5 + 0.5 * np.sin(2 * np.pi * x * (size // 8))
    tone = np.array([0.72, 0.55, 0.37]) * rng.uniform(0.8, 1.1)
    fibre = _noise(rng, size, 5, (4, 1))
    return tone * (0.82 + 0.06 * flutes[..., None] + 0.22 * fibre[..., None])


def _stone(rng: np.random.Generator, size: int) -> Texture:
    vein = np.abs(_noise(rng, size, 5) - 0.5) * 2
    light, dark = rng.uniform(0.65, 0.95, size=3), rng.uniform(0.15, 0.45, size=3)
    return _blend(vein**0.45, light, dark) * (0.9 + 0.2 * rng.uniform(size=(size, size, 1)))


REAL: dict[str, Family] = {
    "wood": _wood,
    "cloth": _cloth,
    "brushed_metal": _brushed_metal,
    "print": _print,
    "cardboard": _cardboard,
    "stone": _stone,
}
