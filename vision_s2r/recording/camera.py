"""Recordings of a camera: folders of pictures beside their header."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, cast

import cv2
import numpy as np

from vision_s2r.errors import UserError, check_keys
from vision_s2r.recording import header
from vision_s2r.recording.data import CameraRecording

KEYS = ("format", "kind", "pairing", "camera", "encoding", "label_names")
CAMERA_KEYS = ("width", "height", "fx", "fy", "cx", "cy")
REAL_SUFFIXES, RENDER_SUFFIXES = (".png", ".jpg", ".jpeg"), (".png",)  # a render that went through JPEG is not clean
LEAST_FRAMES = 4  # to hold some out and still have a spread
LEAST_SIDE = 16  # px
LAST_LABEL, LONGEST_NAME = 255, 60
IGNORED = ("thumbs.db", "desktop.ini")  # what file browsers leave


def read(folder: Path, content: Mapping[str, Any], hold_out: bool) -> CameraRecording:
    """The recording of a folder whose header is `content`. Raises UserError for whatever cannot be."""
    where = str(folder / "recording.yaml")
    check_keys(content, KEYS, where, ("pairing",))
    pairing = cast(Literal["paired", "unpaired"], header.choice(content, "pairing", ("paired", "unpaired"), where))
    encoding = cast(Literal["srgb", "linear"], header.choice(content, "encoding", ("srgb", "linear"), where, "srgb"))
    real_files, sim_files = _files(folder / "real", REAL_SUFFIXES), _files(folder / "sim", RENDER_SUFFIXES)
    if pairing == "paired":
        _check_names(sim_files, real_files, folder / "sim", folder / "real")
    least = LEAST_FRAMES if hold_out else 1
    for files, name in ((real_files, "real"), (sim_files, "sim")):
        if len(files) < least:
            raise UserError(f"{folder / name}: {len(files)} picture(s), too few to hold any out, expected {least}")
    real, sim = _pictures(list(real_files.values())), _pictures(list(sim_files.values()))
    _check_size(sim, sim_files, real.shape[1:3], "those of real/")
    sim, real, grey = channels(sim, real, folder)
    return CameraRecording(
        pairing=pairing,
        encoding=encoding,
        sim=to_unit(sim),
        real=to_unit(real),
        labels=_beside(folder / "labels", sim_files, sim.shape[1:3], np.uint8),
        mask=_mask(_beside(folder / "mask", sim_files, sim.shape[1:3], np.uint8)),
        depth=_depth(_beside(folder / "depth", sim_files, sim.shape[1:3], np.uint16)),
        intrinsics=_intrinsics(content, sim.shape[1:3], where),
        bits=8 * real.itemsize,
        grey=grey,
        names=tuple(sim_files),
        real_names=tuple(real_files),
        label_names=_label_names(content, where),
    )


def _files(folder: Path, suffixes: Sequence[str]) -> dict[str, Path]:
    """The pictures of a folder by name without suffix, in order of name."""
    if not folder.is_dir():
        raise UserError(f"{folder}: no such folder, expected pictures in it")
    try:
        paths = sorted(folder.iterdir())
    except OSError as error:
        raise UserError(f"{folder}: cannot be read ({error.strerror})") from error
    files: dict[str, Path] = {}
    for path in paths:
        if path.name.startswith(".") or path.name.lower() in IGNORED:
            continue
        if path.suffix.lower() not in suffixes:
            raise UserError(f"{path}: expected only files ending in {' or '.join(suffixes)} here")
        if path.stem in files:
            raise UserError(f"{path}: there is {files[path.stem].name} too, expected one picture of a name")
        files[path.stem] = path
    if not files:
        raise UserError(f"{folder}: an empty folder, expected pictures in it")
    return files


def _check_names(expected: Mapping[str, Path], files: Mapping[str, Path], one: Path, other: Path) -> None:
    """UserError unless both folders hold the same names."""
    for lacking, holding in ((files, expected), (expected, files)):
        alone = [path for name, path in holding.items() if name not in lacking]
        if alone:
            raise UserError(
                f"{alone[0]}: no picture of this name in {(other if lacking is files else one).name}/"
                + (f" (nor of {len(alone) - 1} others)" if len(alone) > 1 else "")
            )


def _pictures(paths: list[Path]) -> np.ndarray:
    """uint8 or uint16 [N, H, W, C], C = 1 or 3 (RGB); UserError unless all are of one size, depth and colour."""
    first = _picture(paths[0])
    pictures = np.empty((len(paths), *first.shape), first.dtype)
    for k, path in enumerate(paths):
        picture = _picture(path) if k else first
        for value, expected, what in (
            (picture.shape[:2], first.shape[:2], "height and width"),
            (picture.dtype.itemsize * 8, first.dtype.itemsize * 8, "bits"),
            (picture.shape[2], first.shape[2], "channels"),
        ):
            if value != expected:
                raise UserError(f"{path}: {what} {value}, but {expected} in {paths[0].name}, expected the same in all")
        pictures[k] = picture
    return pictures


def _picture(path: Path) -> np.ndarray:
    """uint8 or uint16 [H, W, C], C = 1 (grey) or 3 (RGB)."""
    try:
        content = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        picture = cv2.imdecode(content, cv2.IMREAD_UNCHANGED) if len(content) else None
    except cv2.error:
        picture = None
    if picture is None or picture.dtype not in (np.uint8, np.uint16):
        raise UserError(f"{path}: cannot be decoded as a picture of 8 or 16 bits")
    if min(picture.shape[:2]) < LEAST_SIDE:
        raise UserError(f"{path}: {picture.shape[1]} x {picture.shape[0]} px, expected at least {LEAST_SIDE} each way")
    if picture.ndim == 2:
        return picture[..., None]
    if picture.shape[2] == 4:
        if np.any(picture[..., 3] != _full(picture)):
            raise UserError(f"{path}: partly transparent, expected an opaque picture (a mask goes in mask/)")
        picture = picture[..., :3]
    return picture[..., ::-1]


def _check_size(pictures: np.ndarray, files: Mapping[str, Path], expected: tuple[int, int], of: str) -> None:
    if pictures.shape[1:3] != expected:
        (height, width), (other_height, other_width) = pictures.shape[1:3], expected
        raise UserError(
            f"{next(iter(files.values()))}: {width} x {height} px, expected {other_width} x {other_height} px like {of}"
        )


def channels(sim: np.ndarray, real: np.ndarray, folder: Path) -> tuple[np.ndarray, np.ndarray, bool]:
    """Both with three channels, and whether those are equal throughout: whether there is no colour."""
    grey = [pictures.shape[3] == 1 or _colourless(pictures) for pictures in (sim, real)]
    if grey[0] != grey[1] and 1 in (sim.shape[3], real.shape[3]):
        names = ("sim", "real") if sim.shape[3] == 1 else ("real", "sim")
        raise UserError(f"{folder}: {names[0]}/ is grey and {names[1]}/ in colour, expected both of one kind")
    sim, real = (np.broadcast_to(pictures, (*pictures.shape[:3], 3)) for pictures in (sim, real))
    return sim, real, all(grey)


def _colourless(pictures: np.ndarray) -> bool:
    return bool((pictures[..., :1] == pictures[..., 1:]).all())


def _full(pictures: np.ndarray) -> int:
    return 255 if pictures.dtype == np.uint8 else 65535


def to_unit(pictures: np.ndarray) -> np.ndarray:
    """float32 in [0, 1]."""
    return pictures.astype(np.float32) / np.float32(_full(pictures))


def _beside(folder: Path, sim: Mapping[str, Path], size: tuple[int, int], kind: type) -> np.ndarray | None:
    """The pictures of one channel in a folder that may be absent, one for each of `sim`'s: `kind` [N, H, W]."""
    if not folder.exists():
        return None
    files = _files(folder, RENDER_SUFFIXES)
    _check_names(sim, files, folder.with_name("sim"), folder)
    pictures = _pictures(list(files.values()))
    _check_size(pictures, files, size, "those of sim/")
    if pictures.dtype != kind or not (pictures.shape[3] == 1 or _colourless(pictures)):
        bits = 8 * np.dtype(kind).itemsize
        raise UserError(f"{next(iter(files.values()))}: expected one channel of {bits} bits")
    return pictures[..., 0]


def _mask(pictures: np.ndarray | None) -> np.ndarray | None:
    if pictures is None:
        return None
    mask = pictures == 255
    if not mask.any():
        raise UserError("mask/: no pixel is 255, expected 255 where the simulator's pictures are meant")
    return mask


def _depth(pictures: np.ndarray | None) -> np.ndarray | None:
    if pictures is None:
        return None
    if not pictures.any():
        raise UserError("depth/: every pixel is 0, expected mm along the optical axis, and 0 where it is not known")
    return pictures.astype(np.float32) / 1000


def _label_names(content: Mapping[str, Any], where: str) -> dict[int, str]:
    """What the labels are called, by number."""
    if "label_names" not in content:
        return {}
    names: dict[int, str] = {}
    for key, name in header.mapping(content, "label_names", where).items():
        if not key.isascii() or not key.isdigit() or int(key) > LAST_LABEL:
            raise UserError(f"{where}: label_names: {key!r} is no label, expected numbers from 0 to {LAST_LABEL}")
        if not isinstance(name, str) or not name.strip() or len(name) > LONGEST_NAME or not name.isprintable():
            raise UserError(f"{where}: label_names: {key} has no name, expected a word or a few")
        names[int(key)] = name.strip()
    return names


def _intrinsics(content: Mapping[str, Any], size: tuple[int, int], where: str) -> np.ndarray | None:
    if "camera" not in content:
        return None
    camera = header.mapping(content, "camera", where)
    where = f"{where}: camera"
    check_keys(camera, CAMERA_KEYS, where, CAMERA_KEYS)
    for key, pixels in (("height", size[0]), ("width", size[1])):
        if header.number(camera, key, where, 0, 1e6) != pixels:
            raise UserError(f"{where}: {key} is {camera[key]}, but pictures have {pixels} px")
    focal = [header.number(camera, key, where, 0.0, 1e6, inclusive=False) for key in ("fx", "fy")]
    centre = [header.number(camera, key, where, -1e6, 1e6) for key in ("cx", "cy")]
    return np.array(focal + centre)
