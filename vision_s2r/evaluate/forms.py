"""Which form of Q grasps best after the same minutes on the same data: the comparison behind the default."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from vision_s2r.grasp.compare import compare_forms
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.render import Views
from vision_s2r.scene import SceneConfig, attempt
from vision_s2r.statistics import wilson

FORMS = ("crop", "dense", "trunk")
MINUTES = 2.0  # of training for each


def compare(forms: dict[str, GraspConfig], train: Views, validation: Views, scene: SceneConfig, out: str) -> None:
    """Train each form for MINUTES on `train`, simulate its grasps in the scenes of `validation`, print the table."""
    states = validation.states()

    def succeeds(index: int, grasp: np.ndarray) -> bool:
        return attempt(scene, states[index], grasp).success

    results = compare_forms(forms, train, validation, succeeds, MINUTES, Path(out) / "forms", seed=0)
    table = Table("form", "parameters", "steps", "auc", "success", "95 % interval", "ms a scene")
    for name, result in results.items():
        rate = wilson(result.successes, result.scenes)
        table.add_row(
            name,
            f"{result.parameters:,}",
            str(result.steps),
            f"{result.metrics['auc']:.3f}",
            f"{result.successes}/{result.scenes}",
            f"{100 * rate.low:.1f} to {100 * rate.high:.1f} %",
            f"{result.milliseconds:.0f}",
        )
    Console().print(table)
