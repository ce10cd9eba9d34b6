"""Replays and diagnoses for Rerun's viewer, read back by its own command."""

import json
import subprocess
import sys

import cv2
import numpy as np
import pytest
from reports import a_report

from vision_s2r.errors import UserError
from vision_s2r.export.rerun import RerunConfig, export_rerun


def shown(**sources):
    """What Rerun's own reader finds in the recording of these."""
    pytest.importorskip("rerun", reason="the extra `rerun` is not installed")
    out = export_rerun(RerunConfig(**{key: str(value) for key, value in sources.items()}))
    for verb in ("verify", "print"):
        command = [sys.executable, "-m", "rerun", "rrd", verb, str(out)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout


def test_a_joint_s_replay_and_its_diagnosis(tmp_path):
    names = [f"{quantity}_{side}" for quantity in ("position", "velocity") for side in ("measured", "before", "after")]
    rows = ["episode,t," + ",".join(names)]
    rows += [f"{k},{0.01 * i}," + ",".join("0.5" for _ in names) for k in (3, 7) for i in range(5)]
    (tmp_path / "replay.csv").write_text("\n".join(rows))
    (tmp_path / "report.json").write_text(json.dumps(a_report("joint", backlash={"width": 0.03})))
    found = shown(replay=tmp_path, report=tmp_path / "report.json", out=tmp_path / "out.rrd")
    for path in ("/diagnosis", "episode\\ 3/position/measured", "episode\\ 7/velocity/after"):
        assert path in found, found


def test_tosses_and_pictures(tmp_path):
    axes = [f"{axis}_{side}" for axis in "xyz" for side in ("measured", "before", "after")]
    rows = ["episode,t,window," + ",".join(axes)]
    rows += [f"0,{0.01 * i},{i // 3}," + ",".join("0.1" for _ in axes) for i in range(6)]
    (tmp_path / "replay.csv").write_text("\n".join(rows))
    assert "episode\\ 0/after" in shown(replay=tmp_path, out=tmp_path / "toss.rrd")
    for side in ("before", "after"):
        (tmp_path / "camera" / side).mkdir(parents=True)
        cv2.imwrite(str(tmp_path / "camera" / side / "0.png"), np.full((8, 8, 3), 100, np.uint8))
    assert "/before" in shown(replay=tmp_path / "camera", out=tmp_path / "camera.rrd")


def test_what_cannot_be_shown_is_one_line(tmp_path):
    with pytest.raises(UserError, match="expected replay=DIR"):
        export_rerun(RerunConfig())
    pytest.importorskip("rerun", reason="the extra `rerun` is not installed")
    with pytest.raises(UserError, match="no pictures, nor a replay"):
        export_rerun(RerunConfig(replay=str(tmp_path), out=str(tmp_path / "out.rrd")))
    assert not list(tmp_path.glob("*.rrd*"))
