"""The picture of a run: torques over time, and what policies do on the drive."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vision_s2r.actuator.config import ActuatorConfig
from vision_s2r.actuator.log import DriveLog
from vision_s2r.actuator.report import DATA, LABELS
from vision_s2r.files import write_figure

INK, DPI = "#1f2328", 110
COLOURS = {
    **{"analytic": "#d1495b", "identified": "#8a6fb0", "diagnosed": "#4c9a52"},
    **{"paper": "#e0a030", "long": "#2e7d8c", "drive": INK},
}
KEYS = ("value", "low", "high")
SHOWN = 0.7  # s


def draw(
    path: Path,
    cfg: ActuatorConfig,
    logs: Mapping[str, Sequence[DriveLog]],
    torques: Mapping[str, Mapping[str, Sequence[np.ndarray]]],
    transferred: Sequence[Mapping[str, Any]],
) -> Path:
    """Torques on a motion of each kind, and over minutes of log what policies miss on the drive.

    The motions shown are those on which the analytic model is as wrong as it is in the median.
    """
    figure = Figure(figsize=(11, 6.6), layout="constrained")
    top, bottom = figure.subfigures(2, 1)  # type: ignore[misc]  # an array of two
    panels = top.subplots(1, 2)
    for axis, (name, given) in zip(panels, logs.items(), strict=True):
        _torque(axis, given[0], {model: said[0] for model, said in torques[name].items()}, cfg)
        axis.set_title(f"torque on the load: {DATA[name]}", fontsize=10, loc="left")
    _minutes(bottom.subplots(), transferred)
    lines, labels = panels[0].get_legend_handles_labels()
    top.legend(lines, labels, frameon=False, fontsize=9, ncols=len(labels), loc="outside lower center")
    for axis in figure.axes:
        axis.spines[["top", "right"]].set_visible(False)
    return write_figure(path, figure, DPI)


def _minutes(axis: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """The error on the drive over that of policies trained on it, with intervals."""
    for name in dict.fromkeys(row["model"] for row in rows):
        some = [row for row in rows if row["model"] == name]
        value, low, high = (np.array([row["over_trained_on_drive"][key] for row in some]) for key in KEYS)
        if not some[0]["minutes"]:
            axis.axhline(value[0], color=COLOURS[name], lw=1.2, ls="--", label=LABELS[name])
            continue
        minutes = [row["minutes"] for row in some]
        spread = np.array([value - low, high - value])
        axis.errorbar(minutes, value, spread, color=COLOURS[name], lw=1.6, marker="o", capsize=3, label=LABELS[name])
    axis.set(xscale="log", yscale="log", xlabel="minutes of log", ylabel="× the error of policies trained on it")
    axis.set_title("policies on the drive, by what they were trained with", fontsize=10, loc="left")
    axis.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1, 0.5))


def _torque(axis: Axes, log: DriveLog, models: Mapping[str, np.ndarray], cfg: ActuatorConfig) -> None:
    motion = _median(abs(models["analytic"] - log.torque).mean(axis=1))
    part = _part(log, cfg)
    t = np.arange(log.torque.shape[1])[part] * cfg.drive.sample_time
    axis.step(t, log.torque[motion, part], where="post", color=INK, lw=2.8, alpha=0.3, label="torque sensor")
    for name, said in models.items():
        axis.step(t, said[motion, part], where="post", color=COLOURS[name], lw=1.1, label=LABELS[name])
    axis.set_ylabel("N·m")


def _part(log: DriveLog, cfg: ActuatorConfig) -> slice:
    """The last SHOWN seconds."""
    return slice(max(0, log.torque.shape[1] - round(SHOWN / cfg.drive.sample_time)), None)


def _median(values: np.ndarray) -> int:
    return int(np.argsort(values)[len(values) // 2])
