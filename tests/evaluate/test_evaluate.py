"""The transfer table of a few tiny scenes, end to end."""

import csv
import json
import re
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch
from stand_ins import (
    SCENE,
    SIZE,
    GreenPolicy,
    MirrorTranslator,
    render_scenes,
    save_policy,
    save_translator,
    save_untrained_policy,
    save_untrained_translator,
)

from vision_s2r.errors import UserError
from vision_s2r.evaluate import attempts, drawing, evaluate, page
from vision_s2r.evaluate.columns import columns, pictures
from vision_s2r.evaluate.config import EvaluateConfig, RowConfig
from vision_s2r.evaluate.rows import Loaders
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.grasp import GraspConfig
from vision_s2r.grasp.config import CemConfig
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.render import Views
from vision_s2r.scene import attempt
from vision_s2r.scene.config import ObjectsConfig, PhysicsConfig

COLUMNS = ["canonical", "randomized", "real", "webcam", "gamma"]


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """Folder of four rendered scenes of test objects."""
    return render_scenes(tmp_path_factory.mktemp("scenes"))


@pytest.fixture(scope="module")
def finished(scenes, tmp_path_factory):
    """The four standard rows, two trainings of each, in few columns: the configuration, and the table measured."""
    folder = tmp_path_factory.mktemp("finished")
    policies = [save_policy(folder / f"policy-{k}.safetensors", 0.004 * k) for k in range(2)]
    randomized = [save_policy(folder / f"random-{k}.safetensors", 0.01, "randomized") for k in range(2)]
    translators = [save_translator(folder / f"translator-{k}.safetensors") for k in range(2)]
    cfg = EvaluateConfig(
        scenes=str(scenes),
        out=str(folder / "out"),
        cameras=["webcam"],
        effects=["gamma"],
        rows={
            "oracle": RowConfig(policies, None, "canonical"),
            "no_translation": RowConfig(policies),
            "domain_randomization": RowConfig(randomized, trained_on="randomized"),
            "rcan": RowConfig(policies, translators),
        },
        differences=[["oracle", "rcan"], ["rcan", "no_translation"]],
        ratios=[["rcan", "oracle"]],
        failures=["rcan", "oracle"],
        strip=2,
        worst=2,
        workers=1,
    )
    return cfg, evaluate(cfg, SCENE, Loaders(GreenPolicy, MirrorTranslator))


@pytest.fixture
def cfg(finished, tmp_path):
    """The same in a folder of its own, all cells finished."""
    shutil.copytree(finished[0].out, tmp_path / "out")
    return replace(finished[0], out=str(tmp_path / "out"))


@pytest.fixture
def loaders():
    """Loaders that remember the policies they made."""
    made = []

    def policy(path):
        made.append(GreenPolicy(path))
        return made[-1]

    return SimpleNamespace(made=made, loaders=Loaders(policy, MirrorTranslator))


def table_json(cfg):
    return json.loads((Path(cfg.out) / "table.json").read_text())


def test_every_cell_is_what_physics_says(finished):
    cfg, table = finished
    assert [column.name for column in table.columns] == COLUMNS
    assert table.rows == ["oracle", "no_translation", "domain_randomization", "rcan"]
    scenes = Scenes.open(cfg, SCENE)
    canonical = scenes.views.all("canonical")
    cameras = scenes.views.all("intrinsics"), scenes.views.all("extrinsics")
    for k, path in enumerate(cfg.rows["oracle"].policy):
        grasps = GreenPolicy(path).act(canonical, *cameras, range(4)).actions.double().numpy()
        held = [attempt(SCENE, s, g).success for s, g in zip(scenes.states, grasps, strict=True)]
        assert sum(held) > 0
        assert [table.outcomes("oracle", name)[k].tolist() for name in COLUMNS] == [held] * len(COLUMNS)
    mirrored = GreenPolicy(cfg.rows["rcan"].policy[1]).act(canonical.flip(2), *cameras, range(4))
    assert np.array_equal(table.cells["rcan", "canonical"][1].grasps, mirrored.actions.double().numpy())
    raw = pictures(columns(cfg)[3], scenes.views, cfg.seed)
    seen = GreenPolicy(cfg.rows["no_translation"].policy[0]).act(raw, *cameras, range(4))
    assert np.array_equal(table.cells["no_translation", "webcam"][0].grasps, seen.actions.double().numpy())


def test_files_agree_with_the_cells(finished):
    cfg, table = finished
    records = list(csv.DictReader((Path(cfg.out) / "table.csv").open()))
    assert len(records) == 4 * len(COLUMNS) * 3  # rows, columns, two seeds and all
    oracle = table.outcomes("oracle", "real")
    found = {r["seed"]: r for r in records if (r["row"], r["column"]) == ("oracle", "real")}
    assert [int(found[k]["successes"]) for k in ("0", "1", "all")] == [*oracle.sum(axis=1), oracle.sum()]
    assert int(found["all"]["attempts"]) == 8
    assert float(found["all"]["low"]) <= float(found["all"]["rate"]) <= float(found["all"]["high"])
    written = table_json(cfg)
    difference = next(d for d in written["differences"] if (d["first"], d["column"]) == ("oracle", "webcam"))
    expected = table.outcomes("oracle", "webcam").mean() - table.outcomes("rcan", "webcam").mean()
    assert difference["value"] == pytest.approx(expected)
    assert len(written["differences"]) == 2 * len(COLUMNS) and len(written["ratios"]) == len(COLUMNS)
    assert len(written["checkpoints"]["rcan"][1]["translator"]["sha256"]) == 64


def test_the_page_shows_every_column_and_stands_alone(finished):
    cfg, table = finished
    text = (Path(cfg.out) / "index.html").read_text()
    for name in COLUMNS:
        assert f"<th>{name}</th>" in text and f"<h3>{name}</h3>" in text
    assert cv2.imread(str(Path(cfg.out) / "strip.png")).shape[0] > len(cfg.rows) * drawing.TILE
    failures = page.worst_failures(table)
    assert failures and text.count("<img ") == len(COLUMNS) * 4 + len(failures)
    assert not re.search(r"""(?:src|href)=["'](?!data:)""", text)
    for failure in failures:
        assert table.outcomes("oracle", failure.column.name)[failure.seed, failure.scene]
        assert not table.outcomes("rcan", failure.column.name)[failure.seed, failure.scene]


def test_an_interrupted_evaluation_goes_on_where_it_stopped(cfg, finished, loaders, monkeypatch):
    tried = []

    def interrupted(*arguments):
        tried.append(arguments)
        if len(tried) == 13:
            raise KeyboardInterrupt
        return attempt(*arguments)

    monkeypatch.setattr(attempts, "attempt", interrupted)
    cfg = replace(cfg, out=cfg.out + "-new", limit=2, cameras=[], effects=[])
    with pytest.raises(KeyboardInterrupt):
        evaluate(cfg, SCENE, loaders.loaders)
    table = evaluate(cfg, SCENE, loaders.loaders)
    distinct = {(state.index, grasp.tobytes()) for _, state, grasp in tried}
    assert len(tried) <= len(distinct) + 2  # at most one cell was lost
    for row in table.rows:
        assert np.array_equal(table.outcomes(row, "real"), finished[1].outcomes(row, "real")[:, :2])


def test_a_finished_evaluation_measures_nothing(cfg, finished, loaders, monkeypatch):
    monkeypatch.setattr(attempts, "attempt", None)
    evaluate(cfg, SCENE, loaders.loaders)
    assert loaders.made and not any(policy.asked for policy in loaders.made)
    for name in ("table.json", "table.csv", "index.html"):
        assert (Path(cfg.out) / name).read_bytes() == (Path(finished[0].out) / name).read_bytes()


def test_another_checkpoint_is_measured_again(cfg, finished, loaders, tmp_path):
    row = cfg.rows["domain_randomization"]
    other = save_policy(tmp_path / "other.safetensors", -0.05, "randomized")
    cfg.rows = cfg.rows | {"domain_randomization": replace(row, policy=[row.policy[0], other])}
    table = evaluate(cfg, SCENE, loaders.loaders)
    assert [bool(policy.asked) for policy in loaders.made] == [False] * 5 + [True] + [False] * 2
    for name in table.rows:
        pairs = zip(table.cells[name, "real"], finished[1].cells[name, "real"], strict=True)
        same = [np.array_equal(now.grasps, before.grasps) for now, before in pairs]
        assert same == [True, name != "domain_randomization"]


def test_a_damaged_cell_is_measured_again(cfg, loaders):
    path = Path(cfg.out) / "cells" / "rcan" / "webcam" / "0.json"
    whole = path.read_text()
    path.write_text(whole[:100])
    evaluate(cfg, SCENE, loaders.loaders)
    assert path.read_text() == whole


def test_trained_networks_are_read_from_their_checkpoints(cfg, tmp_path):
    small = {"width": 8, "cem": CemConfig(samples=8, iterations=2)}
    plain = save_untrained_policy(tmp_path / "plain.safetensors", GraspConfig(**small))
    paired = save_untrained_policy(
        tmp_path / "paired.safetensors", GraspConfig(with_source=True, validate_on="real", **small)
    )
    translator = save_untrained_translator(tmp_path / "t.safetensors", NetworkConfig(width=8, levels=2))
    rows = {
        "oracle": RowConfig([plain], None, "canonical"),
        "oracle_with_source": RowConfig([paired], None, "canonical"),
        "rcan": RowConfig([plain], [translator]),
    }
    cfg = replace(cfg, rows=rows, differences=[["oracle", "rcan"]], cameras=[], effects=[], limit=1, strip=1)
    table = evaluate(cfg, SCENE)
    looked = {row: [table.cells[row, c][0].grasps.tolist() for c in ("canonical", "real")] for row in rows}
    assert looked["oracle"][0] == looked["oracle"][1]
    assert looked["oracle_with_source"][0] != looked["oracle_with_source"][1]
    assert looked["rcan"][0] != looked["rcan"][1]
    assert np.all((table.cells["rcan", "real"][0].q > 0) & (table.cells["rcan", "real"][0].q < 1))


def test_a_picture_depends_on_its_own_scene_alone(cfg, scenes):
    views = Views.open(scenes)
    for column in columns(cfg):
        every = pictures(column, views, 0)
        assert every.shape == (4, SIZE, SIZE, 3) and every.dtype == torch.uint8
        assert torch.equal(pictures(column, views.subset([2, 1]), 0), every[[2, 1]])
    webcam = columns(cfg)[3]
    assert not torch.equal(pictures(webcam, views, 0), pictures(webcam, views, 1))


def test_a_grasp_is_drawn_where_the_camera_sees_it(scenes):
    views = Views.open(scenes).subset([0])
    state, camera = views.states()[0], (views.all("intrinsics")[0].numpy(), views.all("extrinsics")[0].numpy())
    grasp = np.array([0.03, -0.02, 0.7])
    white = np.full((SIZE, SIZE, 3), 255, np.uint8)
    drawn = drawing.tile(white, *camera, grasp, success=True)
    scale = drawing.TILE // SIZE
    inked = (drawn == drawing.INK).all(axis=2)
    assert (drawn[0, 0] == drawing.SUCCESS).all()
    assert (drawing.tile(white, *camera, grasp, success=False)[0, 0] == drawing.FAILURE).all()
    # OpenCV's projection, in pixels of the tile, of the fingers' inner faces
    along = 0.042 * np.array([np.cos(0.7), np.sin(0.7), 0])
    matrix = np.array([[camera[0][0], 0, camera[0][2]], [0, camera[0][1], camera[0][3]], [0, 0, 1]])
    rotation, translation = np.array(state.camera.rotation), camera[1][:3, 3]
    for point in (np.array([0.03, -0.02, 0.02]) + along, np.array([0.03, -0.02, 0.02]) - along):
        u, v = cv2.projectPoints(point[None], cv2.Rodrigues(rotation)[0], translation, matrix, None)[0].ravel()
        column, row = (round((each + 0.5) * scale - 0.5) + drawing.FRAME for each in (u, v))
        assert inked[row, column]
    assert inked.mean() < 0.05


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda cfg: replace(cfg, cameras=["webcma"]), "did you mean 'webcam'"),
        (lambda cfg: replace(cfg, effects=["gama"]), "did you mean 'gamma'"),
        (lambda cfg: replace(cfg, limit=5), "has 4 scenes"),
        (lambda cfg: replace(cfg, ratios=[["rcam", "oracle"]]), "did you mean 'rcan'"),
        (lambda cfg: replace(cfg, rows={"oracle": RowConfig()}), "no row has its checkpoints"),
        (lambda cfg: replace(cfg, rows={"rcan": replace(cfg.rows["rcan"], picture="canonical")}), "translator: null"),
        (lambda cfg: replace(cfg, rows={"rcan": replace(cfg.rows["rcan"], translator=["a"])}), "1 translators for 2"),
        (
            lambda cfg: replace(cfg, rows={"dr": replace(cfg.rows["domain_randomization"], trained_on="canonical")}),
            "trained on randomized pictures: expected canonical ones",
        ),
    ],
)
def test_a_mistake_in_the_configuration_is_one_clear_line(cfg, loaders, change, message):
    changed = replace(cfg, differences=[], ratios=[], failures=[])
    with pytest.raises(UserError, match=message):
        evaluate(change(changed), SCENE, loaders.loaders)


def test_checkpoints_that_do_not_fit(cfg, loaders, tmp_path):
    rows = cfg.rows
    wrong = {
        "there is no such checkpoint": RowConfig([str(tmp_path / "none.safetensors")]),
        "holds a translator: expected a q_function": RowConfig([rows["rcan"].translator[0]]),
        "64 px: the scenes have 32 px": RowConfig([save_policy(tmp_path / "large.safetensors", size=64)]),
    }
    for message, row in wrong.items():
        with pytest.raises(UserError, match=message):
            evaluate(replace(cfg, rows=rows | {"rcan": row}), SCENE, loaders.loaders)


def test_no_column_may_have_chosen_a_checkpoint(cfg, loaders, tmp_path):
    webcam, harsh = (asdict(columns(replace(cfg, cameras=[name]))[3].camera) for name in ("webcam", "harsh"))
    cfg.limit = 1
    chosen = [save_translator(tmp_path / f"{k}.safetensors", camera=harsh, validation_camera=webcam) for k in range(2)]
    rows = cfg.rows | {"rcan": replace(cfg.rows["rcan"], translator=chosen)}
    with pytest.raises(UserError, match="chosen by camera 'webcam', which is a column"):
        evaluate(replace(cfg, rows=rows), SCENE, loaders.loaders)
    evaluate(replace(cfg, rows=rows, cameras=[]), SCENE, loaders.loaders)
    known = table_json(cfg)["checkpoints"]["rcan"][0]["translator"]["cameras"]
    assert known == {"camera": "harsh", "validation_camera": "webcam"}


def test_scenes_that_cannot_make_a_transfer_table(cfg, loaders, tmp_path):
    seen = replace(SCENE, objects=ObjectsConfig(split="train"))
    cases = {
        "unseen objects": (render_scenes(tmp_path / "train", seen, scenes=1), SCENE),
        "holds no real pictures": (render_scenes(tmp_path / "plain", scenes=1, real=False), SCENE),
        "holds no randomized pictures": (render_scenes(tmp_path / "bare", scenes=1, views=0), SCENE),
        "scene.physics.object_mass = 0.1, not 0.3": (
            cfg.scenes,
            replace(SCENE, physics=PhysicsConfig(object_mass=0.3)),
        ),
    }
    for message, (folder, scene) in cases.items():
        with pytest.raises(UserError, match=message):
            evaluate(replace(cfg, scenes=str(folder)), scene, loaders.loaders)
