"""Generated cameras: recordings of every case, drawn so that each of their effects shows in the pictures.

An effect shows when it alone changes the pictures by 1.5 (mild) to 20 grey levels of 255 (root mean square; noise and
compression: 1.5 to 12), and by 1.5 at least beside the others. The gap that the true effects remove is measured on the
real pictures: before, the distance to sim/; floor, the noise of the camera without noise effects; after, the floor and
what else sim/, as it passes through this module's own camera with the true parameters, differs by than the noise of
both (a camera predicts how noisy, not which noise). Pixels whose light came from beyond sim/ do not count.

What a confusable recording hides changes pictures such as people take anyway by 4.5 grey levels or more, and those that
are recorded by less than 0.15, or another effect of its kind changes them alike.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import yaml

from vision_s2r.gapbench.generate import camera_scenes, camera_sensor
from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine, Redraw, drawn
from vision_s2r.gapbench.generate.camera_effects import (
    EFFECTS,
    NOISE,
    Array,
    Geometry,
    Sensor,
    Stage,
    binned,
    brightness,
    compress,
    expose,
    optics,
    photograph,
    quantize,
    to_linear,
    write_picture,
)
from vision_s2r.gapbench.generate.camera_looks import LOOKS
from vision_s2r.gapbench.generate.camera_strength import FAMILIES, IN_STEPS, OF_COLOUR
from vision_s2r.gapbench.generate.camera_unknown import UNKNOWN, Kind

CASES = (
    *("null", "single", "pair", "triple", "unknown", "known_unknown", "weak", "left_out", "confusable"),
    "sensor",
)
PAIRS = 16
SIZE, MARGIN, FINE = 128, 28, 2
MILD, SEVERE, SEVERE_NOISE = 1.5, 20.0, 12.0  # grey levels of 255
WEAK = (0.03, 0.15)
HIDDEN = 0.15  # grey levels: an effect, or what is left of it beside another, that nobody can tell
SLIGHT, DRAWS = 0.05, 3  # intensity of an effect that is scaled to imitate another, and how often it is drawn
LEAST_SHRINK = 0.1  # of a known effect beside an unknown one
_ALIKE = (  # effects that may pass for each other
    ("exposure", "white_balance", "gamma", "vignetting", "uneven_illumination", "cast_shadow"),
    ("defocus_blur", "motion_blur", "low_resolution"),
    ("camera_pose_offset", "lens_distortion", "chromatic_aberration"),
)
_WARPS = ("camera_pose_offset", "lens_distortion", "chromatic_aberration", "defocus_blur", "motion_blur")
_PAIRS = tuple(itertools.combinations(EFFECTS, 2))
_STRIDE = 44  # through the pairs, coprime to their number, so that each effect comes soon
UNLIKE = 0.5  # share of cameras that are made unlike what the diagnosis takes for granted
_LOOK = slice(None, None, 5)  # frames by which a strength is found, of all worlds


@dataclass(frozen=True)
class Form:
    """What kind of recording: none of it is part of a gap."""

    content: str = "photo"  # or render: tables alone, with labels
    grey: bool = False
    count: int = PAIRS  # scenes


@dataclass(frozen=True)
class CameraSetting:
    """Scenes, and the camera before them. `canvas` is what optics see, `sim` the simulator's pictures."""

    form: Form
    geometry: Geometry
    sensor: Sensor
    canvas: Array  # [N, h, w, C] coded (or linear) values in [0, 1]
    sim: Array  # [N, H, W, C] uint8 or uint16
    labels: Array  # [N, H, W] uint8


@dataclass(frozen=True)
class CameraTruth:
    """What is true of a camera: effects of the vocabulary, and perhaps one outside it."""

    values: Effects = field(default_factory=dict)
    unknown: str | None = None
    stages: Mapping[str, Stage] = field(default_factory=dict)

    def without(self, name: str) -> "CameraTruth":
        """The same camera without one of its effects of the vocabulary."""
        return replace(self, values={key: value for key, value in self.values.items() if key != name})


def machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    """Draw one camera of a case; see `generate.base`."""
    if case == "sensor":
        return camera_sensor.machine(rng)
    return drawn(
        lambda: _recorded(*_DRAWN[case](index, split, rng), rng), f"camera of case '{case}' number {index}", 100
    )


# -- drawing truths, one function a case: (index, split, rng) -> setting, truth, answer --------------------------------

Drawn = tuple[CameraSetting, CameraTruth, Answer]


def _null(index: int, split: str, rng: np.random.Generator) -> Drawn:
    return _setting((), rng), CameraTruth(), Answer("null")


def _known(case: str, names: Sequence[str], rng: np.random.Generator) -> Drawn:
    setting = _setting(names, rng)
    truth = with_effects(setting, names, rng)
    where = sorted(WHERE[names[0]]) if len(names) == 1 else []
    return setting, truth, Answer(case, truth.values, where=where)


def _single(index: int, split: str, rng: np.random.Generator) -> Drawn:
    return _known("single", (EFFECTS[index % len(EFFECTS)],), rng)


def _pair(index: int, split: str, rng: np.random.Generator) -> Drawn:
    return _known("pair", _PAIRS[index * _STRIDE % len(_PAIRS)], rng)


def _triple(index: int, split: str, rng: np.random.Generator) -> Drawn:
    first = EFFECTS[index % len(EFFECTS)]
    others = rng.choice([name for name in EFFECTS if name != first], size=2, replace=False)
    return _known("triple", (first, *map(str, others)), rng)


def _left_out(index: int, split: str, rng: np.random.Generator) -> Drawn:
    name = EFFECTS[index % len(EFFECTS)]
    setting, truth, answer = _known("left_out", (name,), rng)
    return setting, truth, replace(answer, effects={}, withhold=name, where=[])


def _weak(index: int, split: str, rng: np.random.Generator) -> Drawn:
    names = [name for name in EFFECTS if name not in IN_STEPS]
    name = names[index % len(names)]
    setting = _setting((name,), rng, common=True)  # 16 bits would show it
    truth = _grown(setting, CameraTruth(), name, rng, WEAK)
    return setting, truth, Answer("weak", optional=truth.values)


def _unknown(index: int, split: str, rng: np.random.Generator) -> Drawn:
    kind = UNKNOWN[split][index % len(UNKNOWN[split])]
    setting = _setting((), rng, common=True)
    truth = with_unknown(setting, CameraTruth(), kind, rng)
    return setting, truth, Answer("unknown", unknown=truth.unknown)


def _known_unknown(index: int, split: str, rng: np.random.Generator) -> Drawn:
    """An effect of the vocabulary and an unknown one, each in turn."""
    name = EFFECTS[index % len(EFFECTS)]
    kind = UNKNOWN[split][index % len(UNKNOWN[split])]
    setting = _setting((name,), rng, common=True)
    truth = with_unknown(setting, with_effects(setting, (name,), rng), kind, rng)
    if _difference(setting, truth, truth.without(name)) < MILD:
        raise Redraw
    return setting, truth, Answer("known_unknown", truth.values, unknown=truth.unknown)


def _confusable(index: int, split: str, rng: np.random.Generator) -> Drawn:
    """One effect, drawn: few are hidden by pictures of one kind."""
    name = str(rng.choice(EFFECTS))
    setting = _setting((name,), rng, common=True)
    truth = _grown(setting, CameraTruth(), name, rng, (3 * MILD, SEVERE_NOISE))
    for look in rng.permutation(list(LOOKS)):
        pictures = itertools.islice(LOOKS[str(look)](replace(setting.geometry, scale=FINE).shape, rng), PAIRS)
        form = replace(setting.form, content="photo")
        hiding = setting_of(np.stack(list(pictures)), form, setting.geometry, setting.sensor)
        _check_margin(hiding, truth)
        if _hidden(hiding, truth, name, rng):
            return hiding, truth, Answer("confusable", truth.values)
    raise Redraw


def _hidden(setting: CameraSetting, truth: CameraTruth, name: str, rng: np.random.Generator) -> bool:
    """Whether an effect hardly shows, or another of its kind changes the pictures alike, to first order."""
    if _difference(setting, truth, CameraTruth()) < HIDDEN:
        return True
    plain = _clean(setting, CameraTruth())
    change = (_clean(setting, truth) - plain).ravel()
    for other in (each for group in _ALIKE if name in group for each in group if each != name):
        families = [FAMILIES[other](rng, setting.geometry) for _ in range(DRAWS)]
        alike = [(_clean(setting, CameraTruth({other: family(SLIGHT)})) - plain).ravel() for family in families]
        left = change - np.stack(alike, 1) @ np.linalg.lstsq(np.stack(alike, 1), change, rcond=1e-6)[0]
        if 255 * float(np.sqrt(np.mean(left**2))) < HIDDEN:
            return True
    return False


def _clean(setting: CameraSetting, truth: CameraTruth) -> Array:
    """A few pictures of a camera without noise, unrounded, nearly."""
    sensor = replace(setting.sensor, sigma=0.0, bits=16)
    return expose(setting.canvas[_LOOK], truth.values, setting.geometry, sensor, None) / 65535


_DRAWN: dict[str, Callable[[int, str, np.random.Generator], Drawn]] = {
    "null": _null,
    "single": _single,
    "pair": _pair,
    "triple": _triple,
    "unknown": _unknown,
    "known_unknown": _known_unknown,
    "weak": _weak,
    "left_out": _left_out,
    "confusable": _confusable,
}

# -- scenes and cameras ------------------------------------------------------------------------------------------------


def _setting(effects: Sequence[str], rng: np.random.Generator, *, common: bool = False) -> CameraSetting:
    """Scenes and a camera that can show these effects; `common`: colour, 8 bits, sRGB, as most are anyway."""
    kind = "common" if common or rng.random() < 0.8 else rng.choice(["deep", "linear", "grey"])
    if kind == "grey" and any(name in OF_COLOUR for name in effects):
        kind = "common"
    if kind in ("deep", "linear") and "jpeg_compression" in effects:
        kind = "common"
    geometry, sensor = device(kind, rng)
    form = Form("render" if rng.random() < 0.4 else "photo", kind == "grey")
    return _drawn(form, geometry, sensor, rng)


def device(kind: str, rng: np.random.Generator) -> tuple[Geometry, Sensor]:
    """A camera of a kind: common (colour, 8 bits, sRGB), deep, linear or grey."""
    bits = 16 if kind in ("deep", "linear") else 8
    sensor = Sensor(
        kernel=str(rng.choice(["cubic75", "cubic75", "cubic", "lanczos"])),
        linear=kind == "linear",
        bits=bits,
        sigma=rng.uniform(0.4, 0.6) / (2**bits - 1),  # what is more is read noise
    )
    apart = rng.spawn(1)[0]
    if apart.random() < UNLIKE:
        sensor = _unlike(sensor, apart)
    focal = 140.0 if rng.random() < 0.5 else float(np.round(rng.uniform(115, 180), 1))
    off = (0.0, 0.0) if rng.random() < 0.7 else np.round(rng.uniform(-4, 4, 2), 1).tolist()
    centre = (SIZE - 1) / 2
    # Most real pictures look between the samples of the simulator's, some at a finer drawing of the scene
    fine = FINE if rng.random() < 0.1 else 1
    return Geometry(SIZE, SIZE, focal, focal, centre + off[0], centre + off[1], MARGIN, fine), sensor


def _unlike(sensor: Sensor, rng: np.random.Generator) -> Sensor:
    """As another maker has it: what the contract leaves open, and small imperfections that are no effect."""
    return replace(
        sensor,
        kernel=str(rng.choice(["linear", "cubic", "lanczos"])),
        sigma=sensor.sigma * rng.uniform(0.7, 1),
        curve=str(rng.choice(["srgb", "power"])),
        rounding=str(rng.choice(["nearest", "dithered"])),
        disk=str(rng.choice(["even", "soft", "hexagon"])),
        path=str(rng.choice(["even", "coarse"])),
        uneven=float(rng.choice([0.0, 0.001])),
    )


def _drawn(form: Form, geometry: Geometry, sensor: Sensor, rng: np.random.Generator) -> CameraSetting:
    fine = replace(geometry, scale=FINE)
    canvas, labels = scenes(form, fine, rng)
    if form.grey:
        canvas = brightness(canvas)[..., None]
    if sensor.linear:
        canvas = to_linear(canvas)
    setting = setting_of(canvas, form, geometry, sensor)
    return replace(setting, labels=np.stack([fine.crop(each[None])[0, ::FINE, ::FINE] for each in labels]))


def scenes(form: Form, fine: Geometry, rng: np.random.Generator) -> tuple[Array, Array]:
    """Scenes [N, h, w, 3] (coded, [0, 1]) and their labels [N, h, w] at the sampling of `fine`."""
    worlds = [camera_scenes.world(rng) for _ in range(4)]
    names = ["table"] if form.content == "render" else list(camera_scenes.SCENES)
    drawn = []
    for k in range(form.count):
        name = str(rng.choice(names))
        drawn.append(camera_scenes.draw(name, worlds[k % len(worlds)], fine.shape, fine.fx * FINE, rng))
    return np.stack([picture for picture, _ in drawn]), np.stack([labels for _, labels in drawn])


def setting_of(canvas: Array, form: Form, geometry: Geometry, sensor: Sensor) -> CameraSetting:
    """A camera before scenes [N, h, w, C] of FINE samples a pixel, which nobody has labelled."""
    if geometry.scale == 1:  # the simulator's own picture, rendered wider
        canvas = quantize(binned(canvas, FINE), sensor.bits) / (2**sensor.bits - 1)
    labels = np.zeros((len(canvas), geometry.height, geometry.width), np.uint8)
    return CameraSetting(form, geometry, sensor, canvas, quantize(geometry.expose(canvas), sensor.bits), labels)


# -- strengths ---------------------------------------------------------------------------------------------------------


def _difference(setting: CameraSetting, truth: CameraTruth, without: CameraTruth) -> float:
    """How far apart two cameras' pictures are, in grey levels of 255, but for the noise that both have."""
    noisy = [{name for name in camera.values if name in NOISE} for camera in (truth, without)]
    pictures = []
    for camera in (truth, without):
        rng = np.random.default_rng(0) if noisy[0] != noisy[1] else None
        sensor = replace(setting.sensor, extra=camera.stages, sigma=0.0, bits=16)  # unrounded, nearly
        canvas = setting.canvas[_LOOK]
        pixels = expose(canvas, camera.values, setting.geometry, sensor, rng) / 65535
        if "jpeg_compression" in camera.values:
            pixels = compress(quantize(pixels, 8), camera.values, sensor) / 255.0
        pictures.append(pixels)
    return 255 * float(np.sqrt(np.mean((pictures[0] - pictures[1]) ** 2)))


def with_effects(
    setting: CameraSetting, names: Sequence[str], rng: np.random.Generator, least: float = MILD
) -> CameraTruth:
    """A camera with these effects, each of which shows, alone by `least` grey levels, and beside the others."""
    truth = CameraTruth()
    for name in names:
        severe = SEVERE_NOISE if name in (*NOISE, "jpeg_compression") else SEVERE
        truth = _grown(setting, truth, name, rng, (least, severe))
    for name in names if len(names) > 1 else ():
        if _difference(setting, truth, truth.without(name)) < MILD:
            raise Redraw
    _check_margin(setting, truth)
    return truth


def _grown(
    setting: CameraSetting, truth: CameraTruth, name: str, rng: np.random.Generator, bounds: tuple[float, float]
) -> CameraTruth:
    """Add an effect which alone changes the pictures by an amount within `bounds` (grey levels)."""
    family = FAMILIES[name](rng, setting.geometry)
    visible = lambda x: _difference(setting, CameraTruth({name: family(x)}), CameraTruth())  # noqa: E731
    intensity = _intensity(visible, bounds, rng, name in IN_STEPS)
    return replace(truth, values={**truth.values, name: family(intensity)})


def with_unknown(
    setting: CameraSetting, truth: CameraTruth, kind: Kind, rng: np.random.Generator, least: float = 2 * MILD
) -> CameraTruth:
    """Add an unknown effect that changes the pictures by `least` grey levels at least."""
    seed = int(rng.integers(2**32))

    def grow(x: float) -> CameraTruth:
        stage, step = kind(x, np.random.default_rng(seed))
        return replace(truth, unknown=kind.__name__, stages={stage: step})

    intensity = _intensity(lambda x: _difference(setting, grow(x), truth), (least, SEVERE_NOISE), rng, False)
    return grow(intensity)


def _intensity(
    measure: Callable[[float], float], bounds: tuple[float, float], rng: np.random.Generator, in_steps: bool
) -> float:
    """An intensity in (0, 1] whose measure lies within `bounds`.

    The measure is drawn, as many mild as severe ones, and met to 5 % where it grows smoothly; of effects that go by
    steps the intensity is drawn.
    """
    if in_steps:
        x = rng.uniform(0, 1)
        if not bounds[0] <= measure(x) <= bounds[1]:
            raise Redraw
        return x
    reach = measure(1.0)
    least, most = 1.05 * bounds[0], min(bounds[1] / 1.05, reach)
    if most < least:
        raise Redraw
    target = rng.uniform(least, most) if rng.random() < 0.5 else math.exp(rng.uniform(math.log(least), math.log(most)))
    low, high = 1e-5, 1.0
    x = min(1.0, max(1e-4, target / reach))
    for _ in range(12):
        reached = measure(x)
        if abs(math.log(max(reached, 1e-9) / target)) < 0.05:
            break
        low, high = (x, high) if reached < target else (low, x)
        guess = x * target / max(reached, 1e-9)  # most are proportional
        x = guess if low < guess < high else math.sqrt(low * high)
    if not bounds[0] <= measure(x) <= bounds[1]:
        raise Redraw
    return x


def _coverage(setting: CameraSetting, values: Effects, seen: Array) -> Array:
    """Of a map of the canvas [h, w], 1 where light is known: the pixels [H, W] that know all of theirs."""
    warps = {name: value for name, value in values.items() if name in _WARPS}
    channels = setting.canvas.shape[-1]
    canvas = np.broadcast_to(seen[None, :, :, None], (1, *seen.shape, channels)).astype(np.float64)
    pixels = setting.geometry.expose(optics(canvas, warps, setting.geometry, setting.sensor))
    return (np.abs(pixels - 1) < 1e-3).all(axis=-1)[0]


def _check_margin(setting: CameraSetting, truth: CameraTruth) -> None:
    """No pixel may look beyond the scene that was drawn."""
    drawn = np.ones(setting.geometry.shape)
    drawn[:2], drawn[-2:], drawn[:, :2], drawn[:, -2:] = 0, 0, 0, 0
    if not _coverage(setting, truth.values, drawn).all():
        raise Redraw


# -- the recording -----------------------------------------------------------------------------------------------------


def _recorded(setting: CameraSetting, truth: CameraTruth, answer: Answer, rng: np.random.Generator) -> GeneratedMachine:
    sensor = replace(setting.sensor, extra=truth.stages)
    raw = expose(setting.canvas, truth.values, setting.geometry, sensor, rng)
    real = compress(raw, truth.values, sensor)
    as_jpeg = "jpeg_compression" in truth.values and rng.random() < 0.2
    severity, shrink = _gap(setting, truth, answer, real, rng)
    if shrink is not None and shrink < LEAST_SHRINK:
        raise Redraw  # the unknown effect undoes the known one, as sharpening does blur
    answer = replace(answer, severity=severity, shrink=shrink, notes=notes(setting, truth))
    files = _Files(setting, raw if as_jpeg else real, truth.values["jpeg_compression"]["quality"] if as_jpeg else None)
    return GeneratedMachine(answer, files.write)


def notes(setting: CameraSetting, truth: CameraTruth) -> dict[str, object]:
    """What people may want to know of a camera."""
    return {
        "noise": 255 * setting.sensor.sigma,
        "content": setting.form.content,
        "kernel": setting.sensor.kernel,
        "curve": setting.sensor.curve,
        "rounding": setting.sensor.rounding,
        "disk": setting.sensor.disk,
        "path": setting.sensor.path,
        "uneven": setting.sensor.uneven,
        "fine": setting.geometry.scale > 1,
        "grey": setting.form.grey,
        "linear": setting.sensor.linear,
        "bits": setting.sensor.bits,
        "values": truth.values,
        "visible": {name: round(_difference(setting, truth, truth.without(name)), 3) for name in truth.values},
    }


def _gap(
    setting: CameraSetting, truth: CameraTruth, answer: Answer, real: Array, rng: np.random.Generator
) -> tuple[float | None, float | None]:
    """How severe the gap is, and the share of it that the effects of the answer remove."""
    full = 2**setting.sensor.bits - 1
    inner = setting.geometry.crop(np.zeros((1, *setting.geometry.shape)))
    seen = np.zeros(setting.geometry.shape)
    edge = setting.geometry.margin * setting.geometry.scale
    seen[edge : edge + inner.shape[1], edge : edge + inner.shape[2]] = 1
    valid = _coverage(setting, truth.values, seen)

    def squared(a: Array, b: Array) -> float:
        return float(np.mean((((a.astype(np.float64) - b) / full) ** 2)[:, valid]))

    sensor = replace(setting.sensor, extra=truth.stages)
    quiet = {name: value for name, value in truth.values.items() if name not in NOISE}
    level = [
        squared(*(photograph(setting.canvas, values, setting.geometry, sensor, rng) for _ in range(2))) / 2
        for values in (quiet, truth.values)
    ]
    floor = math.sqrt(level[0])
    before = math.sqrt(squared(real, setting.sim))
    shrink = None
    if answer.effects and answer.case != "confusable":  # there is no gap to shrink
        plain = replace(setting.geometry, scale=1)
        wide = np.pad(setting.sim / full, ((0, 0), (MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0)), mode="edge")
        predicted = photograph(wide, answer.effects, plain, setting.sensor, rng)  # as noisy as the real one
        after = math.sqrt(max(squared(real, predicted) - 2 * level[1], 0) + level[0])
        shrink = (before - after) / (before - floor)
    return before / floor, shrink


def heading(setting: CameraSetting, pairing: str) -> str:
    """What recording.yaml says of a setting's pictures."""
    g = setting.geometry
    camera = {"width": g.width, "height": g.height, "fx": g.fx, "fy": g.fy, "cx": float(g.cx), "cy": float(g.cy)}
    head = {"format": "vision-s2r/recording/1", "kind": "camera", "pairing": pairing, "camera": camera}
    return yaml.safe_dump(head | ({"encoding": "linear"} if setting.sensor.linear else {}), sort_keys=False)


@dataclass(frozen=True)
class _Files:
    """A recording before it is written."""

    setting: CameraSetting
    real: Array
    quality: float | None  # of real/*.jpg; None: PNG

    def write(self, folder: Path) -> None:
        """Write the recording into a folder that exists and is empty."""
        setting = self.setting
        (folder / "recording.yaml").write_text(heading(setting, "paired"))
        for name, pictures in (("sim", setting.sim), ("real", self.real)):
            (folder / name).mkdir()
            for k, picture in enumerate(pictures):
                write_picture(folder / name / f"{k:04d}", picture, self.quality if name == "real" else None)
        if setting.form.content == "render":
            (folder / "labels").mkdir()
            for k, picture in enumerate(setting.labels):
                write_picture(folder / "labels" / f"{k:04d}", picture[..., None], None)


# Axes of a report's "where", one of which should lead, for one effect alone; those without have no place of their own
_PLACE = ("radius", "region", "grid")
WHERE: dict[str, tuple[str, ...]] = {
    "camera_pose_offset": (),
    "uneven_illumination": ("region", "grid"),
    "cast_shadow": ("region", "grid"),
    "lens_distortion": _PLACE,
    "chromatic_aberration": (*_PLACE, "channel"),
    "vignetting": _PLACE,
    "defocus_blur": ("frequency",),
    "motion_blur": ("frequency",),
    "low_resolution": ("frequency",),
    "exposure": ("brightness", "frequency"),
    "shot_noise": ("brightness",),
    "read_noise": ("brightness",),
    "white_balance": ("channel",),
    "gamma": ("brightness", "frequency"),
    "jpeg_compression": (),
}
