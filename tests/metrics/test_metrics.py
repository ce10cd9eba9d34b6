"""From finished evaluations of a few tiny scenes to what their translators keep."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from evaluate.stand_ins import (
    SCENE,
    GreenPolicy,
    MirrorTranslator,
    render_scenes,
    save_policy,
    save_translator,
)

from vision_s2r.cli import or_exit
from vision_s2r.errors import UserError
from vision_s2r.evaluate import EvaluateConfig, evaluate
from vision_s2r.evaluate.config import RowConfig
from vision_s2r.evaluate.rows import Loaders
from vision_s2r.metrics import MetricsConfig, metrics
from vision_s2r.metrics.colours import classes_of
from vision_s2r.metrics.objects import OBJECT, compare
from vision_s2r.render import Views
from vision_s2r.training import checkpoint


class MaybeMirror(MirrorTranslator):
    """The picture as it is, or in a mirror, as its checkpoint says."""

    def __init__(self, path):
        self.mirror = checkpoint.load(path, "translator").configuration["mirror"]
        self.asked = 0

    def __call__(self, images, mirrored=False):
        self.asked += 1
        return super().__call__(images) if self.mirror else images


LOADERS = Loaders(GreenPolicy, MaybeMirror)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return render_scenes(tmp_path_factory.mktemp("scenes"))


@pytest.fixture(scope="module")
def table(scenes, tmp_path_factory):
    """A finished evaluation: a row without a translator, and one with two, of which the second is a mirror."""
    folder = tmp_path_factory.mktemp("table")
    policies = [save_policy(folder / f"policy-{k}.safetensors", 0.004 * k) for k in range(2)]
    translators = [save_translator(folder / f"translator-{k}.safetensors", mirror=bool(k)) for k in range(2)]
    rows = {"no_translation": RowConfig(policies), "rcan": RowConfig(policies, translators)}
    out = folder / "out"
    evaluate(EvaluateConfig(str(scenes), str(out), cameras=["webcam"], rows=rows, workers=1), SCENE, LOADERS)
    return out


def test_true_canonical_pictures_are_read_as_what_they_show(scenes):
    views = Views.open(scenes)
    truth = [views.all(name).numpy() for name in ("canonical", "segmentation", "instance")]
    for picture, segmentation, instance in zip(*truth, strict=True):
        classes = classes_of(picture)
        found, true = classes == OBJECT, segmentation == OBJECT
        assert (found & true).sum() / (found | true).sum() > 0.99
        counted = compare(classes, segmentation, instance).measures()
        assert counted["object_errors"][0] == counted["displacement"][0] == 0 < counted["dropped"][1]


def test_every_translator_is_measured_in_every_column(table, scenes, tmp_path):
    report = metrics(MetricsConfig([str(table)], str(tmp_path)), LOADERS)
    columns = ["canonical", "randomized", "real", "webcam"]
    assert [(p.row, p.column, p.seed) for p in report.points] == [("rcan", c, k) for c in columns for k in range(2)]
    still, mirrored = report.points[:2]
    nothing = ("l1", "object_l1", "q_difference", "dropped", "invented", "moved", "displacement", "object_errors")
    assert [still.value(name) for name in nothing] == [0] * len(nothing)
    assert still.value("ssim") == pytest.approx(1) and still.value("object_iou") == 1 and still.value("psnr") == 100
    canonical = Views.open(scenes).all("canonical").numpy().astype(float) / 255
    assert mirrored.value("l1") == pytest.approx(np.abs(canonical - canonical[:, :, ::-1]).mean(), rel=1e-4)
    assert all(mirrored.value(name) > 0 for name in ("q_difference", "dropped")) and mirrored.value("object_iou") < 1
    cells = json.loads((table / "table.json").read_text())["cells"]
    successes = {(cell["row"], cell["column"], cell["seed"]): cell["successes"] for cell in cells}
    assert all(p.success.sum() == successes[p.row, p.column, p.seed] for p in report.points)
    records = list(csv.DictReader((tmp_path / "metrics.csv").open()))
    assert len(records) == (len(columns) + 1) * 3 * (1 + len(report.metrics))
    written = json.loads((tmp_path / "metrics.json").read_text())
    assert {each["metric"] for each in written["correlations"]} == set(report.metrics)
    assert all((tmp_path / name).stat().st_size > 5000 for name in ("metrics.png", "objects.png"))


def test_what_is_measured_stays_and_what_is_damaged_is_measured_again(table, tmp_path):
    cfg = MetricsConfig([str(table)], str(tmp_path))
    first = metrics(cfg, LOADERS)
    files = sorted((tmp_path / "cells").iterdir())
    whole = files[0].read_text()
    files[0].write_text(whole[:50])
    made = []
    again = metrics(cfg, Loaders(GreenPolicy, lambda path: made.append(MaybeMirror(path)) or made[-1]))
    assert sum(translator.asked for translator in made) == 1 and files[0].read_text() == whole
    assert str(again.records) == str(first.records)


def test_another_checkpoint_than_the_evaluation_s_is_refused(table, scenes, tmp_path):
    path = Path(json.loads((table / "table.json").read_text())["checkpoints"]["rcan"][0]["translator"]["path"])
    before = path.read_bytes()
    try:
        save_translator(path, mirror=True)
        with pytest.raises(UserError, match=r"rcan/canonical/0\.json .*run `vision-s2r evaluate` again"):
            metrics(MetricsConfig([str(table)], str(tmp_path)), LOADERS)
    finally:
        path.write_bytes(before)


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "cannot be read: expected a folder that"), ("{}", "expected format"), ("{", "is not JSON")],
)
def test_a_folder_that_is_no_evaluation_is_one_line(content, message, tmp_path, capsys):
    if content is not None:
        (tmp_path / "table.json").write_text(content)
    with pytest.raises(SystemExit) as ended:
        or_exit(lambda: metrics(MetricsConfig([str(tmp_path)], str(tmp_path / "out"))))
    error = capsys.readouterr().err
    assert ended.value.code == 2 and message in error and error.count("\n") == 1


@pytest.mark.parametrize("tables", [None, [], [3], ["a", "a"]])
def test_tables_are_folders_each_once(tables):
    with pytest.raises(UserError, match=r"^tables = "):
        metrics(MetricsConfig(tables))


def test_an_evaluation_without_a_translator_says_so(table, tmp_path):
    data = json.loads((table / "table.json").read_text())
    del data["checkpoints"]["rcan"]
    (tmp_path / "table.json").write_text(json.dumps(data))
    with pytest.raises(UserError, match="no row there has a translator"):
        metrics(MetricsConfig([str(tmp_path)], str(tmp_path / "out")), LOADERS)
