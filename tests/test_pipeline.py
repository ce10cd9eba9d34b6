"""The whole way, small: every stage runs, and a second call repeats none of them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from vision_s2r import pipeline
from vision_s2r.cli import compose
from vision_s2r.commands import visual
from vision_s2r.commands.main import main
from vision_s2r.config import Config

DATA = ("pairs", "train", "validation", "test")


def _run(folder: Path, script: str = "run", *more: str) -> subprocess.CompletedProcess[str]:
    data = [f"data.{part}.out={folder}/{part}" for part in DATA]
    command = [sys.executable, f"scripts/{script}.py", "experiment=debug", f"out={folder}/out", *data, *more]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)


@pytest.fixture
def again(tmp_path, monkeypatch, caplog):
    """As `_run`, in this process, which has imported all that takes seconds; returns what was logged."""

    def call(script: str = "run", *more: str) -> str:
        data = [f"data.{part}.out={tmp_path}/{part}" for part in DATA]
        monkeypatch.setattr(
            sys, "argv", [f"scripts/{script}.py", "experiment=debug", f"out={tmp_path}/out", *data, *more]
        )
        caplog.set_level("INFO")
        main(script.replace("_", "-"))
        return caplog.text

    return call


def test_render_train_evaluate_in_one_command(tmp_path, again):
    again()
    page = tmp_path / "out" / "index.html"
    table = json.loads((tmp_path / "out" / "table.json").read_text())
    rows = {"oracle", "no_translation", "domain_randomization", "rcan", "rcan_student", "domain_randomization_student"}
    assert rows <= {record["row"] for record in table["cells"]}
    assert "domain randomization" in page.read_text()
    made = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.safetensors")}
    assert len(made) >= 8  # shards and five checkpoints

    assert "not repeated" in again()
    assert {path: path.stat().st_mtime_ns for path in made} == made


@pytest.mark.slow
def test_a_gap_is_closed_with_networks_of_a_run(tmp_path, again):
    again()
    networks = [f"close_gap.{kind}={folder_of(tmp_path, kind)}" for kind in ("translator", "policy")]
    small = ("close_gap.withheld=1", "close_gap.steps=2", "close_gap.policy_steps=2", "close_gap.grasps=4")
    log = again("close_gap", *small, "close_gap.sources=[camera]", "close_gap.draws=2", *networks)
    summary = json.loads((tmp_path / "out" / "close_gap" / "close_gap.json").read_text())
    (robot,) = summary["robots"]
    assert list(robot["truth"]) == ["camera"] and robot["named"]
    assert set(robot["success"]) == {"as_it_came", "everything", "diagnosed", "posterior", "true_effects"}
    losses = robot["losses"]
    parts = sum(source["lost"] for source in losses["sources"])
    assert abs(parts - (losses["simulated"] - losses["real"])) < 1e-9
    assert "report.html" in log and (tmp_path / "out" / "close_gap" / "close_gap.png").exists()
    table = json.loads((tmp_path / "out" / "close_gap" / "table.json").read_text())  # as the documentation's are
    assert [row[0] for row in table["rows"]][:2] == ["as it came", "everything randomized"]
    assert table["command"].startswith("vision-s2r close-gap ") and "close_gap.withheld=1" in table["command"]
    page = tmp_path / "out" / "close_gap" / "robot-0" / "diagnosis" / "report.html"
    assert "from simulation to reality" in page.read_text()


def test_a_stage_by_itself_renders_what_it_reads_and_goes_on_where_that_stopped(tmp_path, monkeypatch):
    folders = [f"data.{part}.out={tmp_path}/{part}" for part in ("pairs", "validation")]
    cfg = compose(Config, overrides=["experiment=debug", "data.pairs.scenes=4", "data.validation.grasps=0", *folders])
    monkeypatch.setattr(pipeline, "paired_translator", lambda cfg, seed: len(pipeline.pairs(cfg).views))
    assert visual.translate(cfg) == 4
    for shard in (tmp_path / "pairs").glob("*.safetensors"):
        shard.unlink()
    assert visual.translate(cfg) == 4


@pytest.mark.slow
def test_networks_learn_from_and_are_measured_on_a_camera_of_more_pixels(tmp_path):
    scales = [f"data.{part}.{key}" for part in DATA for key in ("source_scale=2", "margin=8")]
    done = _run(tmp_path, "run", *scales)
    assert done.returncode == 0, done.stderr
    table = json.loads((tmp_path / "out" / "table.json").read_text())
    assert table["scenes"]["render"]["source_scale"] == 2
    rows = {record["row"] for record in table["cells"]}
    assert {"rcan_student", "domain_randomization", "domain_randomization_student"} <= rows
    networks = [f"close_gap.{kind}={folder_of(tmp_path, kind)}" for kind in ("translator", "policy")]
    refused = _run(tmp_path, "close_gap", "close_gap.withheld=1", *scales, *networks)
    assert refused.returncode == 2 and "data.validation.source_scale=1" in refused.stderr
    small = ("scenes=4", "size=32", "margin=4", "grasps=1", "workers=1", f"out={tmp_path}/small")
    assert _run(tmp_path, "render", *(f"render.{key}" for key in small)).returncode == 0
    refused = _run(tmp_path, "translate", f"data.validation.out={tmp_path}/small", f"out={tmp_path}/other")
    assert refused.returncode == 2 and "differ in source_size, 64 and 32 px" in refused.stderr


def folder_of(folder: Path, kind: str) -> Path:
    return folder / "out" / f"{kind}-0" / "best.safetensors"
