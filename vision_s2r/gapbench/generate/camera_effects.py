"""The fifteen camera effects of the recording contract, in float64 on NumPy, OpenCV and Pillow (libjpeg).

A camera sees a *canvas*: the scene drawn wider than the picture by a margin, so that no effect looks at nothing, and
sampled `scale` times a pixel. Optics work on the canvas, the sensor on its pixels: means of scale × scale samples.
"""

import io
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from scipy import sparse

Array = np.ndarray
Values = Mapping[str, Mapping[str, float]]

NOISE = ("shot_noise", "read_noise")
EFFECTS = (  # in the order in which light meets them
    "camera_pose_offset",
    "uneven_illumination",
    "cast_shadow",
    "lens_distortion",
    "chromatic_aberration",
    "vignetting",
    "defocus_blur",
    "motion_blur",
    "low_resolution",
    "exposure",
    "shot_noise",
    "read_noise",
    "white_balance",
    "gamma",
    "jpeg_compression",
)
_MARGIN_SLOPE = 1e-3  # keeps the inverse of a folding lens finite, far outside any picture drawn here


@dataclass(frozen=True)
class Geometry:
    """Of a picture of width × height pixels, and of its canvas: `margin` pixels wider on each side."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    margin: int
    scale: int = 1  # samples of the canvas to a pixel, along each axis

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the canvas."""
        return (self.height + 2 * self.margin) * self.scale, (self.width + 2 * self.margin) * self.scale

    def pixels(self) -> tuple[Array, Array]:
        """x [1, w] and y [h, 1] of the samples of the canvas, in pixels of the picture (pixel centres at integers)."""
        rows, columns = (
            (np.arange(count, dtype=np.float64) + 0.5) / self.scale - 0.5 - self.margin for count in self.shape
        )
        return columns[None, :], rows[:, None]

    def samples(self, x: Array, y: Array) -> tuple[Array, Array]:
        """The column and row, fractional, of the canvas at a position in pixels of the picture."""
        return (x + 0.5 + self.margin) * self.scale - 0.5, (y + 0.5 + self.margin) * self.scale - 0.5

    def along(self, angle: float) -> Array:
        """Distance (px) [h, w] from the centre of the picture along a direction (deg, from right towards down)."""
        x, y = self.pixels()
        turn = math.radians(angle)
        return (x - (self.width - 1) / 2) * math.cos(turn) + (y - (self.height - 1) / 2) * math.sin(turn)

    def crop(self, canvas: Array) -> Array:
        """The picture's part of canvases [N, h, w, …], at the canvas' sampling."""
        edge = self.margin * self.scale
        return canvas[:, edge : edge + self.height * self.scale, edge : edge + self.width * self.scale]

    def expose(self, canvas: Array) -> Array:
        """Pixels [N, H, W, …] of the picture: the mean of their samples on the canvas [N, h, w, …]."""
        return binned(self.crop(canvas), self.scale)


Stage = Callable[[Array, Geometry], Array]


def binned(pictures: Array, factor: int) -> Array:
    """Means of factor × factor samples of pictures [N, h, w, …]."""
    parts = [pictures[:, i::factor, j::factor] for i in range(factor) for j in range(factor)]
    return parts[0] if factor == 1 else sum(parts[1:], parts[0]) / factor**2


@dataclass(frozen=True)
class Sensor:
    """What a camera is besides its effects: none of it is part of one."""

    kernel: str = "lanczos"  # between the samples of the canvas: linear, cubic, cubic75 or lanczos
    linear: bool = False  # whether pixel values are linear light
    bits: int = 8
    sigma: float = 0.5 / 255  # noise of coded values
    curve: str = "srgb"  # of coded values, by which light is changed: srgb, or power (2.2)
    rounding: str = "nearest"  # to the bits: nearest, or dithered
    disk: str = "even"  # of a defocus: even, soft at its rim, or a hexagon
    path: str = "even"  # of a motion: even, or coarse in its points
    uneven: float = 0.0  # standard deviation of the pixels' gains
    extra: Mapping[str, Stage] = field(default_factory=dict)  # "optics", "sensor", "processing": a step of its own


# -- light and kernels -----------------------------------------------------------------------------------------------

POWER = 2.2


def brightness(pictures: Array) -> Array:
    """Of red, green and blue [..., H, W, 3]: [..., H, W] (ITU-R BT.601)."""
    found: Array = pictures @ np.array([0.299, 0.587, 0.114])
    return found


def to_linear(coded: Array) -> Array:
    """sRGB-coded values to linear light (IEC 61966-2-1)."""
    return np.where(coded <= 0.04045, coded / 12.92, ((np.maximum(coded, 0.04045) + 0.055) / 1.055) ** 2.4)


def to_coded(light: Array) -> Array:
    """Linear light to sRGB-coded values; light below 0 becomes 0."""
    light = np.maximum(light, 0.0)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def light_of(pictures: Array, sensor: Sensor) -> Array:
    """Pixel values as linear light, by the sensor's curve."""
    if sensor.linear:
        return pictures
    return np.maximum(pictures, 0.0) ** POWER if sensor.curve == "power" else to_linear(pictures)


def values_of(light: Array, sensor: Sensor) -> Array:
    """The inverse of `light_of`."""
    if sensor.linear:
        return light
    return np.maximum(light, 0.0) ** (1 / POWER) if sensor.curve == "power" else to_coded(light)


def interpolation_weights(distance: Array, kernel: str) -> Array:
    """Weights of samples at this distance: linear, Keys' cubic (a = -0.5, or -0.75) or Lanczos with three lobes."""
    d = np.abs(distance)
    if kernel == "linear":
        return np.maximum(1 - d, 0.0)
    if kernel == "lanczos":
        return np.where(d < 3, np.sinc(d) * np.sinc(d / 3), 0.0)
    a = -0.75 if kernel == "cubic75" else -0.5
    inner = ((a + 2) * d - (a + 3)) * d * d + 1
    outer = a * (((d - 5) * d + 8) * d - 4)
    return np.where(d <= 1, inner, np.where(d < 2, outer, 0.0))


def resampler(column: Array, row: Array, shape: tuple[int, int], kernel: str) -> sparse.csr_array:
    """The map from a picture of `shape` to its values at `column`, `row` [h, w]: weights of each row sum to 1."""
    reach = 3 if kernel == "lanczos" else 2
    taps = np.arange(1 - reach, reach + 1)

    def axis(position: Array, count: int) -> tuple[Array, Array]:
        index = np.floor(position).astype(np.int64).reshape(-1, 1) + taps
        weight = interpolation_weights(position.reshape(-1, 1) - index, kernel)
        return np.clip(index, 0, count - 1), weight / weight.sum(axis=1, keepdims=True)

    column, row = np.broadcast_arrays(column, row)
    (x, wx), (y, wy) = axis(column, shape[1]), axis(row, shape[0])
    index = (y[:, :, None] * shape[1] + x[:, None, :]).reshape(len(x), -1)
    weight = (wy[:, :, None] * wx[:, None, :]).reshape(len(x), -1)
    starts = np.arange(len(x) + 1, dtype=np.int64) * index.shape[1]
    return sparse.csr_array((weight.ravel(), index.ravel(), starts), shape=(len(x), shape[0] * shape[1]))


def warp(canvas: Array, x: Array, y: Array, geometry: Geometry, kernel: str) -> Array:
    """Canvases [N, h, w, C], each sampled at `x`, `y` (pixels of the picture, [h, w])."""
    count, height, width, channels = canvas.shape
    flat = np.ascontiguousarray(canvas.transpose(1, 2, 0, 3)).reshape(height * width, count * channels)
    sampled = resampler(*geometry.samples(x, y), (height, width), kernel) @ flat
    return sampled.reshape(height, width, count, channels).transpose(2, 0, 1, 3)


def convolve(pictures: Array, kernel: Array) -> Array:
    """Pictures [N, h, w, C] under a kernel, whose sum becomes 1; edges repeat."""
    kernel = kernel / kernel.sum()
    filtered = [
        cv2.filter2D(np.ascontiguousarray(p), cv2.CV_64F, kernel, borderType=cv2.BORDER_REPLICATE) for p in pictures
    ]
    return np.stack(filtered).reshape(pictures.shape)


def disk(radius: float, form: str = "even", fine: int = 24) -> Array:
    """Share of each sample's square that a disk of this radius covers, by fine × fine points a sample.

    `form`: even, soft (it fades over a tenth of the radius) or hexagon (the disk's area, an iris of six blades).
    """
    reach = math.ceil(1.2 * radius + 0.5)
    axis = (np.arange((2 * reach + 1) * fine) + 0.5) / fine - reach - 0.5
    away = np.hypot(axis[None, :], axis[:, None])
    if form == "hexagon":
        turns = np.radians([0, 60, 120])
        across = [np.abs(axis[None, :] * np.cos(turn) + axis[:, None] * np.sin(turn)) for turn in turns]
        inside = (np.max(across, axis=0) <= radius * math.sqrt(math.pi / (2 * math.sqrt(3)))).astype(np.float64)
    elif form == "soft":
        inside = 1 / (1 + np.exp(np.clip((away - radius) / (0.03 * radius), -50, 50)))
    else:
        inside = (away <= radius).astype(np.float64)
    size = 2 * reach + 1
    return inside.reshape(size, fine, size, fine).mean(axis=(1, 3))


def path(length: float, angle: float, kernel: str, form: str = "even") -> Array:
    """The mean along a straight path, interpolated between samples by `kernel`, at 16 points a sample or, coarse, 2."""
    count = max(9, math.ceil(length * 16)) if form == "even" else max(3, math.ceil(length * 2))
    points = (np.arange(count) + 0.5) / count - 0.5
    x, y = (length * points * trig(math.radians(angle)) for trig in (math.cos, math.sin))
    reach = math.ceil(length / 2) + 3
    axis = np.arange(-reach, reach + 1, dtype=np.float64)
    along_x = interpolation_weights(axis[:, None] - x, kernel)
    along_y = interpolation_weights(axis[:, None] - y, kernel)
    return along_y @ along_x.T


# -- where rays go ---------------------------------------------------------------------------------------------------


def rotated(geometry: Geometry, yaw: float, pitch: float, roll: float) -> tuple[Array, Array]:
    """Where the simulator shows what the real camera, turned against it, shows at each sample of the canvas."""
    rotation = cv2.Rodrigues(np.array([pitch, yaw, roll], dtype=np.float64))[0]
    x, y = geometry.pixels()
    x, y = np.broadcast_arrays((x - geometry.cx) / geometry.fx, (y - geometry.cy) / geometry.fy)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ rotation  # Rᵀ of each
    depth = np.maximum(rays[..., 2], 1e-3)
    return rays[..., 0] / depth * geometry.fx + geometry.cx, rays[..., 1] / depth * geometry.fy + geometry.cy


def undistorted(geometry: Geometry, k1: float, k2: float) -> tuple[Array, Array]:
    """Where the straight picture shows what a lens shows at each sample: the radial model, inverted by bisection."""
    x, y = geometry.pixels()
    x, y = np.broadcast_arrays((x - geometry.cx) / geometry.fx, (y - geometry.cy) / geometry.fy)
    distorted = np.hypot(x, y)
    low, high = np.zeros_like(distorted), np.full_like(distorted, _fold(k1, k2, 4 * distorted.max()))
    for _ in range(50):
        middle = (low + high) / 2
        below = middle * (1 + k1 * middle**2 + k2 * middle**4) < distorted
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    ratio = np.where(distorted > 1e-12, low / np.maximum(distorted, 1e-12), 1.0)
    return x * ratio * geometry.fx + geometry.cx, y * ratio * geometry.fy + geometry.cy


def _fold(k1: float, k2: float, limit: float) -> float:
    """The radius up to which the radial model grows, at most `limit`."""
    radii = np.linspace(0, limit, 4001)
    falling = np.flatnonzero(1 + 3 * k1 * radii**2 + 5 * k2 * radii**4 < _MARGIN_SLOPE)
    return float(radii[falling[0]]) if len(falling) else limit


# -- the camera ------------------------------------------------------------------------------------------------------


def _in_light(pictures: Array, factor: Array | float, sensor: Sensor) -> Array:
    return values_of(light_of(pictures, sensor) * factor, sensor)


def optics(canvas: Array, values: Values, geometry: Geometry, sensor: Sensor) -> Array:
    """From the scene to the sensor's surface: canvases [N, h, w, C] of coded values to the same."""
    if v := values.get("camera_pose_offset"):
        canvas = warp(canvas, *rotated(geometry, v["yaw"], v["pitch"], v["roll"]), geometry, sensor.kernel)
    if v := values.get("uneven_illumination"):
        along = geometry.along(v["angle"]) / (geometry.width / 2)
        canvas = _in_light(canvas, (1 + v["strength"] * along)[..., None], sensor)
    if v := values.get("cast_shadow"):
        depth = (geometry.along(v["angle"]) - v["offset"]) / v["softness"]
        canvas = _in_light(canvas, (1 - v["strength"] / (1 + np.exp(-np.clip(depth, -50, 50))))[..., None], sensor)
    if v := values.get("lens_distortion"):
        canvas = warp(canvas, *undistorted(geometry, v["k1"], v["k2"]), geometry, sensor.kernel)
    if v := values.get("chromatic_aberration"):
        canvas = _split_colours(canvas, v, geometry, sensor)
    if v := values.get("vignetting"):
        x, y = geometry.pixels()
        x, y = x - (geometry.width - 1) / 2, y - (geometry.height - 1) / 2
        corner = ((geometry.width - 1) ** 2 + (geometry.height - 1) ** 2) / 4
        canvas = _in_light(canvas, np.maximum(1 - v["strength"] * (x**2 + y**2) / corner, 0)[..., None], sensor)
    if v := values.get("defocus_blur"):
        canvas = convolve(canvas, disk(v["radius"] * geometry.scale, sensor.disk))
    if v := values.get("motion_blur"):
        canvas = convolve(canvas, path(v["length"] * geometry.scale, v["angle"], sensor.kernel, sensor.path))
    return canvas


def _split_colours(canvas: Array, values: Mapping[str, float], geometry: Geometry, sensor: Sensor) -> Array:
    x, y = geometry.pixels()
    result = canvas.copy()
    for channel, value in ((0, values["red"]), (2, values["blue"])):
        wide = geometry.cx + (x - geometry.cx) * (1 + value), geometry.cy + (y - geometry.cy) * (1 + value)
        result[..., channel : channel + 1] = warp(canvas[..., channel : channel + 1], *wide, geometry, sensor.kernel)
    return result


def read_out(pictures: Array, values: Values, sensor: Sensor, rng: np.random.Generator | None) -> Array:
    """From the sensor's surface to the values it delivers: coded pixels [N, H, W, C]; without `rng` no noise."""
    shot, read = (None, None) if rng is None else rng.spawn(2)  # one is the same whether the other is on or not
    if v := values.get("low_resolution"):
        pictures = _coarser(pictures, v["factor"])
    if any(name in values for name in ("exposure", *NOISE)):
        light = light_of(pictures, sensor)
        light = light * 2.0 ** values.get("exposure", {}).get("stops", 0.0)
        if shot is not None and (v := values.get("shot_noise")):
            light = shot.poisson(np.maximum(light, 0) * v["full_well"]) / v["full_well"]
        light = np.clip(light, 0, 1)  # the well is full
        if read is not None and (v := values.get("read_noise")):
            light = light + read.normal(0, v["sigma"], light.shape)
        pictures = values_of(np.clip(light, 0, 1), sensor)
    return pictures


def _coarser(pictures: Array, factor: float) -> Array:
    height, width = pictures.shape[1:3]
    cells = max(1, round(width / factor)), max(1, round(height / factor))

    def down_and_up(picture: Array) -> Array:
        small = cv2.resize(np.ascontiguousarray(picture), cells, interpolation=cv2.INTER_AREA)
        return cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)

    return np.stack([down_and_up(picture) for picture in pictures]).reshape(pictures.shape)


def process(pictures: Array, values: Values) -> Array:
    """White balance and gamma of coded pixels [N, H, W, C]."""
    if v := values.get("white_balance"):
        pictures = pictures * np.array([v["red"], 1.0, v["blue"]])
    if v := values.get("gamma"):
        pictures = np.clip(pictures, 0, 1) ** v["gamma"]
    return pictures


def quantize(pictures: Array, bits: int, dither: np.random.Generator | None = None) -> Array:
    """Coded values [0, 1] to whole numbers of 8 or 16 bits."""
    full = 2**bits - 1
    if dither is not None:
        pictures = pictures + dither.uniform(-0.5, 0.5, pictures.shape) / full
    return np.round(np.clip(pictures, 0, 1) * full).astype(np.uint8 if bits == 8 else np.uint16)


def jpeg_bytes(picture: Array, quality: int) -> bytes:
    """A picture [H, W, 3 or 1] uint8 as libjpeg has it at this quality, chroma at half the resolution."""
    stream = io.BytesIO()
    Image.fromarray(picture[..., 0] if picture.shape[-1] == 1 else picture).save(
        stream, "JPEG", quality=quality, subsampling=2
    )
    return stream.getvalue()


def _through_jpeg(pictures: Array, quality: int) -> Array:
    def there_and_back(picture: Array) -> Array:
        with Image.open(io.BytesIO(jpeg_bytes(picture, quality))) as image:
            return np.asarray(image).reshape(picture.shape)

    return np.stack([there_and_back(picture) for picture in pictures])


def photograph(
    canvas: Array, values: Values, geometry: Geometry, sensor: Sensor, rng: np.random.Generator | None
) -> Array:
    """What the camera delivers of scenes [N, h, w, C] (coded, [0, 1]): pixels [N, H, W, C], uint8 or uint16.

    Without `rng` nothing is random: the picture before the noise, rounded.
    """
    return compress(expose(canvas, values, geometry, sensor, rng), values, sensor)


def expose(canvas: Array, values: Values, geometry: Geometry, sensor: Sensor, rng: np.random.Generator | None) -> Array:
    """`photograph` up to what is compressed: whole numbers, as an encoder gets them."""
    extra = sensor.extra
    canvas = optics(canvas, values, geometry, sensor)
    if sensor.uneven:  # of the pixels, the same whenever they are read
        own = np.random.default_rng(0).normal(1, sensor.uneven, canvas.shape[1:])
        canvas = canvas * own
    if "optics" in extra:
        canvas = extra["optics"](canvas, geometry)
    pictures = read_out(geometry.expose(canvas), values, sensor, rng)
    if "sensor" in extra:
        pictures = extra["sensor"](pictures, geometry)
    pictures = process(pictures, values)
    if "processing" in extra:
        pictures = extra["processing"](np.clip(pictures, 0, 1), geometry)
    if rng is not None:
        pictures = np.clip(pictures, 0, 1) + rng.normal(0, sensor.sigma, pictures.shape)
    return quantize(pictures, sensor.bits, rng if sensor.rounding == "dithered" else None)


def compress(pictures: Array, values: Values, sensor: Sensor) -> Array:
    """Whole numbers [N, H, W, C] through the encoder, where there is one."""
    if v := values.get("jpeg_compression"):
        return _through_jpeg(pictures, round(v["quality"]))
    return pictures


def write_picture(path: Path, picture: Array, quality: float | None) -> None:
    """Write a picture [H, W, C] as PNG, or as JPEG of a quality; `path` has no suffix yet."""
    if quality is not None:
        path.with_suffix(".jpg").write_bytes(jpeg_bytes(picture, round(quality)))
        return
    coded = cv2.imencode(".png", picture[..., ::-1] if picture.shape[-1] == 3 else picture)[1]
    path.with_suffix(".png").write_bytes(coded.tobytes())
