"""What a report asks of a camera, done by the generator's own: a print photographed in poses, or scenes at random."""

import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from vision_s2r.gapbench.generate.camera import (
    FINE,
    MARGIN,
    Form,
    scenes,
    setting_of,
    write_picture,
)
from vision_s2r.gapbench.generate.camera_effects import Array, Geometry, Sensor, binned, compress, expose

WALL = 0.5  # coded value of what is behind a print
SHARPER = 4  # samples of a print to one of the canvas, along each axis


def asked(report: Path, folder: Path, answer: dict[str, Any]) -> Array:
    """The scenes [N, h, w, 3] of a report's next_recording.csv: its next_recording.png held in these poses."""
    table = np.atleast_1d(np.genfromtxt(report / "next_recording.csv", delimiter=",", names=True))
    dots = np.asarray(cv2.imread(str(report / "next_recording.png"), cv2.IMREAD_GRAYSCALE)) / 255
    poses = np.stack([table[name] for name in ("x", "y", "z", "pitch", "yaw", "roll")], axis=1)
    fine = _geometry(folder, FINE)
    return np.stack([held(dots, pose, fine) for pose in poses])


def held(dots: Array, pose: Array, geometry: Geometry) -> Array:
    """The canvas [h, w, 3] of a print [H, W] before a wall; poses are in widths of the print, as a report has them."""
    height, width = dots.shape
    right, down, _ = cv2.Rodrigues(np.asarray(pose[3:], dtype=np.float64))[0].T
    # Corners of the print, half a dot beyond the middles of its outermost ones.
    x, y = np.array([-0.5, 0.5, 0.5, -0.5]), np.array([-0.5, -0.5, 0.5, 0.5]) * height / width
    points = pose[:3] + x[:, None] * right + y[:, None] * down
    column = geometry.fx * points[:, 0] / points[:, 2] + geometry.cx
    row = geometry.fy * points[:, 1] / points[:, 2] + geometry.cy
    finer = Geometry(**{**vars(geometry), "scale": geometry.scale * SHARPER})
    to = np.stack(finer.samples(column, row), axis=1).astype(np.float32)
    source = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32) - 0.5
    warp = cv2.getPerspectiveTransform(source, to)
    drawn = cv2.warpPerspective(dots, warp, finer.shape[::-1], flags=cv2.INTER_LINEAR, borderValue=WALL)
    return binned(drawn[None, ..., None], SHARPER)[0] * np.ones(3)


def at_random(folder: Path, answer: dict[str, Any], like: Array, rng: np.random.Generator) -> Array:
    """As many scenes as a recording's are drawn."""
    return scenes(Form(count=len(like)), _geometry(folder, FINE), rng)[0]


def continued(folder: Path, out: Path, answer: dict[str, Any], canvas: Array, rng: np.random.Generator) -> None:
    """A recording of a camera once more, with pictures of these scenes [N, h, w, 3] behind those that it has."""
    notes = answer["notes"]
    sensor = Sensor(sigma=notes["noise"] / 255, **{key: notes[key] for key in _OF_SENSOR})
    geometry = _geometry(folder, FINE if notes["fine"] else 1)
    setting = setting_of(canvas, Form(), geometry, sensor)
    raw = expose(setting.canvas, notes["values"], geometry, sensor, rng)
    as_jpeg = next((folder / "real").iterdir()).suffix == ".jpg"
    real = raw if as_jpeg else compress(raw, notes["values"], sensor)
    quality = notes["values"]["jpeg_compression"]["quality"] if as_jpeg else None
    shutil.copytree(folder, out)
    first = len(list((folder / "sim").iterdir()))
    for k, (clean, picture) in enumerate(zip(setting.sim, real, strict=True), first):
        write_picture(out / "sim" / f"{k:04d}", clean, None)
        write_picture(out / "real" / f"{k:04d}", picture, quality)


_OF_SENSOR = ("kernel", "linear", "bits", "curve", "rounding", "disk", "path", "uneven")


def _geometry(folder: Path, scale: int) -> Geometry:
    """The camera of a recording."""
    return Geometry(**yaml.safe_load((folder / "recording.yaml").read_text())["camera"], margin=MARGIN, scale=scale)
