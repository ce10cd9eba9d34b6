"""A camera's stream, made canonical: a video file, or a folder of pictures, beside what the translator makes of it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.files import whole
from vision_s2r.imports.lerobot import INFO, Dataset
from vision_s2r.options import option, validate
from vision_s2r.progress import tracked
from vision_s2r.translate.translator import Translator

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
BATCH = 32  # frames at a time


@dataclass
class VideoConfig:
    """Everything that `vision-s2r translate-video` reads."""

    source: str = option(
        "", "A video file, a folder of pictures, in the order of their names, or of a LeRobot data set with a camera."
    )
    camera: str = option("", "Of a data set: observation.images.NAME; the first if empty.")
    translator: str = option("bin-64", "A released checkpoint: a file (.safetensors), or a name in the package.")
    out: str = option("outputs/canonical.mp4", "The video that is written: the stream left, its canonical view right.")
    rate: float = option(10.0, "Frames a second of a folder of pictures; a video keeps its own.", above=0)
    scale: int = option(4, "Factor by which the written pictures are larger than the translator's.", low=1)


ConfigStore.instance().store("translate_video_schema", node=VideoConfig)


@dataclass(frozen=True)
class VideoStream:
    """Frames uint8 [H, W, 3] (RGB), one after another, and what is known beforehand."""

    frames: Iterator[np.ndarray]
    count: int  # as the file says; it may hold fewer
    rate: float  # frames a second


def translate_video(cfg: VideoConfig) -> Path:
    """Write the video of cfg; returns its path.

    The largest square in the middle of each frame is taken, and made as small as the translator's pictures. Raises
    UserError where the source holds no picture, or the video cannot be written.
    """
    validate(cfg)
    out = Path(cfg.out)
    if out.suffix != ".mp4":
        raise UserError(f"out={out}: expected a file that ends in .mp4")
    translator, stream = Translator.load(cfg.translator), _stream(cfg)
    size = cfg.scale * translator.size
    with whole(out) as temporary:
        # OpenCV tells formats by the ending, which the temporary name does not have.
        partial = temporary.with_name(temporary.name + out.suffix)
        writer = cv2.VideoWriter(str(partial), cv2.VideoWriter.fourcc(*"mp4v"), stream.rate, (2 * size, size))
        if not writer.isOpened():
            raise UserError(f"{out}: this build of OpenCV writes no mp4")
        try:
            for pair in _pairs(tracked(stream.frames, stream.count, "frames"), translator):
                large = cv2.resize(pair, (2 * size, size), interpolation=cv2.INTER_NEAREST)
                writer.write(cv2.cvtColor(large, cv2.COLOR_RGB2BGR))
            writer.release()
            partial.replace(temporary)
        finally:
            writer.release()
            partial.unlink(missing_ok=True)
    return out


def _pairs(frames: Iterator[np.ndarray], translator: Translator) -> Iterator[np.ndarray]:
    """Each frame as the translator sees it, beside its canonical view: uint8 [size, 2 · size, 3]."""
    batch: list[np.ndarray] = []
    for frame in frames:
        batch.append(_square(frame, translator.size))
        if len(batch) == BATCH:
            yield from _beside(batch, translator)
            batch = []
    if batch:
        yield from _beside(batch, translator)


def _beside(batch: list[np.ndarray], translator: Translator) -> Iterator[np.ndarray]:
    seen = np.stack(batch)
    yield from np.concatenate([seen, translator(torch.from_numpy(seen)).numpy()], 2)


def _square(frame: np.ndarray, size: int) -> np.ndarray:
    side = min(frame.shape[:2])
    top, left = ((n - side) // 2 for n in frame.shape[:2])
    middle = frame[top : top + side, left : left + side]
    return cv2.resize(middle, (size, size), interpolation=cv2.INTER_AREA if side > size else cv2.INTER_CUBIC)


def _stream(cfg: VideoConfig) -> VideoStream:
    if not cfg.source:
        raise UserError("source is missing, expected source=FILE, a video, or source=DIR, pictures")
    path = Path(cfg.source)
    if (path / INFO).is_file():
        dataset = Dataset.open(path)
        if not dataset.cameras:
            raise UserError(f"{path}: a data set without a camera, expected one with videos")
        camera = cfg.camera or dataset.cameras[0]
        return VideoStream(dataset.pictures(camera), dataset.frames, dataset.rate)
    if path.is_dir():
        paths = sorted(each for each in path.iterdir() if each.suffix.lower() in PICTURES)
        if not paths:
            raise UserError(f"{path}: no pictures, expected some of {', '.join(PICTURES)}")
        return VideoStream(map(_read, paths), len(paths), cfg.rate)
    if not path.is_file():
        raise UserError(f"{path}: there is no such file or folder")
    video = cv2.VideoCapture(str(path))
    if not video.isOpened():
        raise UserError(f"{path}: OpenCV reads no video in it")
    first, frame = video.read()
    if not first:
        raise UserError(f"{path}: no frame can be read")
    rate = video.get(cv2.CAP_PROP_FPS)
    return VideoStream(_frames(video, frame), int(video.get(cv2.CAP_PROP_FRAME_COUNT)), rate if rate > 0 else cfg.rate)


def _frames(video: cv2.VideoCapture, frame: np.ndarray) -> Iterator[np.ndarray]:
    more = True
    while more:
        yield cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)
        more, frame = video.read()


def _read(path: Path) -> np.ndarray:
    frame = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if frame is None:
        raise UserError(f"{path}: not a picture, or a damaged one")
    return cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)
