"""Recordings of joints and arms, and renders, as a LeRobot data set (github.com/huggingface/lerobot), version 3.0.

Of a recording, `action` is the command and `observation.state` the position of each joint, angles in degrees, as
LeRobot's own robots have them; `t` is kept as it is. What the simulator believes of the joints goes along.
Of renders, an episode is a scene and a frame one simulated grasp of it: its pictures, `action` x, y (m), yaw (rad), and
whether it held. `vision_s2r.imports.lerobot` reads both.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.files import whole_folder
from vision_s2r.imports.lerobot import DEGREES, HEADER, INFO
from vision_s2r.options import option, validate
from vision_s2r.progress import tracked
from vision_s2r.recording import ArmRecording, JointRecording, read
from vision_s2r.recording.write import joint_head
from vision_s2r.render import Views

DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
INDICES = ("frame_index", "episode_index", "index", "task_index")
ENDINGS = {"position": ".pos", "velocity": ".vel", "torque": ".torque"}  # of an arm's actions, by what is commanded


@dataclass
class LeRobotConfig:
    """Everything that `vision-s2r export lerobot` reads."""

    recording: str = option("", "A recording of a joint or an arm …")
    renders: str = option("", "… or a folder of renders with grasps.")
    out: str = option("outputs/lerobot", "Folder of the data set; a new one.")
    task: str = option("", "What the robot was told; of a recording 'follow the command', of renders 'grasp' if empty.")
    rate: int = option(10, "Frames a second of renders, whose time means nothing; a recording has its own.", above=0)
    lossless: bool = option(False, "Videos as FFV1, bit for bit and four times as large; else as MPEG-4.")


ConfigStore.instance().store("export_lerobot_schema", node=LeRobotConfig)


@dataclass(frozen=True)
class Episode:
    """Columns [N] or [N, K] by the names of features, and pictures uint8 [N, H, W, 3] by camera."""

    columns: dict[str, np.ndarray]
    pictures: dict[str, np.ndarray]


def export_lerobot(cfg: LeRobotConfig) -> Path:
    """Write the data set of cfg; returns its folder. Raises UserError where there is nothing to write, or nowhere."""
    validate(cfg)
    if bool(cfg.recording) == bool(cfg.renders):
        raise UserError("expected recording=DIR or renders=DIR, one of them")
    try:
        import pyarrow  # noqa: F401 - pandas writes parquet with it
    except ImportError as error:
        raise UserError("parquet files need pyarrow: pip install 'vision-s2r[lerobot]'") from error
    out = Path(cfg.out)
    with whole_folder(out) as folder:
        if cfg.recording:
            _recording(folder, cfg)
        else:
            _renders(folder, cfg)
    return out


def _recording(folder: Path, cfg: LeRobotConfig) -> None:
    recording = read(cfg.recording, hold_out=False)
    if not isinstance(recording, (JointRecording, ArmRecording)):
        raise UserError(f"{cfg.recording}: is of a {recording.kind}, expected a recording of a joint or an arm")
    if isinstance(recording, ArmRecording):
        joints, robot = recording.joints, recording.model.stem
        names = {name: name + ENDINGS[recording.modes[name]] for name in joints}
    else:
        joints, robot = {"joint": recording}, "joint"
        names = {"joint": "joint" + (".pos" if recording.servo else ".current")}
    if any(joint.gains is not None for joint in joints.values()):
        raise UserError(f"{cfg.recording}: its servo had several gains, which the format cannot say")
    features = {"action": list(names.values()), "observation.state": [f"{name}.pos" for name in joints]}
    some = next(iter(joints.values()))
    optional = [key for key in ("velocity", "supply", "external") if getattr(some, key) is not None]
    features |= {f"observation.{key}": list(joints) for key in optional}
    writer = _Writer(folder, round(1 / some.sample_time), robot, cfg.task or "follow the command", cfg.lossless)
    for k, length in enumerate(some.lengths):
        columns = {"timestamp": some.time[k, :length]} | {
            feature: np.stack([_values(joint, feature, k, length) for joint in joints.values()], axis=1)
            for feature in features
        }
        writer.add(Episode(columns, {}), features)
    heads = {name: joint_head(joint) for name, joint in joints.items()}
    writer.finish()
    (folder / HEADER).write_text(json.dumps({"joints": heads}, indent=1))


def _values(joint: JointRecording, feature: str, episode: int, length: int) -> np.ndarray:
    """A joint's column of a feature, [length]."""
    key = {"action": "command", "observation.state": "position"}.get(feature, feature.removeprefix("observation."))
    values = getattr(joint, key)
    if values is None:
        raise UserError(f"some joints have a {key} and some have none: expected it of all")
    angle = key in ("position", "velocity") or (key == "command" and joint.servo)
    scale = 1 / DEGREES if angle and joint.units == "rotary" else 1.0
    return np.asarray(values[episode, :length] * scale)


def _renders(folder: Path, cfg: LeRobotConfig) -> None:
    views = Views.open(cfg.renders)
    if "grasps" not in views.names:
        raise UserError(f"{cfg.renders}: no grasps were simulated in it, expected render.grasps above 0")
    writer = _Writer(folder, cfg.rate, "parallel gripper over a bin", cfg.task or "grasp", cfg.lossless)
    features = {
        "action": ["x", "y", "yaw"],
        "observation.state": ["fx", "fy", "cx", "cy"],
        "next.success": None,
        "next.done": None,
    }
    for scene in tracked(range(len(views)), len(views), "scenes"):
        writer.add(_scene(views, scene, cfg.rate), features)
    writer.finish()


def _scene(views: Views, scene: int, rate: int) -> Episode:
    """One frame a grasp, with another randomized picture each, as long as there are some."""
    index, m = torch.tensor([scene]), views.margin
    grasps = views.batch("grasps", index)[0].numpy()
    n = len(grasps)
    pictures = {}
    for name in sorted({"canonical", "real", "randomized"} & views.names):
        picture = views.batch(name, index)[0].numpy()
        if name != "canonical":
            picture = picture[..., m : picture.shape[-3] - m, m : picture.shape[-2] - m, :]
        looks = picture if picture.ndim == 4 else picture[None]
        pictures[f"observation.images.{name}"] = looks[np.arange(n) % len(looks)]
    columns = {
        "timestamp": np.arange(n) / rate,
        "action": grasps,
        "observation.state": np.repeat(views.batch("intrinsics", index).numpy(), n, axis=0),
        "next.success": views.batch("success", index)[0].numpy().astype(bool),
        "next.done": np.arange(n) == n - 1,
    }
    return Episode(columns, pictures)


class _Writer:
    """A data set of one data file and one video a camera, episode after episode."""

    def __init__(self, folder: Path, rate: int, robot: str, task: str, lossless: bool) -> None:
        self._folder, self._rate, self._robot, self._task = folder, max(rate, 1), robot, task
        self._codec = "FFV1" if lossless else "mp4v"
        self._columns: dict[str, list[np.ndarray]] = {}
        self._episodes: list[dict[str, Any]] = []
        self._frames = 0
        self._features: dict[str, dict[str, Any]] = {}
        self._videos: dict[str, _Video] = {}

    def add(self, episode: Episode, names: Mapping[str, list[str] | None]) -> None:
        """The next episode; `names` are those of each feature's elements."""
        n = len(episode.columns["timestamp"])
        number, first = len(self._episodes), self._frames
        indices = dict(zip(INDICES, (np.arange(n), np.full(n, number), first + np.arange(n), np.zeros(n)), strict=True))
        columns = {key: _plain(values) for key, values in episode.columns.items()}
        columns |= {key: values.astype(np.int64) for key, values in indices.items()}
        for key, values in columns.items():
            self._columns.setdefault(key, []).append(values)
            self._features[key] = {
                "dtype": str(values.dtype), "shape": [*values.shape[1:]] or [1], "names": names.get(key)
            }  # fmt: skip
        row = {
            "episode_index": number, "tasks": [self._task], "length": n,
            "data/chunk_index": 0, "data/file_index": 0, "dataset_from_index": first, "dataset_to_index": first + n,
            "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
        }  # fmt: skip
        for key, pictures in episode.pictures.items():
            self._video(key, pictures.shape[1:]).add(pictures)
            about = {"chunk_index": 0, "file_index": 0, "from_timestamp": first / self._rate}
            about["to_timestamp"] = (first + n) / self._rate
            row |= {f"videos/{key}/{name}": value for name, value in about.items()}
        self._episodes.append(row)
        self._frames += n

    def _video(self, key: str, shape: tuple[int, ...]) -> "_Video":
        if key not in self._videos:
            path = self._folder / VIDEO.format(video_key=key, chunk_index=0, file_index=0)
            self._videos[key] = _Video(path, self._rate, shape, self._codec)
            about = {
                "video.height": shape[0], "video.width": shape[1], "video.channels": shape[2],
                "video.codec": {"mp4v": "mpeg4"}.get(self._codec, "ffv1"), "video.fps": self._rate,
                "video.pix_fmt": "yuv420p" if self._codec == "mp4v" else "bgr0",
                "video.is_depth_map": False, "has_audio": False,
            }  # fmt: skip
            names = ["height", "width", "channels"]
            self._features[key] = {"dtype": "video", "shape": list(shape), "names": names, "info": about}
        return self._videos[key]

    def finish(self) -> None:
        """Everything but the videos' frames."""
        import pandas  # here: it takes half a second

        columns = {key: np.concatenate(parts) for key, parts in self._columns.items()}
        stats = {key: _statistics(values) for key, values in columns.items()}
        stats |= {key: video.finish() for key, video in self._videos.items()}
        data = self._folder / DATA.format(chunk_index=0, file_index=0)
        tables = {
            data: pandas.DataFrame({key: list(values) for key, values in columns.items()}),
            self._folder / EPISODES: pandas.DataFrame(self._episodes),
            self._folder / "meta/tasks.parquet": pandas.DataFrame({"task_index": [0]}, index=[self._task]),
        }
        for path, table in tables.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            table.to_parquet(path)
        (self._folder / "meta/stats.json").write_text(json.dumps(stats, indent=1))
        (self._folder / INFO).write_text(json.dumps(self._info(), indent=1))

    def _info(self) -> dict[str, Any]:
        return {
            "codebase_version": "v3.0",
            "robot_type": self._robot,
            "total_episodes": len(self._episodes),
            "total_frames": self._frames,
            "total_tasks": 1,
            "chunks_size": 1000,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self._rate,
            "splits": {"train": f"0:{len(self._episodes)}"},
            "data_path": DATA,
            "video_path": VIDEO if self._videos else None,
            "features": self._features,
        }


class _Video:
    """The frames of one camera in one file, and what stats.json says of them."""

    def __init__(self, path: Path, rate: int, shape: tuple[int, ...], codec: str) -> None:
        path.parent.mkdir(parents=True)
        self._path = path
        self._file = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), rate, (shape[1], shape[0]))
        if not self._file.isOpened():
            raise UserError(f"{path}: this build of OpenCV writes no {codec} in mp4")
        self._count, self._frames = 0, 0
        self._sum, self._squares = np.zeros(3), np.zeros(3)
        self._low, self._high = np.ones(3), np.zeros(3)

    def add(self, pictures: np.ndarray) -> None:
        """uint8 [N, H, W, 3], RGB."""
        for picture in pictures:
            self._file.write(np.ascontiguousarray(picture[..., ::-1]))
        values = pictures.reshape(-1, 3) / 255
        self._frames += len(pictures)
        self._count += len(values)
        self._sum += values.sum(axis=0)
        self._squares += (values**2).sum(axis=0)
        self._low, self._high = np.minimum(self._low, values.min(axis=0)), np.maximum(self._high, values.max(axis=0))

    def finish(self) -> dict[str, Any]:
        """Close the file; the statistics, of a channel each, [3, 1, 1]."""
        self._file.release()
        mean = self._sum / self._count
        found = {
            "min": self._low,
            "max": self._high,
            "mean": mean,
            "std": np.sqrt(np.maximum(self._squares / self._count - mean**2, 0)),
        }
        return {key: values.reshape(3, 1, 1).tolist() for key, values in found.items()} | {"count": [self._frames]}


def _plain(values: np.ndarray) -> np.ndarray:
    """As the format has numbers: float32, or what they are."""
    return values.astype(np.float32) if values.dtype.kind == "f" else values


def _statistics(values: np.ndarray) -> dict[str, list[float]]:
    columns = values.reshape(len(values), -1).astype(np.float64)
    found = {"min": columns.min(0), "max": columns.max(0), "mean": columns.mean(0), "std": columns.std(0)}
    return {key: each.tolist() for key, each in found.items()} | {"count": [len(values)]}
