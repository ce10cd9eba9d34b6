"""The ablation from its command line, small, and what it makes of results."""

import csv
import json
import logging
import os
import signal
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from vision_s2r.ablation.config import AblationStudyConfig
from vision_s2r.ablation.job import JobResult
from vision_s2r.ablation.summary import AblationSummary
from vision_s2r.cli import compose
from vision_s2r.commands.main import main
from vision_s2r.evaluate.drawing import LABEL
from vision_s2r.translate.rcan import Rcan


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """`vision-s2r ablate ablation=debug` with more overrides; returns its folder."""

    def call(*more: str) -> Path:
        data = [f"data.{part}.out={tmp_path}/{part}" for part in ("train", "validation", "real", "test")]
        arguments = ["vision-s2r", "ablation=debug", f"out={tmp_path}/out", *data, *more]
        monkeypatch.setattr(sys, "argv", arguments)
        main("ablate")
        return tmp_path / "out"

    return call


def exit_code(call, *arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        call(*arguments)
    return int(left.value.code)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (["ablation.variants=[perceptual_alon]"], "no variant 'perceptual_alon', did you mean 'perceptual_alone'?"),
        (
            [
                "ablation.variants=[full,perceptual_alone]",
                "ablation.policy=[bin-64]",
                "+ablation.definitions.perceptual_alone.changes.network={look: 1}",
            ],
            "translate has no key 'network.look', did you mean 'looks'?",
        ),
    ],
)
def test_a_mistake_is_said_before_anything_is_rendered(run, capsys, tmp_path, changes, line) -> None:
    assert exit_code(run, *changes) == 2
    assert line in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    "variants", [["full", "perceptual_alone"], ["full", "perceptual_alone", "rl_cyclegan", "no_cycle"]]
)
def test_variants_are_trained_compared_resumed_and_not_repeated(run, monkeypatch, caplog, capsys, variants) -> None:
    asked = f"ablation.variants=[{','.join(variants)}]"
    step_of = Rcan.training_step

    def killed(self: Rcan, batch, step):
        if step.index == 2:
            os.kill(os.getpid(), signal.SIGINT)
        return step_of(self, batch, step)

    caplog.set_level(logging.INFO)
    monkeypatch.setattr(Rcan, "training_step", killed)
    assert exit_code(run, asked) == 130
    monkeypatch.setattr(Rcan, "training_step", step_of)
    out = run(asked)
    assert "full-0/translator-0: going on at step 3" in caplog.text
    assert f"{len(variants)} of {len(variants)} jobs are done" in caplog.text

    rows = list(csv.DictReader((out / "ablation.csv").open()))
    by_variant = {row["variant"]: row for row in rows if row["measure"] == "success"}
    assert set(by_variant) == set(variants)
    for variant, reference in zip(variants[1::2], variants[::2], strict=True):
        change = float(by_variant[variant]["value"]) - float(by_variant[reference]["value"])
        assert float(by_variant[variant]["change"]) == pytest.approx(change) and not by_variant[reference]["change"]
    assert {"l1", "psnr", "q_difference", "auc", "success webcam"} <= {row["measure"] for row in rows}
    assert (out / "ablation.png").stat().st_size > 0
    sheet, alone = (cv2.imread(str(out / name)) for name in ("strip.png", "full-0/table/strip.png"))
    rows_of_sheet = 1 + len(variants)  # the pictures, and a row for each variant
    assert sheet.shape == (rows_of_sheet * len(alone) // 2, *alone.shape[1:])
    np.testing.assert_array_equal(sheet[len(alone) // 2 : len(alone), LABEL:], alone[len(alone) // 2 :, LABEL:])

    made = {path: path.stat().st_mtime_ns for path in [*out.rglob("*.safetensors"), *out.rglob("result.json")]}
    assert len(made) == {2: 5, 4: 13}[len(variants)]  # a policy; of the unpaired variants also the whole and its policy
    monkeypatch.setattr(Rcan, "training_step", None)
    run(asked)
    assert {path: path.stat().st_mtime_ns for path in made} == made

    assert exit_code(run, asked, "translate.loss.depth=9") == 2
    assert "translator.loss.depth = 0.2, now it is 9" in capsys.readouterr().err


def test_changes_are_paired_over_scenes_and_trainings(tmp_path: Path) -> None:
    cfg = compose(AblationStudyConfig, "ablation", ["ablation.variants=[no_depth]", "evaluate.seed=1"])
    rng = np.random.default_rng(0)
    full = rng.random((3, 400)) < 0.8
    less = full & (rng.random((3, 400)) > 0.05)  # 5 % of the scenes lost in every training

    def result(success: np.ndarray, training: int, **metrics: float) -> JobResult:
        return JobResult({"webcam": success[training], "harsh": success[training]}, metrics)

    summary = AblationSummary(
        cfg,
        {
            "full": [result(full, k, l1=0.1 + 0.01 * k, depth_error=0.1) for k in range(3)],
            "no_depth": [result(less, k, l1=0.12 + 0.01 * k) for k in range(3)],
        },
    )
    row = summary.rows["no_depth", "success"]
    assert row.change is not None and row.change.value == pytest.approx(less.mean() - full.mean())
    assert row.change.high < 0  # far less wide than either variant's own interval
    assert row.change.high - row.change.low < 0.7 * (row.value.high - row.value.low)
    l1 = summary.rows["no_depth", "l1"]
    assert l1.value.value == pytest.approx(0.13) and l1.value.low < 0.12 < 0.14 < l1.value.high
    assert l1.change is not None and l1.change.low == pytest.approx(0.02) == l1.change.high
    assert ("no_depth", "depth_error") not in summary.rows
    summary.write(tmp_path)
    content = json.loads((tmp_path / "ablation.json").read_text())
    assert content["correlations"]["l1"]["value"] < 0  # what errs more grasps less
    assert content["scenes"] == 400 and content["cameras"] == ["webcam", "harsh"]
