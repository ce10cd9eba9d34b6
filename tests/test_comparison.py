"""All methods side by side and few real grasps, small: every stage runs, and a second call repeats none of them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROWS = {"oracle", "no_translation", "domain_randomization", "conditional_gan", "rcan", "cyclegan", "rl_cyclegan"}
POLICIES = {"cyclegan_policy", "graspgan_policy", "rl_cyclegan_policy"}


def _run(folder: Path, script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    data = [f"data.{part}.out={folder}/{part}" for part in ("pairs", "train", "validation", "real", "test")]
    sizes = [
        "experiment=debug",
        "evaluate=methods",
        "evaluate.cameras=[webcam]",
        f"out={folder}/out",
        *data,
        *arguments,
    ]
    command = [sys.executable, f"scripts/{script}.py", *sizes]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)


def test_an_unknown_method_is_named_before_anything_is_rendered(tmp_path):
    failed = _run(tmp_path, "compare", "methods=[rcan,cycle_gan]")
    assert failed.returncode == 2
    assert "methods: no method is called 'cycle_gan', did you mean 'cyclegan'" in failed.stderr
    assert list(tmp_path.rglob("*.npz")) == []


@pytest.mark.slow
def test_methods_and_few_real_grasps(tmp_path):
    compared = _run(tmp_path, "compare")
    assert compared.returncode == 0, compared.stderr
    table = json.loads((tmp_path / "out" / "table.json").read_text())
    assert {record["row"] for record in table["cells"]} == ROWS | POLICIES
    made = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.safetensors")}

    tuned = _run(tmp_path, "finetune")
    assert tuned.returncode == 0, tuned.stderr
    assert {path: path.stat().st_mtime_ns for path in made} == made
    points = json.loads((tmp_path / "out" / "finetune" / "finetune.json").read_text())
    found = {(point["start"], point["grasps"]) for point in points}
    starts = ("domain_randomization", "rcan", "rl_cyclegan", "rl_cyclegan_policy")
    assert found == {(start, n) for start in starts for n in (0, 4, 8)} | {("from_scratch", n) for n in (4, 8)}
    assert (tmp_path / "out" / "finetune" / "finetune.png").exists()
