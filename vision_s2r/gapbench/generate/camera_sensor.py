"""Sensors before an even light: flat fields of several exposures, with what real sensors have beside their noise.

Electrons are counted one by one; pixels have a response and a dark signal of their own, some are hot, rows are read
with an offset, the light falls off and flickers, black is not quite zero. The simulator's pictures are the exposures.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import yaml

from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine
from vision_s2r.gapbench.generate.camera_effects import Array, to_coded, write_picture

DARKEST = (0.003, 0.02, 0.1)  # light of the darkest frames
EVEN, CODED, COLOUR = 0.3, 0.25, 0.3  # how often something is absent, coded, in colour


@dataclass(frozen=True)
class Chip:
    """A sensor and its light; electrons unless said otherwise."""

    full_well: float
    read: float
    response: float  # spread of the pixels' gains, a share
    dark: float  # spread of the pixels' offsets
    hot: float  # share of the pixels
    rows: float  # spread of the offsets of a frame's rows
    falloff: float  # of the light in the corners, a share
    flicker: float  # spread of the frames' light, a share
    black: float  # of full scale, under all values
    bits: int
    coded: bool  # sRGB, 8 bits, from a converter of 12


def machine(rng: np.random.Generator) -> GeneratedMachine:
    """Draw one sensor, and flat fields before it."""
    chip, channels = _chip(rng), 3 if rng.random() < COLOUR else 1
    height, width = int(rng.choice([120, 160, 240])), int(rng.choice([160, 200, 320]))
    count, steps, darkest = int(rng.choice([12, 16, 24])), int(rng.choice([4, 6, 8])), float(rng.choice(DARKEST))
    levels = rng.permutation(np.resize(np.geomspace(darkest, 0.85, steps), count))
    sim = np.broadcast_to(levels[:, None, None, None], (count, height, width, channels))
    real = exposed(chip, sim, rng)
    read: Effects = {"read_noise": {"sigma": chip.read / chip.full_well}}
    fall: Effects = {"vignetting": {"strength": chip.falloff}} if chip.falloff else {}
    shot: Effects = {"shot_noise": {"full_well": chip.full_well}}
    notes = {**asdict(chip), "darkest": darkest, "steps": steps, "frames": count, "colour": channels == 3}
    shows = _shows(chip, darkest)
    answer = Answer(
        "sensor", shot | (read if shows else {}), fall | ({} if shows else read), unknown="sensor", notes=notes
    )
    return GeneratedMachine(answer, lambda folder: _write(folder, stored(chip, sim), stored(chip, real), chip.coded))


def _chip(rng: np.random.Generator) -> Chip:
    def perhaps(low: float, high: float) -> float:
        return float(rng.uniform(low, high)) * (rng.random() >= EVEN)

    coded = bool(rng.random() < CODED)
    return Chip(
        full_well=float(np.exp(rng.uniform(np.log(2_000), np.log(20_000)))),
        read=float(rng.uniform(2, 11)),
        response=perhaps(0.003, 0.012),
        dark=perhaps(1, 4),
        hot=perhaps(1e-4, 6e-4),
        rows=perhaps(0.5, 2),
        falloff=perhaps(0.01, 0.06),
        flicker=perhaps(0.001, 0.005),
        black=perhaps(0.0005, 0.003),
        bits=8 if coded else int(rng.choice([8, 10, 12, 14, 16])),
        coded=coded,
    )


def _shows(chip: Chip, darkest: float) -> bool:
    """Whether read noise is a third of the darkest frames' noise or more, and more than the step of their values."""
    step = 1 / (2**chip.bits - 1)
    if chip.coded:
        step *= 1e-4 / float(np.diff(to_coded(np.array([darkest, darkest + 1e-4])))[0])
    return bool(chip.read**2 > chip.full_well * darkest / 2 and chip.read / chip.full_well > step)


def exposed(chip: Chip, light: Array, rng: np.random.Generator) -> Array:
    """What a sensor makes of light [N, H, W, C], a share of what fills it: linear values of its converter."""
    frames, height, width, channels = light.shape
    one = (height, width, channels)
    y, x = (np.linspace(-1, 1, size) * size for size in (height, width))
    radius = (y[:, None] ** 2 + x**2) / (height**2 + width**2)  # squared, 1 in the corners
    gain = (1 - chip.falloff * radius[..., None]) * rng.normal(1, chip.response, one)
    own = rng.normal(0, chip.dark, one) + (rng.random(one) < chip.hot) * rng.exponential(400, one)
    electrons = rng.poisson(chip.full_well * light * gain.clip(0) * rng.normal(1, chip.flicker, (frames, 1, 1, 1)))
    rows = rng.normal(0, chip.rows, (frames, height, 1, 1))
    values = (electrons + own + rows + rng.normal(0, chip.read, light.shape)) / chip.full_well + chip.black
    full = 2 ** (12 if chip.coded else chip.bits) - 1
    return np.rint(values.clip(0, 1) * full) / full


def stored(chip: Chip, values: Array) -> Array:
    """Linear values as a file has them: of 8 bits or 16."""
    if chip.coded:
        values = to_coded(values)
    full, kind = (255, np.uint8) if chip.bits == 8 else (65535, np.uint16)
    return np.rint(values * full).astype(kind)


def _write(folder: Path, sim: Array, real: Array, coded: bool) -> None:
    head = {"format": "vision-s2r/recording/1", "kind": "camera", "pairing": "paired"}
    head["encoding"] = "srgb" if coded else "linear"
    (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    for name, pictures in (("sim", sim), ("real", real)):
        (folder / name).mkdir()
        for k, picture in enumerate(pictures):
            write_picture(folder / name / f"{k:04d}", picture, None)
