"""Pictures as recordings of a camera: a calibration set, or a folder of photographs beside a folder of renders."""

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from vision_s2r.errors import UserError
from vision_s2r.files import whole_folder, write
from vision_s2r.imports import chessboard
from vision_s2r.imports.photographs import Photograph, camera, grey, photograph, photographs, said
from vision_s2r.recording import read
from vision_s2r.recording.header import FORMAT

SHOWN, HIGH = 4, 160  # pairs of the picture, and their height, px


@dataclass(frozen=True)
class ImportedPictures:
    """A camera's recording that was written."""

    folder: Path
    summary: dict[str, Any]  # what import.json holds

    def __str__(self) -> str:
        """A few lines for people."""
        s = self.summary
        lines = [f"{self.folder}: {s['photographs']} photographs, {s['form']}; {s['pairing']}"]
        lines += [f"  {note}" for note in s["notes"]]
        lines += [f"  left out: {name}, {why}" for name, why in s.get("left_out", {}).items()]
        return "\n".join(lines)


def import_chessboard(folder: Path, out: Path, inner: Sequence[int]) -> ImportedPictures:
    """A calibration set as a paired recording: the photographs that show the board, and the ideal board."""
    kept, sims, masks, about = chessboard.load(folder, inner)
    columns, rows = about["inner_corners"]
    coefficients = ", ".join(f"{name} {value:.4f}" for name, value in about["calibration"].items())
    notes = [
        f"a board of {columns} x {rows} inner corners; calibrated: {coefficients}; rms {about['rms_px']:.2f} px",
        "sim/ has the board without the lens, in flat light: what a diagnosis should find is what the camera does",
    ]
    colour = kept[0].pixels.ndim == 3
    names = [each.path.stem for each in kept]
    with whole_folder(out) as making:
        _copy(kept, names, making / "real")
        _save([np.repeat(each[..., None], 3, 2) if colour else each for each in sims], names, making / "sim", kept)
        _save(masks, names, making / "mask", None)
        return _finish(making, out, "paired", about.pop("camera"), {**said(kept), **about, "notes": notes})


def import_images(real: Path, sim: Path, out: Path, pairing: str) -> ImportedPictures:
    """Photographs beside renders: paired where their names, or in order their numbers, say so, else two sets."""
    seen, drawn = photographs(real), photographs(sim)
    notes = []
    if {each.path.stem for each in seen} == {each.path.stem for each in drawn}:
        found, names = "paired", [each.path.stem for each in drawn]
        notes.append("paired by their names")
    elif pairing == "paired" and len(seen) == len(drawn):
        found, names = "paired", [f"{k:04d}" for k in range(len(drawn))]
        notes.append("paired in the order of their names: see that it is right in import.png")
    elif pairing == "paired":
        raise UserError(f"{real}: {len(seen)} photographs beside {len(drawn)} renders, expected pairs")
    else:
        found, names = "unpaired", []
        notes.append("names differ: two sets (pairing=paired takes them in order)")
    found = pairing or found
    proposed = camera(seen)
    resized = _aligned(seen, drawn, notes)
    if proposed:
        height, width = resized[0][0].shape[:2]
        shrunk = width / proposed["width"]
        proposed = {key: value * shrunk for key, value in proposed.items()} | {
            "width": width,
            "height": height,
            "cx": (width - 1) / 2,
            "cy": (height - 1) / 2,
        }
        notes.append(
            f"EXIF's focal length proposes fx = fy = {proposed['fx']:.0f} px: an estimate, a calibration is better"
        )
    else:
        notes.append("EXIF says no focal length: no camera: is written, and a lens' terms are in units of a guess")
    summary = said(seen)
    if summary["exposures"] and np.ptp(summary["exposures"]) > 0.1:
        notes.append(
            f"exposures differ by {np.ptp(summary['exposures']):.1f} EV: lock it, or it is light of each frame's own"
        )
    with whole_folder(out) as making:
        real_names = names or [each.path.stem for each in seen]
        if resized[0][0] is seen[0].pixels:
            _copy(seen, real_names, making / "real")
        else:
            _save(resized[0], real_names, making / "real", None)
        _save(resized[1], names or [each.path.stem for each in drawn], making / "sim", None)
        return _finish(making, out, found, proposed, {**summary, "notes": notes})


def _aligned(
    seen: Sequence[Photograph], drawn: Sequence[Photograph], notes: list[str]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Pictures of both sides in one size, the smaller: by area, where height and width go down alike."""
    (height, width), (other_height, other_width) = seen[0].shape, drawn[0].shape
    if abs(width * other_height - height * other_width) > max(width, other_width):
        raise UserError(
            f"{drawn[0].path}: {other_width} x {other_height} px beside photographs of {width} x {height}, expected "
            "the same proportions: crop one of them"
        )
    size = (min(width, other_width), min(height, other_height))
    sides = []
    for side, name in ((seen, "photographs"), (drawn, "renders")):
        pixels = [each.pixels for each in side]
        if side[0].shape != size[::-1]:
            notes.append(
                f"{name} were {side[0].shape[1]} x {side[0].shape[0]} px, averaged down: less noise, no JPEG grid"
            )
            pixels = [np.asarray(cv2.resize(each, size, interpolation=cv2.INTER_AREA)) for each in pixels]
        sides.append(pixels)
    if (sides[0][0].ndim == 3) != (sides[1][0].ndim == 3):
        notes.append("one side is grey: both are")
        sides = [[cv2.cvtColor(p, cv2.COLOR_BGR2GRAY) if p.ndim == 3 else p for p in side] for side in sides]
    return sides[0], sides[1]


def _copy(given: Sequence[Photograph], names: Sequence[str], folder: Path) -> None:
    """The files themselves: a JPEG's grid is a finding."""
    folder.mkdir()
    for each, name in zip(given, names, strict=True):
        shutil.copyfile(each.path, folder / f"{name}{each.path.suffix.lower()}")


def _save(
    pictures: Sequence[np.ndarray], names: Sequence[str], folder: Path, like: Sequence[Photograph] | None
) -> None:
    """PNGs; with as many bits as `like`."""
    folder.mkdir()
    for picture, name in zip(pictures, names, strict=True):
        wide = like is not None and like[0].pixels.dtype == np.uint16
        cv2.imwrite(str(folder / f"{name}.png"), picture.astype(np.uint16) * 257 if wide else picture)


def _finish(
    making: Path, out: Path, pairing: str, camera_: Mapping[str, float] | None, summary: dict[str, Any]
) -> ImportedPictures:
    head: dict[str, Any] = {"format": FORMAT, "kind": "camera", "pairing": pairing}
    if camera_:
        head["camera"] = dict(camera_)
    (making / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    read(making, hold_out=False)
    summary = {**summary, "pairing": pairing}
    write(making / "import.json", json.dumps(summary, indent=1) + "\n")
    write(making / "import.png", _strip(making))
    return ImportedPictures(out, summary)


def _strip(folder: Path) -> bytes:
    """A few pictures of both sides, as PNG."""
    rows = []
    for side in ("real", "sim"):
        small = []
        for path in sorted((folder / side).iterdir())[:SHOWN]:
            pixels = grey(photograph(path))
            size = (round(pixels.shape[1] * HIGH / pixels.shape[0]), HIGH)
            small.append(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA))
        rows.append(np.hstack(small))
    width = min(row.shape[1] for row in rows)
    return bytes(cv2.imencode(".png", np.vstack([row[:, :width] for row in rows]))[1].tobytes())
