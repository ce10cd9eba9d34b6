"""Generated scenes of other colours, grain or light than the simulator's, rendered by rays or by PyBullet.

A surface or a light shows when it changes the pictures by 1.5 grey levels of 255 (root mean square) at least, and by 20
at most; so does the camera's effect beside it in a pair. PyBullet shades coded values: the gains of a label are then
those that its pixels were measured to have, in linear light.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import yaml

from vision_s2r.gapbench.generate.appearance_scenes import (
    BALL,
    TABLE,
    THING,
    Bullet,
    Look,
    Solid,
    Viewpoint,
    apart,
    cast,
    grain,
    pinhole,
    shaded,
    solids,
    unknown_thing,
)
from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine, Redraw
from vision_s2r.gapbench.generate.camera_effects import Geometry, Sensor, photograph, quantize, to_coded, to_linear
from vision_s2r.gapbench.generate.camera_strength import FAMILIES

CASES = ("null", "single", "pair")
EFFECTS = ("albedo", "light_direction", "ambient", "texture", "missing_object")
BESIDE = (  # the camera's, that a surface or a light is paired with
    *("defocus_blur", "exposure", "white_balance", "vignetting", "motion_blur"),
    *("camera_pose_offset", "gamma", "lens_distortion"),
)
SIZE, MARGIN, FOCAL, FRAMES = 128, 28, 140.0, 16
MILD, SEVERE = 1.5, 20.0  # grey levels of 255
LABELS = range(TABLE, BALL + 1)
Array = np.ndarray
Rng = np.random.Generator


@dataclass(frozen=True)
class DrawnScenes:
    """Scenes as the simulator has them and as they are: canvases [N, h, w, 3] coded; labels and depth of pictures."""

    camera: Viewpoint
    look: Look
    sim: Array
    real: Array
    labels: Array  # [N, H, W] uint8
    depth: Array  # [N, H, W] m


def machine(case: str, index: int, split: str, rng: Rng) -> GeneratedMachine:
    """Draw one scene of a case; see `generate.base`."""
    for _ in range(100):
        try:
            return _machine(case, index, rng)
        except Redraw:
            continue
    raise RuntimeError(f"no scene of case '{case}' number {index} in 100 draws")


def _machine(case: str, index: int, rng: Rng) -> GeneratedMachine:
    effect = None if case == "null" else EFFECTS[index % len(EFFECTS)]
    by_rays = (index // len(EFFECTS)) % 2 == 0
    values: Effects = {}
    geometry = Geometry(SIZE, SIZE, FOCAL, FOCAL, (SIZE - 1) / 2, (SIZE - 1) / 2, MARGIN, 1)
    if case == "pair":
        name = BESIDE[(index + index // len(EFFECTS)) % len(BESIDE)]
        values = {name: FAMILIES[name](rng, geometry)(rng.uniform(0.1, 0.7))}
    drawn, truth = _drawn(effect, by_rays, rng)
    sensor = Sensor(kernel="cubic", sigma=rng.uniform(0.4, 0.6) / 255)
    sim = quantize(geometry.crop(drawn.sim), 8)
    real = photograph(drawn.real, values, geometry, sensor, rng)
    plain = quantize(geometry.crop(drawn.real), 8)
    if effect is not None and not MILD <= _apart(plain, sim) <= SEVERE:
        raise Redraw
    if values and not MILD <= _apart(photograph(drawn.real, values, geometry, sensor, None), plain) <= SEVERE:
        raise Redraw
    answer = Answer(case, {**truth, **values}, severity=_apart(real, sim) / (255 * sensor.sigma))
    return GeneratedMachine(
        replace(answer, notes={"by": "rays" if by_rays else "PyBullet", "ambient": drawn.look.ambient}),
        lambda folder: _write(folder, sim, real, drawn),
    )


def _apart(one: Array, other: Array) -> float:
    """Root mean square difference, grey levels."""
    return float(np.sqrt(np.mean((one.astype(np.float64) - other) ** 2)))


def _drawn(effect: str | None, by_rays: bool, rng: Rng) -> tuple[DrawnScenes, Effects]:
    """Scenes in the simulator's look, and in one that differs by an effect."""
    wide = SIZE + 2 * MARGIN
    camera = pinhole(wide, FOCAL, rng)
    turn, height = rng.uniform(0, 2 * math.pi), rng.uniform(0.6, 1.2)
    look = Look({label: rng.uniform(0.15, 0.6, 3) for label in LABELS}, _towards(turn, height), rng.uniform(0.2, 0.5))
    real, truth = look, Effects()
    label = int(rng.choice(LABELS))
    if effect == "albedo":
        gains = np.exp(rng.uniform(-0.8, 0.4) + rng.uniform(-0.25, 0.25, 3))
        real = replace(look, colours={**look.colours, label: np.clip(look.colours[label] * gains, 0, 1)})
    elif effect == "light_direction":
        real = replace(look, towards=_towards(turn + rng.uniform(0.5, 2.5), rng.uniform(0.6, 1.3)))
        x, y, z = camera.rotation @ real.towards
        truth["light_direction"] = {"azimuth": math.atan2(y, x), "elevation": -math.asin(z)}
    elif effect == "ambient":
        real = replace(look, ambient=min(look.ambient + rng.uniform(0.15, 0.5), 0.95))
        truth["ambient"] = {"share": real.ambient}
    elif effect == "texture":
        amplitude, scale = rng.uniform(0.06, 0.25), rng.uniform(2.5, 8.0)
        real = replace(look, grain={label: (amplitude, scale)})
        truth[f"{label}.texture"] = {"amplitude": amplitude, "scale": scale}
    beside = None
    if effect == "missing_object":
        beside = unknown_thing(rng)
        truth["missing_object"] = _area(camera, beside)
        real = replace(look, colours={**look.colours, THING: rng.uniform(0.05, 0.9, 3)})
    frames = [_frame(camera, look, real, by_rays, beside, rng) for _ in range(FRAMES)]
    sim, seen, labels, depth = (np.stack(each) for each in zip(*frames, strict=True))
    if effect == "albedo":
        own = labels == label
        light = [to_linear(each)[own].mean(0) for each in (seen, sim)]
        measured = light[0] / light[1] if not by_rays else real.colours[label] / look.colours[label]
        truth[f"{label}.albedo"] = dict(zip(("red", "green", "blue"), measured.tolist(), strict=True))
    inner = slice(MARGIN, MARGIN + SIZE)
    return DrawnScenes(camera, look, sim, seen, labels[:, inner, inner], depth[:, inner, inner]), truth


def _towards(turn: float, height: float) -> Array:
    return np.array([math.cos(turn) * math.cos(height), math.sin(turn) * math.cos(height), math.sin(height)])


def _area(camera: Viewpoint, thing: Solid) -> dict[str, float]:
    """The rectangle of the picture (px) that something takes; Redraw where it is small, large or not all in it."""
    rows, columns = (cast(camera, [thing])[0] == THING).nonzero()
    if not len(rows):
        raise Redraw
    places = np.stack([columns, rows], 1) - MARGIN
    corner, end = places.min(0), places.max(0) + 1
    size = end - corner
    if corner.min() < 2 or end.max() > SIZE - 2 or size.min() < 10 or size.max() > SIZE // 3:
        raise Redraw
    return dict(zip(("x", "y", "width", "height"), map(float, [*corner, *size]), strict=True))


def _frame(
    camera: Viewpoint, look: Look, real: Look, by_rays: bool, beside: Solid | None, rng: Rng
) -> tuple[Array, Array, Array, Array]:
    """One scene: coded pictures [h, w, 3] in both looks, labels and depth [h, w]; `beside` is in the real one alone."""
    things, more = solids(rng), []
    if beside is not None:
        more = [beside]
        things = [each for each in things if apart(each.place, float(np.linalg.norm(each.half[:2])), more)]
    if by_rays:
        labels, depth, _ = cast(camera, things)
        pair = [to_coded(shaded(camera, *each, rng)) for each in ((things, look), (things + more, real))]
        return np.round(pair[0].clip(0, 1) * 255) / 255, pair[1].clip(0, 1), labels, depth
    with Bullet(camera, things) as drawer:
        sim, labels, depth = drawer.picture(look)
        seen = drawer.picture(real)[0] / 255 if not more else sim
    if more:
        with Bullet(camera, things + more) as drawer:
            seen = drawer.picture(real)[0] / 255
    for label, (amplitude, scale) in real.grain.items():
        light = to_linear(seen) * (1 + amplitude * (labels == label) * grain(labels.shape, scale, rng))[..., None]
        seen = to_coded(np.clip(light, 0, 1))
    return sim / 255, seen, labels, depth


def _write(folder: Path, sim: Array, real: Array, drawn: DrawnScenes) -> None:
    """Write the recording into a folder that exists and is empty."""
    centre = (SIZE - 1) / 2
    camera = {"width": SIZE, "height": SIZE, "fx": FOCAL, "fy": FOCAL, "cx": centre, "cy": centre}
    head = {"format": "vision-s2r/recording/1", "kind": "camera", "pairing": "paired", "camera": camera}
    (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    depth = np.round(drawn.depth * 1000).astype(np.uint16)
    beside: Mapping[str, Array] = {"sim": sim, "real": real, "labels": drawn.labels, "depth": depth}
    swap: Callable[[Array], Array] = lambda picture: picture[..., ::-1] if picture.ndim == 3 else picture  # noqa: E731
    for name, pictures in beside.items():
        (folder / name).mkdir()
        for k, picture in enumerate(pictures):
            cv2.imwrite(str(folder / name / f"{k:04d}.png"), swap(picture))
