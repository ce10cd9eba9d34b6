"""Generated pairs of sets: what a camera saw of a place, and what its simulator renders of it, with no scene in common.

20, 100 or 500 pictures a side, in turn. Scenes of a set are drawn alike: one table or one heap of clutter, other things
in each. Of case `content` the real camera is right, and what lies before it is not what the simulator renders.

An effect changes the pictures by 4 to 20 grey levels of 255 (root mean square; noise and compression: to 12), an
unknown one by 6 to 12, and it shows: one at least of some plain statistics (how light, how colourful, how much detail,
where) is on average another by five standard errors or more of what scenes make of it. Beside another effect it still
does.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vision_s2r.gapbench.generate import camera_scenes
from vision_s2r.gapbench.generate.base import Answer, GeneratedMachine, Redraw, drawn
from vision_s2r.gapbench.generate.camera import (
    FINE,
    WHERE,
    CameraSetting,
    CameraTruth,
    Form,
    device,
    heading,
    notes,
    setting_of,
    with_effects,
    with_unknown,
)
from vision_s2r.gapbench.generate.camera_effects import Array, Geometry, Sensor, expose, photograph, write_picture
from vision_s2r.gapbench.generate.camera_scenes import SyntheticScene, texture, world
from vision_s2r.gapbench.generate.camera_unknown import SHOWN_BY_SETS

CASES = ("null", "single", "pair", "unknown", "content")
COUNTS = (20, 100, 500)  # pictures a side
EFFECTS = (  # that statistics of two sets can show
    *("defocus_blur", "motion_blur", "low_resolution", "jpeg_compression", "read_noise", "shot_noise"),
    *("vignetting", "uneven_illumination", "exposure", "gamma", "white_balance"),
)
_PAIRS = tuple(itertools.combinations(EFFECTS, 2))
_STRIDE = 27  # through the pairs, coprime to their number, so that each effect comes soon
_IN_TURN = {
    "single": tuple((name,) for name in EFFECTS),
    "pair": tuple(_PAIRS[k * _STRIDE % len(_PAIRS)] for k in range(len(_PAIRS))),
}
_LEAST, _LEAST_UNKNOWN = 4.0, 6.0  # grey levels
_PROBE = 25  # scenes by which strengths are found
_SHOWS = 5.0  # standard errors
_CHUNK = 20  # scenes at a time
_JPEG = 0.2  # of compressed pictures that come as such


@dataclass(frozen=True)
class PicturedPlace:
    """What a set of pictures is of."""

    scene: str
    look: SyntheticScene

    def draw(self, count: int, geometry: Geometry, rng: np.random.Generator) -> Array:
        """Pictures [count, h, w, 3] of a finely sampled canvas."""
        given = (self.scene, self.look, geometry.shape, geometry.fx * geometry.scale, rng)
        return np.stack([camera_scenes.draw(*given)[0] for _ in range(count)])


# -- contents that differ: (what a table's pictures share, rng) -> the same of what the real camera saw ---------------


def fuller(look: SyntheticScene, _rng: np.random.Generator) -> SyntheticScene:
    """Half as many things again, up to three times as many."""
    return replace(look, solids=(12, 22))


def emptier(look: SyntheticScene, _rng: np.random.Generator) -> SyntheticScene:
    """A few things."""
    return replace(look, solids=(1, 5))


def other_things(look: SyntheticScene, rng: np.random.Generator) -> SyntheticScene:
    """Things of other materials on the same table before the same wall."""
    kept = {look.surface, (look.surface + 1) % len(look.textures)}
    return replace(look, textures=[each if k in kept else texture(rng) for k, each in enumerate(look.textures)])


def larger_things(look: SyntheticScene, _rng: np.random.Generator) -> SyntheticScene:
    """Things half as large again."""
    return replace(look, size=1.5)


def from_above(look: SyntheticScene, _rng: np.random.Generator) -> SyntheticScene:
    """Looked down upon, while the simulator's camera goes around."""
    return replace(look, pitch=(1.15, 1.45))


CONTENTS: dict[str, tuple[Callable[[SyntheticScene, np.random.Generator], SyntheticScene], ...]] = {
    "tuning": (fuller, other_things, emptier),
    "reporting": (fuller, other_things, emptier, larger_things, from_above),
}


# -- drawing -----------------------------------------------------------------------------------------------------------


def machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    """Draw one camera of a case, and a place; see `generate.base`."""
    return drawn(lambda: _machine(case, index, split, rng), f"unpaired camera of case '{case}' number {index}", 100)


def pictures_a_side(index: int, turn: int) -> int:
    """Of a case's number `index`, whose effects are taken in turns of so many: each meets all counts."""
    return COUNTS[(index % turn + index // turn) % len(COUNTS)]


def _machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    place = PicturedPlace("table" if case == "content" else str(rng.choice(["table", "clutter"])), world(rng))
    probe, truth, real = _probe(place, rng), CameraTruth(), place
    names: tuple[str, ...] = ()
    said: dict[str, str] = {}
    turn = 1
    if case in _IN_TURN:
        names, turn = _IN_TURN[case][index % len(_IN_TURN[case])], len(_IN_TURN[case])
        truth = with_effects(probe, names, rng, _LEAST)
    elif case == "unknown":
        kinds = SHOWN_BY_SETS[split]
        truth, turn = with_unknown(probe, truth, kinds[index % len(kinds)], rng, _LEAST_UNKNOWN), len(kinds)
    elif case == "content":
        change, turn = CONTENTS[split][index % len(CONTENTS[split])], len(CONTENTS[split])
        real, said = replace(place, look=change(place.look, rng)), {"content": change.__name__}
    count = pictures_a_side(index, turn)
    others = [truth.without(name) for name in names] or [CameraTruth()] * bool(truth.unknown)
    if any(_shown(probe, truth, other, count) < _SHOWS for other in others):
        raise Redraw
    answer = Answer(
        case,
        truth.values,
        unknown=truth.unknown or ("content" if said else None),
        where=sorted(WHERE[names[0]]) if len(names) == 1 else [],
        group=f"{count} pictures a side",
        notes={**notes(probe, truth), "scene": place.scene, "count": count, **said},
    )
    files = _Sets(probe, truth, place, real, count, rng.random() < _JPEG, rng.spawn(1)[0])
    return GeneratedMachine(answer, files.write)


def _shown(probe: CameraSetting, truth: CameraTruth, other: CameraTruth, count: int) -> float:
    """By how many standard errors of two sets of `count` pictures two cameras differ, where they differ most."""
    one, another = (_plain(_taken(probe, each, np.random.default_rng(0))) for each in (truth, other))
    error = another.std(axis=0, ddof=1) * math.sqrt(2 / count)
    return float(np.max(np.abs((one - another).mean(axis=0)) / np.maximum(error, 1e-9)))


def _taken(setting: CameraSetting, truth: CameraTruth, rng: np.random.Generator) -> Array:
    """What a camera delivers of a setting's scenes."""
    sensor = replace(setting.sensor, extra=truth.stages)
    return photograph(setting.canvas, truth.values, setting.geometry, sensor, rng)


def _plain(pictures: Array) -> Array:
    """Plain statistics [N, K] of pictures [N, H, W, 3] uint8: light, contrast, colour, detail, where it is light."""
    values = pictures / 255 + 0.01
    luma = values.mean(axis=-1)
    height, width = luma.shape[1:]
    y, x = np.linspace(-1, 1, height)[:, None], np.linspace(-1, 1, width)
    detail = luma[:, 1:-1, 1:-1] - (luma[:, 2:, 1:-1] + luma[:, :-2, 1:-1] + luma[:, 1:-1, 2:] + luma[:, 1:-1, :-2]) / 4
    across, along = (np.diff(luma, axis=axis) for axis in (1, 2))
    red, green, blue = values.mean(axis=(1, 2)).T
    shapes = (shape * np.ones(luma.shape[1:]) for shape in (x, y, x**2 + y**2))
    numbers = [
        np.log(luma).mean(axis=(1, 2)),
        *(np.log(np.quantile(luma, q, axis=(1, 2))) for q in (0.05, 0.95)),
        np.log(luma.std(axis=(1, 2))),
        np.log(red / green),
        np.log(blue / green),
        np.log(np.ptp(values, axis=-1).mean(axis=(1, 2))),
        *(np.log((part**2).mean(axis=(1, 2)) + 1e-6) for part in (detail, across, along)),
        np.log(np.median(np.abs(detail), axis=(1, 2)) + 1e-3),
        *((np.log(luma) * (shape - shape.mean())).mean(axis=(1, 2)) for shape in shapes),
    ]
    return np.stack(numbers, axis=1)


def _probe(place: PicturedPlace, rng: np.random.Generator) -> CameraSetting:
    form = Form(count=_PROBE)
    geometry, sensor = device("common", rng)
    return _seen(place, _PROBE, form, geometry, sensor, rng)


def _seen(
    place: PicturedPlace, count: int, form: Form, geometry: Geometry, sensor: Sensor, rng: np.random.Generator
) -> CameraSetting:
    """That many scenes of a place before a camera."""
    return setting_of(place.draw(count, replace(geometry, scale=FINE), rng), form, geometry, sensor)


@dataclass(frozen=True)
class _Sets:
    """A recording before it is written, scene by scene."""

    probe: CameraSetting
    truth: CameraTruth
    simulated: PicturedPlace
    real: PicturedPlace
    count: int
    as_jpeg: bool  # where pictures are compressed, they come as such
    rng: np.random.Generator

    def write(self, folder: Path) -> None:
        """Write the recording into a folder that exists and is empty."""
        (folder / "recording.yaml").write_text(heading(self.probe, "unpaired"))
        self._fill(folder / "sim", (setting.sim for setting in self._chunks(self.simulated)), None)
        compressed = self.truth.values.get("jpeg_compression")
        quality = compressed["quality"] if compressed and self.as_jpeg else None
        self._fill(folder / "real", map(self._photographed, self._chunks(self.real)), quality)

    def _chunks(self, place: PicturedPlace) -> Iterator[CameraSetting]:
        probe = self.probe
        for first in range(0, self.count, _CHUNK):
            count = min(_CHUNK, self.count - first)
            yield _seen(place, count, probe.form, probe.geometry, probe.sensor, self.rng)

    def _photographed(self, setting: CameraSetting) -> Array:
        if not self.as_jpeg:
            return _taken(setting, self.truth, self.rng)
        sensor = replace(setting.sensor, extra=self.truth.stages)
        return expose(setting.canvas, self.truth.values, setting.geometry, sensor, self.rng)

    def _fill(self, folder: Path, chunks: Iterator[Array], quality: float | None) -> None:
        folder.mkdir()
        for k, picture in enumerate(itertools.chain.from_iterable(chunks)):
            write_picture(folder / f"{k:04d}", picture, quality)
