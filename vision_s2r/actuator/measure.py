"""How far models of the motor are from the torque sensor, and how well policies transfer, with 95 % intervals.

Arrays are [S, M]: S seeds on the same M motions; intervals are bootstrapped over both.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from vision_s2r.actuator.log import DriveLog
from vision_s2r.actuator.models import MotorModel
from vision_s2r.actuator.policy import SETTLE, rms_error
from vision_s2r.statistics import Bootstrap


def torque_errors(
    logs: Sequence[DriveLog], models: Mapping[str, Sequence[np.ndarray]], sample_time: float
) -> dict[str, dict[str, Any]]:
    """By model, mean absolute and RMS error (N·m), and by what factors the first model's are larger.

    `logs` [S] are of the same M references, `models` hold torques [S][M, T] that each says of them.
    """
    settled = round(SETTLE / sample_time)
    off = {
        name: [torque[:, settled:] - log.torque[:, settled:] for torque, log in zip(torques, logs, strict=True)]
        for name, torques in models.items()
    }
    absolute = {name: np.array([abs(each).mean(axis=1) for each in rest]) for name, rest in off.items()}
    squared = {name: np.array([(each**2).mean(axis=1) for each in rest]) for name, rest in off.items()}
    first = next(iter(models))
    bootstrap = Bootstrap(absolute[first].shape[1])
    found = {}
    for name in models:
        ratio = bootstrap.ratio(squared[first], squared[name])
        found[name] = {
            "mean_absolute": float(absolute[name].mean()),
            "rms": float(np.sqrt(squared[name].mean())),
            "factor": asdict(bootstrap.ratio(absolute[first], absolute[name])),
            "factor_rms": {key: float(np.sqrt(value)) for key, value in asdict(ratio).items()},
            "by_seed": absolute[name].mean(axis=1).tolist(),
        }
    return found


def transfer(
    own: Mapping[MotorModel, Sequence[DriveLog]],
    drive: Mapping[MotorModel, Sequence[DriveLog]],
    tolerance: float,
    sample_time: float,
) -> list[dict[str, Any]]:
    """For each model, how policies [S] trained with it do on references [M] in its simulator (`own`) and on the drive.

    A policy transfers, on a reference, where its error on the drive is at most 1 + `tolerance` times that in its own
    simulator. The last model is the drive itself: what can be had.
    """
    here = {model: np.array([rms_error(log, sample_time) for log in logs]) for model, logs in own.items()}
    there = {model: np.array([rms_error(log, sample_time) for log in logs]) for model, logs in drive.items()}
    last = there[list(there)[-1]]
    bootstrap = Bootstrap(last.shape[1])
    found = []
    for model in there:
        transferred = there[model] <= (1 + tolerance) * here[model]
        row = {
            "model": model.name,
            "minutes": model.minutes,
            "own_error": float(here[model].mean()),
            "drive_error": float(there[model].mean()),
            "over_trained_on_drive": asdict(bootstrap.ratio(there[model], last)),
            "transferred": asdict(bootstrap.success(transferred)),
            "count": int(transferred.sum()),
            "of": transferred.size,
            "drive_error_by_seed": there[model].mean(axis=1).tolist(),
        }
        found.append(row)
    return found
