"""LeRobot's data sets (github.com/huggingface/lerobot): action and observation.state, by joint, in parquet files.

Stamps are the frame's number over the rate, so jitter is not in them. Values are in degrees (`scale`) unless the data
set was made otherwise; those of a gripper, and normalized ones, have no unit and want a scale of their own. Pictures
are videos, of which each episode is a stretch (version 3 of the format).
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from vision_s2r.errors import UserError, nearest
from vision_s2r.imports.table import ImportOptions, JointTable
from vision_s2r.recording.header import number

DEGREES = np.pi / 180
INFO, HEADER = "meta/info.json", "meta/recording.json"
UNEVEN = 1e-3  # of a step: stamps this near to the frame's number over the rate are it, rounded to float32
# What actions are, by the ending of a joint's name; LeRobot's own robots have positions.
# A speed that is commanded acts as a current of an export of ours, whose torque constant is the gain.
COMMANDS = {".pos": "target", ".current": "current", ".torque": "torque", ".force": "force", ".vel": "current"}
OPTIONAL = ("velocity", "supply", "external")


@dataclass(frozen=True)
class Dataset:
    """A data set on disk."""

    path: Path
    info: dict[str, Any]

    @classmethod
    def open(cls, path: Path | str) -> "Dataset":
        """Raises UserError where there is none."""
        path = Path(path)
        try:
            info = json.loads((path / INFO).read_text())
        except OSError as error:
            raise UserError(f"{path / INFO}: cannot be read ({error.strerror}), expected a LeRobot data set") from error
        except (ValueError, RecursionError) as error:
            raise UserError(f"{path / INFO}: is not JSON, expected a LeRobot data set") from error
        if not isinstance(info, dict) or not isinstance(info.get("features"), dict):
            raise UserError(f"{path / INFO}: features is missing, expected a LeRobot data set")
        return cls(path, info)

    @property
    def rate(self) -> float:
        """Frames a second. Raises UserError where it is none."""
        return self._number("fps", 1e-6)

    @property
    def frames(self) -> int:
        """Of all episodes together. Raises UserError where it is no number."""
        return int(self._number("total_frames", 0))

    def _number(self, key: str, low: float) -> float:
        return number({key: self.info.get(key)}, key, str(self.path / INFO), low, 1e9)

    @property
    def cameras(self) -> list[str]:
        """The features that are videos."""
        features = self.info["features"].items()
        return [key for key, each in features if isinstance(each, dict) and each.get("dtype") == "video"]

    def names(self, feature: str) -> list[str]:
        """What the elements of a vector are called. Raises UserError where that is not said."""
        try:
            names = self.info["features"][feature]["names"]
            found = [name for part in names.values() for name in part] if isinstance(names, dict) else list(names)
        except (KeyError, TypeError):
            found = [None]
        if not all(isinstance(name, str) for name in found):
            raise UserError(f"{self.path / INFO}: names are wrong or missing, expected the names of {feature}")
        return found

    def table(self, folder: str, columns: list[str]) -> Any:
        """Columns of the parquet files below a folder, as one frame. Raises UserError where they are not there."""
        import pandas  # here: it takes half a second, and only this source needs it

        files = sorted((self.path / folder).glob("**/*.parquet"))
        if not files:
            raise UserError(f"{self.path / folder}: no .parquet in it, expected a LeRobot data set")
        try:
            # `columns` again: what is an index in the file comes as none of them.
            tables = [pandas.read_parquet(file, columns=columns)[columns] for file in files]
            return pandas.concat(tables, ignore_index=True)
        except ImportError as error:
            raise UserError("parquet files need pyarrow: pip install 'vision-s2r[lerobot]'") from error
        except (OSError, ValueError, KeyError, TypeError, NotImplementedError) as error:  # pyarrow's are of these
            reason = str(error).splitlines()[0]
            raise UserError(f"{self.path}: cannot be read ({reason}), expected columns {', '.join(columns)}") from error

    def pictures(self, camera: str) -> Iterator[np.ndarray]:
        """The frames of a camera, uint8 [H, W, 3] RGB, episode after episode.

        Raises UserError where there is no such camera, or a video ends before its episodes do.
        """
        if camera not in self.cameras:
            raise UserError(f"{self.path}: no camera '{camera}', {nearest(camera, self.cameras)}")
        keys = [f"videos/{camera}/{key}" for key in ("chunk_index", "file_index", "from_timestamp")]
        episodes = self.table("meta/episodes", ["episode_index", "length", *keys]).sort_values("episode_index")
        for chunk, file, start, length in zip(*(episodes[key] for key in keys), episodes["length"], strict=True):
            path = self.path / f"videos/{camera}/chunk-{int(chunk):03d}/file-{int(file):03d}.mp4"
            yield from _stretch(path, round(float(start) * self.rate), int(length))


def load(path: Path, options: ImportOptions) -> list[JointTable]:
    """The joints of a data set, its episodes in one recording each. Raises UserError where there is none."""
    dataset = Dataset.open(path)
    names = dataset.names("action")
    vectors = {"action": "action", "position": "observation.state"}
    vectors |= {key: f"observation.{key}" for key in OPTIONAL if f"observation.{key}" in dataset.info["features"]}
    stamps = ["timestamp", "frame_index", "episode_index"]
    frames = dataset.table("data", [*vectors.values(), *stamps])
    try:
        columns = {key: np.stack(frames[feature].to_numpy()).astype(float) for key, feature in vectors.items()}
        t, index, episode = (frames[key].to_numpy(float) for key in stamps)
    except (TypeError, ValueError) as error:
        raise UserError(f"{path}: a column is no numbers ({str(error).splitlines()[0]})") from error
    if any(values.shape != (len(t), len(names)) for values in columns.values()):
        shapes = " and ".join(f"{vectors[key]} {values.shape}" for key, values in columns.items())
        raise UserError(f"{path}: {shapes}, expected {len(names)} joints of each")
    even = index / dataset.rate
    jitter = bool(np.abs(t - even).max(initial=0.0) > UNEVEN / dataset.rate)
    known = _header(path)
    found = []
    for k, name in enumerate(names):
        rows = {key: values[:, k] for key, values in columns.items()}
        found.append(_table(name, {"episode": episode, "t": t if jitter else even, **rows}, known, options))
    return found


def _table(name: str, columns: dict[str, np.ndarray], known: dict[str, Any], options: ImportOptions) -> JointTable:
    """The joint that actions of this name command."""
    ending = next((each for each in COMMANDS if name.endswith(each)), "")
    command, joint = COMMANDS.get(ending, "target"), name.removesuffix(ending)
    own = known.get(joint, {})
    angle = 1.0 if own.get("units") == "linear" else DEGREES
    scale = {"target": angle, "position": angle, "velocity": angle} | options.scale
    columns = {command if key == "action" else key: values for key, values in columns.items()}
    missing = ("velocity", "supply", "time stamps of their own: these are frame / fps")
    return JointTable(
        joint,
        {key: values * scale.get(key, 1.0) for key, values in columns.items()},
        "" if own else "sts3215",
        own.get("nominal", {}),
        own.get("control", {}),
        missing=() if own else missing,
        units=own.get("units", ""),
    )


def _header(path: Path) -> dict[str, Any]:
    """What an export of ours says of each joint, by its name: units, nominal, control; nothing of other data sets."""
    try:
        known = json.loads((path / HEADER).read_text())
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError) as error:
        raise UserError(f"{path / HEADER}: cannot be read ({error})") from error
    joints = known.get("joints") if isinstance(known, dict) else None
    parts = ("nominal", "control")
    if not isinstance(joints, dict) or not all(
        isinstance(each, dict) and all(isinstance(each.get(part, {}), dict) for part in parts)
        for each in joints.values()
    ):
        raise UserError(f"{path / HEADER}: joints is wrong or missing, expected what is believed of each")
    return joints


def _stretch(path: Path, start: int, length: int) -> Iterator[np.ndarray]:
    """So many frames of a video, from a number on."""
    video = cv2.VideoCapture(str(path))
    try:
        for k in range(start + length):
            more, frame = video.read() if k >= start else (video.grab(), None)
            if not more:
                raise UserError(f"{path}: ends after {k} frames, expected {start + length}")
            if frame is not None:
                yield cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)
    finally:
        video.release()
