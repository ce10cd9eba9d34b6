"""Pictures that a simulator might have rendered: tables with solids in true perspective and shadow, clutter, towers
against the sky, print. Drawn at several samples a pixel, so that edges and textures are a camera's and not a raster's.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

Array = np.ndarray
Rng = np.random.Generator

BACKDROP, TABLE, PRISM, BALL = range(4)  # labels of a table's picture; the other scenes have none
_TILE = 192  # side of a texture
_GRAIN = 512  # no picture is larger


@dataclass(frozen=True)
class SyntheticScene:
    """What the scenes of one recording share: its textures, its light, how bright it is."""

    textures: list[Array]  # [_TILE, _TILE, 3] coded
    surface: int  # which of them is the table's
    light: Array  # towards the lamp, unit length; x right, y away, z up
    ambient: float
    gain: float
    grain: Array  # [_GRAIN, _GRAIN], faint roughness of everything
    solids: tuple[int, int] = (5, 12)  # how many stand on a table: from, below
    size: float = 1.0  # of these, a factor
    pitch: tuple[float, float] = (0.55, 1.45)  # rad, at which a camera looks down on them


@dataclass(frozen=True)
class Lens:
    """A pinhole above the table: image points of points [n, 3] of the world."""

    position: Array
    rotation: Array  # world to camera, OpenCV axes
    focal: float
    centre: tuple[float, float]

    def project(self, points: Array) -> Array:
        """[n, 2] float64 samples of the picture."""
        rays = (np.atleast_2d(points) - self.position) @ self.rotation.T
        return rays[:, :2] / np.maximum(rays[:, 2:], 1e-3) * self.focal + np.array(self.centre)


def world(rng: Rng) -> SyntheticScene:
    """A world of its own: five textures, a lamp, a brightness."""
    turn, height = rng.uniform(0, 2 * np.pi), rng.uniform(0.6, 1.3)
    light = np.array([math.cos(turn) * math.cos(height), math.sin(turn) * math.cos(height), math.sin(height)])
    gain, grain = math.exp(rng.uniform(-0.6, 0.6)), 1 + 0.05 * (fractal(rng, _GRAIN, 1.0) - 0.5)
    return SyntheticScene(
        [texture(rng) for _ in range(5)], int(rng.integers(5)), light, rng.uniform(0.25, 0.5), gain, grain
    )


def draw(scene: str, world: SyntheticScene, shape: tuple[int, int], focal: float, rng: Rng) -> tuple[Array, Array]:
    """A picture [h, w, 3] of coded values in [0, 1] and its labels [h, w] uint8; `focal` in samples."""
    picture, labels = SCENES[scene](world, shape, focal, rng)
    grain = np.roll(world.grain, rng.integers(_GRAIN, size=2), (0, 1))[: shape[0], : shape[1], None]
    picture = picture * (world.gain * grain)
    picture = cv2.GaussianBlur(np.clip(picture, 0, None), (0, 0), rng.uniform(0.5, 0.9))
    return np.clip(picture, 0, 1), labels


# -- textures --------------------------------------------------------------------------------------------------------


def fractal(rng: Rng, size: int, exponent: float) -> Array:
    """Noise [size, size] in [0, 1] whose amplitude falls with frequency to this power, as in natural pictures."""
    frequency = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None, :])
    frequency[0, 0] = 1.0
    phases = np.exp(2j * np.pi * rng.random(frequency.shape))
    noise = np.fft.irfft2(phases / frequency**exponent, s=(size, size))
    return np.clip(0.5 + (noise - noise.mean()) / (5 * noise.std()), 0, 1)


def colour(rng: Rng, value: tuple[float, float] = (0.1, 0.95)) -> Array:
    """A coded colour, more often muted than pure."""
    hue, pure, bright = rng.random(), rng.beta(1.2, 2.0), rng.uniform(*value)
    wheel = np.clip(np.abs((hue * 6 + np.array([0.0, 4.0, 2.0])) % 6 - 3) - 1, 0, 1)
    return bright * (1 - pure + pure * wheel)


def texture(rng: Rng) -> Array:
    """A surface of one of several kinds: [_TILE, _TILE, 3] coded."""
    kind = rng.choice(["wood", "checker", "stripes", "stone", "speckle", "print", "plain", "cloth"])
    x, y = np.meshgrid(np.arange(_TILE) / _TILE, np.arange(_TILE) / _TILE)
    mix = _pattern(str(kind), x, y, rng)[..., None]
    dark, bright = colour(rng, (0.08, 0.5)), colour(rng, (0.45, 0.98))
    rough = fractal(rng, _TILE, rng.uniform(0.6, 1.3))[..., None] - 0.5
    return np.clip((dark * (1 - mix) + bright * mix) * (1 + rng.uniform(0.1, 0.7) * rough), 0, 1)


def _pattern(kind: str, x: Array, y: Array, rng: Rng) -> Array:
    wave = fractal(rng, _TILE, 1.8)
    if kind == "wood":
        return 0.5 + 0.5 * np.sin(2 * np.pi * (rng.integers(6, 16) * (x + 0.15 * wave) + 2 * wave))
    if kind == "checker":
        cells = rng.integers(3, 9)
        return (np.floor(x * cells) + np.floor(y * cells)) % 2
    if kind == "stripes":
        return (np.floor((x + rng.uniform(-0.5, 0.5) * y) * rng.integers(6, 18)) % 2).astype(np.float64)
    if kind == "speckle":
        return cv2.GaussianBlur((rng.random(x.shape) > 0.96).astype(np.float64), (0, 0), 1.2) * 5
    if kind == "print":
        return 1 - lettering(_TILE, _TILE, rng)
    if kind == "cloth":
        threads = rng.integers(24, 48)
        return 0.5 + 0.25 * np.sin(2 * np.pi * threads * x) + 0.25 * np.sin(2 * np.pi * threads * y)
    return wave if kind == "stone" else 0.7 + 0.3 * wave


def lettering(height: int, width: int, rng: Rng) -> Array:
    """Lines of letters and figures, coverage [height, width] in [0, 1]."""
    page = np.zeros((height, width), np.uint8)
    letters = list("ABCDEFGHKLMNPRSTXYZ0123456789abcdefghikmnorstuvxz .,-+/%#")
    size = rng.uniform(0.35, 1.0)
    for baseline in range(int(24 * size), height, max(8, int(30 * size))):
        line = "".join(rng.choice(letters, 64))
        at = (int(rng.uniform(2, 20)), baseline)
        cv2.putText(page, line, at, cv2.FONT_HERSHEY_SIMPLEX, size, 255, 1 + int(size > 0.6), cv2.LINE_AA)
    return page / 255.0


# -- a table with solids ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Solid:
    base: Array  # of its centre, on the table
    radius: float
    height: float
    sides: int  # 0: a ball
    yaw: float

    def ring(self, z: float) -> Array:
        turns = self.yaw + 2 * np.pi * np.arange(self.sides or 16) / (self.sides or 16)
        return self.base + np.stack([np.cos(turns), np.sin(turns), np.zeros_like(turns)], 1) * self.radius + (0, 0, z)


def _table(world: SyntheticScene, shape: tuple[int, int], focal: float, rng: Rng) -> tuple[Array, Array]:
    lens = _look(world, shape, focal, rng)
    picture, labels = _backdrop(world, shape, rng)
    corners = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], dtype=np.float64)
    tiled = np.tile(world.textures[world.surface], (5, 5, 1))
    shade = world.ambient + (1 - world.ambient) * world.light[2]
    solids = [_solid(world, rng) for _ in range(rng.integers(*world.solids))]
    shadows: Array = np.zeros(shape)
    for solid in solids:
        _fill(shadows, lens.project(_on_ground(solid, world)), 1.0)
    shadows = cv2.GaussianBlur(shadows, (0, 0), rng.uniform(1.0, 5.0))[..., None]
    dim = 1 - shadows * (1 - world.ambient) * 0.8
    window, inside = _paste(picture, tiled * shade, lens.project(corners))
    picture[window][inside] *= dim[window][inside]
    labels[window][inside] = TABLE
    for solid in sorted(solids, key=lambda s: -float(np.linalg.norm(s.base - lens.position))):
        (_draw_ball if solid.sides == 0 else _draw_prism)(solid, world, lens, picture, labels, rng)
    return picture, labels.astype(np.uint8)


def _solid(world: SyntheticScene, rng: Rng) -> _Solid:
    radius = world.size * math.exp(rng.uniform(math.log(0.06), math.log(0.25)))
    base = np.array([rng.uniform(-0.8, 0.8), rng.uniform(-0.7, 0.7), 0.0])
    sides = int(rng.choice([0, 0, 3, 4, 4, 4, 6, 20]))
    return _Solid(base, radius, radius * rng.uniform(0.5, 2.5), sides, rng.uniform(0, np.pi))


def _look(world: SyntheticScene, shape: tuple[int, int], focal: float, rng: Rng) -> Lens:
    pitch, distance, turn = rng.uniform(*world.pitch), rng.uniform(1.5, 2.4), rng.uniform(-0.4, 0.4)
    position = distance * np.array(
        [math.sin(turn) * math.cos(pitch), -math.cos(turn) * math.cos(pitch), math.sin(pitch)]
    )
    forward = -position / distance
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Lens(position, rotation, focal, ((shape[1] - 1) / 2, (shape[0] - 1) / 2))


def _backdrop(world: SyntheticScene, shape: tuple[int, int], rng: Rng) -> tuple[Array, Array]:
    tile = world.textures[(world.surface + 1) % len(world.textures)]
    wall = cv2.resize(tile, shape[::-1], interpolation=cv2.INTER_CUBIC)
    fade = np.linspace(rng.uniform(0.5, 1.1), rng.uniform(0.5, 1.1), shape[0])[:, None, None]
    return np.clip(wall, 0, 1) * fade, np.full(shape, BACKDROP, dtype=np.int64)


Window = tuple[slice, slice]


def _window(low: Array, high: Array, shape: tuple[int, ...]) -> Window:
    """The part between two corners (x, y) that lies in a picture of this shape."""
    low = np.clip(np.floor(low).astype(int) - 1, 0, shape[1::-1])
    high = np.clip(np.ceil(high).astype(int) + 2, low, shape[1::-1])
    return slice(low[1], high[1]), slice(low[0], high[0])


def _paste(target: Array, tile: Array, corners: Array) -> tuple[Window, Array]:
    """Warps a tile onto a quadrilateral [4, 2] of the target, in place; returns a window and where in it."""
    window = _window(corners.min(0), corners.max(0), target.shape)
    rows, columns = (axis.stop - axis.start for axis in window)
    if rows == 0 or columns == 0:
        return window, np.zeros((rows, columns), bool)
    side_y, side_x = tile.shape[:2]
    source = np.array([[0, 0], [side_x, 0], [side_x, side_y], [0, side_y]], np.float32) - 0.5
    moved = (corners - (window[1].start, window[0].start)).astype(np.float32)
    to_image = cv2.getPerspectiveTransform(source, moved)
    # Coverage by perspective too, so that corners far outside the picture (the table's) are no trouble.
    ones = np.ones(tile.shape[:2], np.float32)
    cover = cv2.warpPerspective(ones, to_image, (columns, rows), flags=cv2.INTER_NEAREST) > 0.5
    face = cv2.warpPerspective(
        tile.astype(np.float32), to_image, (columns, rows), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT
    )
    target[window][cover] = face[cover]
    return window, cover


def _fill(mask: Array, polygon: Array, value: float) -> None:
    """Fill the convex hull of points [n, 2] in a mask, in place."""
    hull = cv2.convexHull(polygon.astype(np.float32))
    cv2.fillConvexPoly(mask, np.round(hull * 16).astype(np.int32), value, lineType=cv2.LINE_8, shift=4)


def _on_ground(solid: _Solid, world: SyntheticScene) -> Array:
    """Points [n, 3] on the table between which a solid's shadow lies."""
    top = 2 * solid.radius if solid.sides == 0 else solid.height
    levels = (0.0, top) if solid.sides else (0.3 * top, 0.7 * top)
    points = np.concatenate([solid.ring(z) for z in levels])
    return points - world.light * (points[:, 2:] / world.light[2])


def _draw_prism(solid: _Solid, world: SyntheticScene, lens: Lens, picture: Array, labels: Array, rng: Rng) -> None:
    tile = world.textures[int(rng.integers(len(world.textures)))]
    tint = colour(rng, (0.7, 1.4))
    bottom, top = solid.ring(0.0), solid.ring(solid.height)
    for k in range(solid.sides):
        following = (k + 1) % solid.sides
        normal = (bottom[k] + bottom[following]) / 2 - solid.base
        normal = normal / np.linalg.norm(normal)
        if normal @ (lens.position - bottom[k]) <= 0:
            continue
        shade = world.ambient + (1 - world.ambient) * max(0.0, float(normal @ world.light))
        face = tile if solid.sides <= 6 else tile[:, k * 9 : k * 9 + 9]
        quad = lens.project(np.stack([top[k], top[following], bottom[following], bottom[k]]))
        window, inside = _paste(picture, face * tint * shade, quad)
        labels[window][inside] = PRISM
    shade = world.ambient + (1 - world.ambient) * world.light[2]
    _cap(picture, labels, lens.project(top), tile.mean((0, 1)) * tint * shade, rng)


def _cap(picture: Array, labels: Array, polygon: Array, tone: Array, rng: Rng) -> None:
    window = _window(polygon.min(0), polygon.max(0), labels.shape)
    mask = np.zeros([axis.stop - axis.start for axis in window], np.uint8)
    if mask.size == 0:
        return
    _fill(mask, polygon - (window[1].start, window[0].start), 1)
    slope = 1 + rng.uniform(-0.15, 0.15) * np.linspace(-0.5, 0.5, mask.shape[1])[None, :, None]
    inside = mask > 0
    picture[window][inside] = (tone * slope * np.ones((*mask.shape, 1)))[inside]
    labels[window][inside] = PRISM


def _draw_ball(solid: _Solid, world: SyntheticScene, lens: Lens, picture: Array, labels: Array, rng: Rng) -> None:
    centre = solid.base + np.array([0, 0, solid.radius])
    at = lens.project(centre)[0]
    radius = lens.focal * solid.radius / float((lens.rotation @ (centre - lens.position))[2])
    window = _window(at - radius, at + radius, labels.shape)
    y, x = np.mgrid[window]
    u, v = (x - at[0]) / radius, (y - at[1]) / radius
    inside = u**2 + v**2 < 1
    normal = np.stack([u, v, -np.sqrt(np.maximum(1 - u**2 - v**2, 0))], -1)
    light = lens.rotation @ world.light
    diffuse = np.maximum(normal @ light, 0)
    mirror = np.maximum(-(2 * diffuse[..., None] * normal - light)[..., 2], 0)
    tile = world.textures[int(rng.integers(len(world.textures)))]
    skin = tile[
        (np.clip(np.arcsin(np.clip(v, -1, 1)) / np.pi + 0.5, 0, 1) * (_TILE - 1)).astype(int),
        (np.clip(np.arcsin(np.clip(u, -1, 1)) / np.pi + 0.5, 0, 1) * (_TILE - 1)).astype(int),
    ]
    surface = skin if rng.random() < 0.5 else np.broadcast_to(colour(rng, (0.3, 1.0)), skin.shape)
    shaded = surface * (world.ambient + (1 - world.ambient) * diffuse)[..., None]
    shaded = shaded + rng.uniform(0, 0.7) * mirror[..., None] ** rng.uniform(10, 60)
    picture[window][inside] = shaded[inside]
    labels[window][inside] = BALL


# -- scenes without labels -------------------------------------------------------------------------------------------


def _clutter(world: SyntheticScene, shape: tuple[int, int], focal: float, rng: Rng) -> tuple[Array, Array]:
    """Dead leaves: things of all sizes before each other, the far ones out of focus (Lee, Mumford, Huang 2001)."""
    picture, labels = _backdrop(world, shape, rng)
    count = int(rng.integers(120, 220))
    radii = 1 / np.sqrt(rng.uniform(1 / 90**2, 1 / 7**2, count))
    sharp_from = int(count * rng.uniform(0.0, 0.6))
    for k, radius in enumerate(radii):
        if k == sharp_from:
            picture = cv2.GaussianBlur(picture, (0, 0), rng.uniform(1.0, 5.0))
        _leaf(picture, world, radius, rng)
    return picture, labels.astype(np.uint8)


def _leaf(picture: Array, world: SyntheticScene, radius: float, rng: Rng) -> None:
    height, width = picture.shape[:2]
    at = rng.uniform((0, 0), (width, height))
    window = _window(at - radius, at + radius, picture.shape)
    y, x = np.mgrid[window]
    x, y = x - at[0], y - at[1]
    turn, flat = rng.uniform(0, np.pi), rng.uniform(0.4, 1.0)
    u = (x * math.cos(turn) + y * math.sin(turn)) / radius
    v = (y * math.cos(turn) - x * math.sin(turn)) / (radius * flat)
    power = rng.choice([2.0, 2.0, 8.0])  # an ellipse, or nearly a box
    inside = np.abs(u) ** power + np.abs(v) ** power < 1
    tone = colour(rng) * (1 - 0.5 * (u * rng.uniform(-1, 1) + v * rng.uniform(-1, 1)))[..., None]
    if rng.random() < 0.4:
        tile = world.textures[int(rng.integers(len(world.textures)))]
        tone = tone * 0.3 + 0.7 * tile[y.astype(int) % _TILE, x.astype(int) % _TILE]
    picture[window][inside] = np.clip(tone, 0, 1.2)[inside]


def _towers(world: SyntheticScene, shape: tuple[int, int], focal: float, rng: Rng) -> tuple[Array, Array]:
    """A smooth sky, dark or bright, with masts, wires and lamps before it: little texture, thin edges."""
    height, width = shape
    top, bottom = colour(rng, (0.1, 0.6)), colour(rng, (0.2, 0.95))
    ramp = np.linspace(0, 1, height)[:, None, None] ** rng.uniform(0.6, 1.8)
    picture = np.broadcast_to(top * (1 - ramp) + bottom * ramp, (height, width, 3)).copy()
    for _ in range(rng.integers(3, 7)):
        mask = np.zeros(shape, np.uint8)
        _mast(mask, rng)
        cover = mask[..., None] / 255.0
        picture = picture * (1 - cover) + colour(rng, (0.02, 0.95)) * cover
    ground = int(height * rng.uniform(0.7, 0.95))
    tile = cv2.resize(world.textures[0], (width, height - ground))
    picture[ground:] = 0.7 * np.clip(tile, 0, 1)
    for _ in range(rng.integers(0, 12)):
        at = rng.uniform((0, 0), (width, height))
        cv2.circle(picture, tuple(int(a) for a in at), int(rng.integers(1, 4)), colour(rng, (0.7, 1.0)).tolist(), -1)
    return picture, np.zeros(shape, np.uint8)


def _mast(mask: Array, rng: Rng) -> None:
    height, width = mask.shape
    x, w, top = rng.uniform(0, width), rng.uniform(3, 28), rng.uniform(0, 0.6) * height
    step = w * rng.uniform(0.8, 1.6) + 4
    for level in np.arange(top, height, step):
        left, right = (int(x - w / 2), int(level)), (int(x + w / 2), int(level + step))
        cv2.line(mask, left, right, 255, 1, cv2.LINE_AA)
        cv2.line(mask, (right[0], left[1]), (left[0], right[1]), 255, 1, cv2.LINE_AA)
    thick = int(rng.integers(1, 5))
    for side in (x - w / 2, x + w / 2):
        cv2.line(mask, (int(side), int(top)), (int(side), height), 255, thick, cv2.LINE_AA)
    wire = int(top), int(rng.uniform(0, height))
    cv2.line(mask, (int(x), wire[0]), (int(rng.uniform(0, width)), wire[1]), 255, 1, cv2.LINE_AA)


def _print(world: SyntheticScene, shape: tuple[int, int], focal: float, rng: Rng) -> tuple[Array, Array]:
    """Sheets of print lying on a surface, each in its own perspective and light."""
    picture, labels = _backdrop(world, shape, rng)
    span = np.array(shape[::-1])
    for _ in range(rng.integers(2, 5)):
        ink = lettering(_TILE, _TILE, rng)[..., None]
        sheet = colour(rng, (0.6, 1.0)) * (1 - ink) + colour(rng, (0.02, 0.4)) * ink
        for _ in range(rng.integers(0, 4)):
            low = rng.integers(0, _TILE - 60, 2)
            high = low + rng.integers(15, 60, 2)
            sheet[low[0] : high[0], low[1] : high[1]] = colour(rng)
        sheet = sheet * np.linspace(rng.uniform(0.6, 1.0), rng.uniform(0.6, 1.0), _TILE)[None, :, None]
        turn = rng.uniform(-0.6, 0.6)
        square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * rng.uniform(0.2, 0.4)
        square = square @ np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        corners = (square + rng.uniform(0.25, 0.75, 2) + rng.uniform(-0.04, 0.04, (4, 2))) * span
        _paste(picture, sheet, corners)
    return picture, labels.astype(np.uint8)


SCENES: dict[str, Callable[[SyntheticScene, tuple[int, int], float, Rng], tuple[Array, Array]]] = {
    "table": _table,
    "clutter": _clutter,
    "towers": _towers,
    "print": _print,
}
