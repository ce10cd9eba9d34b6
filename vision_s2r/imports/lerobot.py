"""LeRobot's data sets (github.com/huggingface/lerobot): action and observation.state, by joint, in parquet files.

Stamps are the frame's number over the rate, so jitter is not in them. Values are in degrees (`scale`) unless the data
set was made otherwise; those of a gripper, and normalized ones, have no unit and want a scale of their own.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.imports.table import ImportOptions, Table

DEGREES = np.pi / 180


def load(path: Path, options: ImportOptions) -> list[Table]:
    """The joints of a data set, its episodes in one recording each. Raises UserError where there is none."""
    info = path / "meta" / "info.json"
    try:
        names = _names(json.loads(info.read_text())["features"]["action"]["names"])
    except OSError as error:
        raise UserError(f"{info}: cannot be read ({error.strerror}), expected a LeRobot data set") from error
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{info}: {error} is wrong or missing, expected the names of the actions") from error
    frames = _frames(path)
    action, state = (np.stack(frames[name].to_numpy()).astype(float) for name in ("action", "observation.state"))
    if action.shape != state.shape or action.shape[1] != len(names):
        raise UserError(
            f"{path}: actions {action.shape} and states {state.shape}, expected {len(names)} joints of each"
        )
    scale = {name: options.scale.get(name, DEGREES) for name in ("target", "position")}
    return [
        Table(
            name.removesuffix(".pos"),
            {
                "episode": frames["episode_index"].to_numpy(float),
                "t": frames["timestamp"].to_numpy(float),
                "target": action[:, k] * scale["target"],
                "position": state[:, k] * scale["position"],
            },
            "sts3215",
            missing=("velocity", "supply", "time stamps of their own: these are frame / fps"),
        )
        for k, name in enumerate(names)
    ]


def _names(names: Any) -> list[str]:
    found = [name for part in names.values() for name in part] if isinstance(names, dict) else list(names)
    if not all(isinstance(name, str) for name in found):
        raise ValueError("names")
    return found


def _frames(path: Path) -> Any:
    import pandas  # here: it takes half a second, and only this source needs it

    files = sorted(path.glob("data/**/*.parquet"))
    if not files:
        raise UserError(f"{path / 'data'}: no .parquet in it, expected a LeRobot data set")
    columns = ["action", "observation.state", "timestamp", "episode_index"]
    try:
        return pandas.concat([pandas.read_parquet(file, columns=columns) for file in files], ignore_index=True)
    except ImportError as error:
        raise UserError("parquet files need pyarrow: pip install pyarrow") from error
    except (OSError, ValueError, KeyError) as error:
        raise UserError(f"{path}: cannot be read ({error}), expected columns {', '.join(columns)}") from error
