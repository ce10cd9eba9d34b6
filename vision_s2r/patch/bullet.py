"""PyBullet: arguments of changeDynamics, and of the motor that is its usual Coulomb friction."""

import json
from typing import Any

from vision_s2r.patch.effect import JOINT_PATCHES
from vision_s2r.patch.rigid import advice
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import Diagnosed, values


def joint(named: Diagnosed, recording: JointRecording) -> str:
    """JSON: by function of PyBullet its keyword arguments, and what none of them can say.

    `p.changeDynamics(body, joint, **patch["changeDynamics"])`. A velocity motor with target 0 and a limited force is
    dry friction; it belongs on a joint whose torque is applied with TORQUE_CONTROL.
    """
    patch: dict[str, Any] = {}
    expressed = set()
    for name, given in values(named).items():
        write = JOINT_PATCHES[name].bullet if name in JOINT_PATCHES else None
        if write:
            patch |= write(given)
            expressed.add(name)
    patch["not_expressed"] = {n: text for n, text in advice(named, recording).items() if n not in expressed}
    return json.dumps(patch, indent=1, ensure_ascii=False) + "\n"
