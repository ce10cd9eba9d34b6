"""Which form of Q grasps best after the same minutes on the same data: the comparison behind the default."""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from vision_s2r.grasp.compare import compare_forms
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.render import Views
from vision_s2r.results import publish
from vision_s2r.scene import SceneConfig, attempt
from vision_s2r.statistics import wilson

FORMS = ("crop", "dense", "trunk")
MINUTES = 2.0  # of training for each


def compare(forms: dict[str, GraspConfig], train: Views, validation: Views, scene: SceneConfig, out: Path) -> Path:
    """Train each form for MINUTES on `train`, simulate its grasps in the scenes of `validation`.

    Prints the table and writes grasp.json, whose path it returns.
    """
    states = validation.states()

    def succeeds(index: int, grasp: np.ndarray) -> bool:
        return attempt(scene, states[index], grasp).success

    results = compare_forms(forms, train, validation, succeeds, MINUTES, out / "forms", seed=0)
    rows = []
    for name, result in results.items():
        held = asdict(wilson(result.successes, result.scenes))
        success = {key: round(100 * value) for key, value in held.items()} | {"unit": "%", "of": result.scenes}
        rows.append([name, result.parameters, result.steps, result.metrics["auc"], success, result.milliseconds])
    columns = ["form", "parameters", f"steps in {MINUTES:g} min", "AUC", "success", "ms a scene"]
    return publish(out / "grasp.json", "vision-s2r benchmark grasp", columns, rows)
