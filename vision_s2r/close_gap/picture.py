"""What closing the loop won, as a picture."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vision_s2r.files import write_figure
from vision_s2r.statistics import wilson

LABELS = {
    "before": "before",
    "everything": "everything randomized",
    "after": "after the diagnosis",
    "true_effects": "true effects known",
    "oracle": "true canonical view",
}
COLOURS = ("#9aa5b1", "#d9a441", "#2f7ed8", "#2b9348", "#dddddd")


def draw(cameras: list[dict[str, Any]], path: Path) -> Path:
    """A group of bars a camera: grasp success of each translator, 95 % intervals. Returns the PNG's path."""
    rows = [row for row in LABELS if row in cameras[0]["success"]]
    figure = Figure(figsize=(max(2.2 + 1.7 * len(cameras), 7.0), 3.6), layout="constrained")
    axes = figure.subplots()
    width = 0.85 / len(rows)
    for k, row in enumerate(rows):
        found = [wilson(round(c["success"][row] * c["attempts"]), c["attempts"]) for c in cameras]
        values = np.array([(e.value, e.value - e.low, e.high - e.value) for e in found]).T * 100
        at = np.arange(len(cameras)) + (k - (len(rows) - 1) / 2) * width
        axes.bar(at, values[0], width, yerr=values[1:], color=COLOURS[k], label=LABELS[row], error_kw={"lw": 1})
    names = ["\n".join([c["camera"], *(str(e).replace("_", " ") for e in c["truth"] or c["effects"])]) for c in cameras]
    axes.set_xticks(np.arange(len(cameras)), names, fontsize=7)
    axes.set_ylabel("grasps held, %")
    axes.set_ylim(0, 100)
    axes.legend(fontsize=7, ncols=len(rows), loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    return write_figure(path, figure, dpi=130)
