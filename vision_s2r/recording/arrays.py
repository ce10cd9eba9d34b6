"""Recordings of what is in memory, checked as those of folders are."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from vision_s2r.errors import UserError
from vision_s2r.recording import header, joint, table
from vision_s2r.recording.camera import LEAST_FRAMES, LEAST_SIDE, channels, to_unit
from vision_s2r.recording.data import CameraRecording, JointRecording

HERE = Path("arrays")  # in the place of a file's name in messages; a line is a sample there


def from_arrays(
    *,
    nominal: Mapping[str, float],
    sample_time: float,
    units: Literal["rotary", "linear"] = "rotary",
    control: Mapping[str, float] | None = None,
    **columns: Any,
) -> JointRecording:
    """A joint's recording from arrays, named as the columns of joint.csv: position, current (or torque, target) …

    Each is one episode [T], several [E, T] (NaN in position after the end of shorter ones), or a list of [T].
    `nominal`, `sample_time` (s), `units` and `control` are as in recording.yaml. Raises UserError as `read` does.
    """
    split = {name: _by_episode(name, values) for name, values in columns.items() if values is not None}
    if "position" not in split:
        raise UserError(f"{HERE}: missing position")
    lengths = [int(np.isfinite(each).sum()) for each in split["position"]]
    for name, values in split.items():
        if len(values) != len(lengths) or any(len(each) < n for each, n in zip(values, lengths, strict=True)):
            raise UserError(f"{HERE}: {name} and position are of different lengths, expected as many samples of each")
    rows = {name: np.concatenate([v[:n] for v, n in zip(some, lengths, strict=True)]) for name, some in split.items()}
    rows["episode"] = np.repeat(np.arange(len(lengths)), lengths)
    return from_table(rows, nominal=nominal, sample_time=sample_time, units=units, control=control)


def from_table(
    columns: Any,
    *,
    nominal: Mapping[str, float],
    sample_time: float,
    units: Literal["rotary", "linear"] = "rotary",
    control: Mapping[str, float] | None = None,
) -> JointRecording:
    """A joint's recording from a pandas frame, or a mapping of arrays [rows], with the columns of joint.csv.

    Without `episode` it is one; without `t`, rows are `sample_time` (s) apart. Else as `from_arrays`.
    """
    head: dict[str, Any] = {"sample_time": sample_time, "units": units, "nominal": dict(nominal)}
    head |= {} if control is None else {"control": dict(control)}
    rows = {str(name): np.asarray(columns[name], dtype=np.float64) for name in columns}
    count = len(next(iter(rows.values()), ()))
    rows.setdefault("episode", np.zeros(count))
    if "t" not in rows:
        starts = {number: np.flatnonzero(rows["episode"] == number) for number in np.unique(rows["episode"])}
        rows["t"] = np.zeros(count)
        for some in starts.values():
            rows["t"][some] = np.arange(len(some)) * float(sample_time)
    joint.check_names(list(rows), HERE)
    lines = np.arange(count)
    table.check_values(rows, lines, HERE)
    return joint.of_columns(head, rows, lines, True, str(HERE), HERE)


def _by_episode(name: str, values: Any) -> list[np.ndarray]:
    """One episode [T], several [E, T], or a list of [T]."""
    try:
        found = [np.asarray(each, dtype=np.float64) for each in values]
    except (TypeError, ValueError):
        raise UserError(f"{HERE}: {name} is no array of numbers") from None
    if found and all(each.ndim == 0 for each in found):
        found = [np.array(found)]
    if not found or any(each.ndim != 1 for each in found):
        raise UserError(f"{HERE}: {name} is no array of episodes and samples, expected [T], [E, T] or a list of [T]")
    return found


def from_pictures(
    real: np.ndarray,
    sim: np.ndarray,
    *,
    pairing: Literal["paired", "unpaired"] = "paired",
    encoding: Literal["srgb", "linear"] = "srgb",
    labels: np.ndarray | None = None,
    mask: np.ndarray | None = None,
    depth: np.ndarray | None = None,
    intrinsics: Sequence[float] | None = None,
) -> CameraRecording:
    """A camera's recording from pictures [N, H, W, 3] RGB or [N, H, W]: uint8, uint16, or from 0 to 1 of 8 bits.

    `labels`, `mask` and `depth` (m, 0 where unknown) are [N, H, W] of `sim`; `intrinsics` fx, fy, cx, cy in px.
    Raises UserError as `read` does.
    """
    header.choice({"pairing": pairing}, "pairing", ("paired", "unpaired"), str(HERE))
    header.choice({"encoding": encoding}, "encoding", ("srgb", "linear"), str(HERE))
    real, sim = _pictures(real, "real"), _pictures(sim, "sim")
    if real.shape[1:3] != sim.shape[1:3] or (pairing == "paired" and len(real) != len(sim)):
        raise UserError(f"{HERE}: real is {real.shape} and sim {sim.shape}, expected as many pictures of one size")
    for name, each in (("labels", labels), ("mask", mask), ("depth", depth)):
        if each is not None and each.shape != sim.shape[:3]:
            raise UserError(f"{HERE}: {name} is {each.shape}, expected {sim.shape[:3]} like sim")
    bits = 16 if real.dtype == np.uint16 else 8
    sim, real, grey = channels(sim, real, HERE)
    return CameraRecording(
        pairing=pairing,
        encoding=encoding,
        sim=_unit(sim),
        real=_unit(real),
        labels=_as(labels, np.uint8),
        mask=_as(mask, np.bool_),
        depth=_as(depth, np.float32),
        intrinsics=None if intrinsics is None else np.asarray(intrinsics, dtype=np.float64),
        bits=bits,
        grey=grey,
        names=tuple(f"{k:04}" for k in range(len(sim))),
        real_names=tuple(f"{k:04}" for k in range(len(real))),
    )


def _as(array: np.ndarray | None, kind: type) -> np.ndarray | None:
    return None if array is None else np.asarray(array).astype(kind)


def _pictures(pictures: ArrayLike, name: str) -> np.ndarray:
    """[N, H, W, 1 or 3], with as many and as large pictures as a diagnosis needs."""
    pictures = np.asarray(pictures)
    pictures = pictures[..., None] if pictures.ndim == 3 else pictures
    if pictures.ndim != 4 or pictures.shape[3] not in (1, 3):
        raise UserError(f"{HERE}: {name} is of shape {pictures.shape}, expected [N, H, W] or [N, H, W, 3]")
    if len(pictures) < LEAST_FRAMES or min(pictures.shape[1:3]) < LEAST_SIDE:
        least = f"{LEAST_FRAMES} pictures of {LEAST_SIDE} px each way"
        raise UserError(f"{HERE}: {name} is of shape {pictures.shape}, expected at least {least}")
    if pictures.dtype in (np.uint8, np.uint16):
        return pictures
    if pictures.dtype.kind != "f" or not np.all((pictures >= 0) & (pictures <= 1)):
        raise UserError(f"{HERE}: {name} is {pictures.dtype}, expected uint8, uint16 or numbers from 0 to 1")
    return pictures


def _unit(pictures: np.ndarray) -> np.ndarray:
    return pictures.astype(np.float32) if pictures.dtype.kind == "f" else to_unit(pictures)
