"""The picture of a run: torques over time, and what controllers do on the drive."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vision_s2r.actuator.config import ActuatorConfig
from vision_s2r.actuator.log import DriveLog
from vision_s2r.actuator.references import References
from vision_s2r.actuator.report import DATA, LABELS
from vision_s2r.files import write_figure

COLOURS = {"analytic": "#d1495b", "paper": "#e0a030", "long": "#2e7d8c"}
INK, DPI = "#1f2328", 110
SHOWN = 0.7  # s


def draw(
    path: Path,
    cfg: ActuatorConfig,
    logs: Mapping[str, Sequence[DriveLog]],
    torques: Mapping[str, Mapping[str, Sequence[np.ndarray]]],
    references: References,
    drive: Mapping[str, Sequence[DriveLog]],
) -> Path:
    """Torques on a motion of each kind; a reference and what the controllers of the first seed make of it.

    The motions shown are those on which the analytic model is as wrong as it is in the median.
    """
    figure = Figure(figsize=(11, 6.6), layout="constrained")
    panels = figure.subplots(2, 2)
    for axis, (name, given) in zip(panels[0], logs.items(), strict=True):
        _torque(axis, given[0], {model: said[0] for model, said in torques[name].items()}, cfg)
        axis.set_title(f"torque on the load: {DATA[name]}", fontsize=10, loc="left")
    _responses(panels[1], references, {name: drive[name][0] for name in COLOURS}, cfg)
    for axis in panels.flat:
        axis.spines[["top", "right"]].set_visible(False)
    lines, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(lines, labels, frameon=False, fontsize=9, ncols=len(labels), loc="outside lower center")
    return write_figure(path, figure, DPI)


def _torque(axis: Axes, log: DriveLog, models: Mapping[str, np.ndarray], cfg: ActuatorConfig) -> None:
    motion = _median(abs(models["analytic"] - log.torque).mean(axis=1))
    part = _part(log, cfg)
    t = np.arange(log.torque.shape[1])[part] * cfg.drive.sample_time
    axis.step(t, log.torque[motion, part], where="post", color=INK, lw=2.8, alpha=0.3, label="torque sensor; reference")
    for name, said in models.items():
        axis.step(t, said[motion, part], where="post", color=COLOURS[name], lw=1.1, label=LABELS[name])
    axis.set_ylabel("N·m")


def _responses(axes: Sequence[Axes], references: References, logs: Mapping[str, DriveLog], cfg: ActuatorConfig) -> None:
    motion = _median((logs["analytic"].miss ** 2).mean(axis=1))
    part = _part(logs["analytic"], cfg)
    t = np.arange(references.position.shape[1])[part] * cfg.drive.sample_time
    axes[0].plot(t, references.position[motion, part], color=INK, lw=2.8, alpha=0.3)
    for name, log in logs.items():
        axes[0].plot(t, (references.position - log.miss)[motion, part], color=COLOURS[name], lw=1.2)
        axes[1].plot(t, 1e3 * log.miss[motion, part], color=COLOURS[name], lw=1.2)
    axes[0].set_title("the drive's load under controllers tuned with each model", fontsize=10, loc="left")
    axes[1].set_title("its error", fontsize=10, loc="left")
    axes[0].set(xlabel="t, s", ylabel="rad")
    axes[1].set(xlabel="t, s", ylabel="mrad")


def _part(log: DriveLog, cfg: ActuatorConfig) -> slice:
    """The last SHOWN seconds."""
    return slice(max(0, log.torque.shape[1] - round(SHOWN / cfg.drive.sample_time)), None)


def _median(values: np.ndarray) -> int:
    return int(np.argsort(values)[len(values) // 2])
