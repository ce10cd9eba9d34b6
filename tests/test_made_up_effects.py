"""An effect of another package is one file: applied, randomized, identified, diagnosed and named as ours are.

Registries are filled when they are imported, so each effect is tried in a process of its own, where its file is
installed as an entry point.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest


def with_installed(tmp_path: Path, kind: str, module: str, program: str) -> None:
    """Run a function of this file where `module` is installed as an effect of this kind."""
    metadata = tmp_path / "made_up-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: made-up\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[vision_s2r.effects]\n{kind}.{module} = tests.made_up.{module}\n")
    paths = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[1])])
    command = [
        sys.executable,
        "-c",
        f"from pathlib import Path; from tests.test_made_up_effects import {program}; {program}(Path(r'{tmp_path}'))",
    ]
    done = subprocess.run(command, env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_made_up_joint_effect(tmp_path: Path) -> None:
    with_installed(tmp_path, "joint", "air_drag", "try_air_drag")


def test_a_made_up_camera_effect(tmp_path: Path) -> None:
    with_installed(tmp_path, "camera", "amp_glow", "try_amp_glow")


def try_air_drag(out: Path) -> None:
    from tests.identify.machines import a_log
    from vision_s2r.diagnose.config import DiagnoseConfig
    from vision_s2r.diagnose.diagnose import diagnose
    from vision_s2r.identify.config import IdentifyConfig
    from vision_s2r.identify.identify import identify
    from vision_s2r.joint import JOINT_EFFECTS
    from vision_s2r.patch.patch import write_patch
    from vision_s2r.randomize import Box

    drag = 0.012
    recording = a_log({"air_drag": {"coefficient": drag}})
    assert np.abs(recording.position - a_log({}).position).max() > 0.1

    box = Box.of({"air_drag": {"probability": 1.0, "coefficient": [0.005, 0.02]}}, JOINT_EFFECTS)
    drawn = box.sample(100, np.random.default_rng(0))["air_drag"]["coefficient"]
    assert 0.005 <= drawn.min() < 0.008 and 0.017 < drawn.max() <= 0.02

    found = identify(recording, IdentifyConfig(effects=["air_drag"]))
    assert found.values["air_drag"]["coefficient"] == pytest.approx(drag, rel=0.02)

    report = diagnose(recording, DiagnoseConfig()).to_dict()
    (named,) = report["effects"]
    assert report["verdict"] == "explained" and named["name"] == "air_drag"
    write_patch(report, recording, out)
    assert "air_drag: apply −0.01" in (out / "mujoco.xml").read_text()
    assert named["parameters"]["coefficient"]["value"] == pytest.approx(drag, rel=0.02)


def try_amp_glow(out: Path) -> None:
    import torch

    from tests.fit.camera.test_camera_case import recorded, scenes
    from vision_s2r.camera import CAMERA_EFFECTS, Camera
    from vision_s2r.diagnose.config import DiagnoseConfig
    from vision_s2r.diagnose.diagnose import diagnose
    from vision_s2r.randomize import effect_ranges

    pictures = scenes()
    glowing = Camera(effect_ranges({"amp_glow": {"probability": 1.0, "strength": [0.1, 0.5]}}, CAMERA_EFFECTS))
    drawn = glowing.sample(len(pictures), torch.Generator().manual_seed(0), 64, 64)
    strength = drawn.values["amp_glow"]["strength"]
    assert 0.1 <= strength.min() < strength.max() <= 0.5
    assert (glowing(pictures, drawn) - pictures)[:, :, :8, :8].mean() > 0.05

    report = diagnose(recorded(amp_glow={"strength": 0.3}), DiagnoseConfig()).to_dict()
    (named,) = report["effects"]
    assert report["verdict"] == "explained" and named["name"] == "amp_glow"
    assert named["parameters"]["strength"]["value"] == pytest.approx(0.3, rel=0.03)
