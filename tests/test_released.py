"""The weights that come with the package do what their cards say, on scenes of objects that no training saw."""

from dataclasses import replace

import pytest
import torch

from vision_s2r.cli import compose
from vision_s2r.close_gap.config import CloseGapStudyConfig
from vision_s2r.config import Config
from vision_s2r.errors import UserError
from vision_s2r.evaluate.rows import Loaders, load_rows
from vision_s2r.grasp import GraspPolicy
from vision_s2r.render import RenderConfig, Views, render
from vision_s2r.scene import CLASSES, SceneConfig
from vision_s2r.scene.config import ObjectsConfig
from vision_s2r.training import checkpoint, released
from vision_s2r.translate import Translator

OBJECT = CLASSES.index("object")


@pytest.fixture(scope="module", params=[64, 128])
def views(request, tmp_path_factory):
    """Of the pictures' side that the weights bin-SIDE are for."""
    shape = {"size": request.param, "margin": request.param // 8}
    out = str(tmp_path_factory.mktemp("scenes"))
    cfg = RenderConfig(out=out, scenes=8, seed=77, views=1, real=True, grasps=0, workers=1, **shape)
    return Views.open(render(SceneConfig(objects=ObjectsConfig(split="test")), cfg))


def seen(views):
    """The real look without its margin, uint8 [N, H, H, 3]."""
    m = views.margin
    return views.all("real")[:, m:-m, m:-m].contiguous()


def test_they_are_small_and_described():
    files = list(released.WEIGHTS.rglob("*.safetensors"))
    assert sum(file.stat().st_size for file in files) < 20e6
    assert len(files) == 8 and all(file.with_suffix(".md").is_file() for file in files)


def test_the_translator_finds_the_objects_of_a_look_it_never_saw(views):
    real = seen(views)
    found = Translator.load(f"bin-{views.size}").predict(real)
    guess, truth = found["segmentation"].argmax(1) == OBJECT, views.all("segmentation") == OBJECT
    assert float((guess & truth).sum() / (guess | truth).sum()) > 0.45
    canonical = views.all("canonical").movedim(-1, 1) / 255
    before = (real.movedim(-1, 1) / 255 - canonical).abs().mean()
    assert float((found["canonical"] - canonical).abs().mean()) < 0.3 * float(before)


def test_the_demo_s_robot_begins_with_a_translator_that_never_saw_a_camera():
    cfg = compose(CloseGapStudyConfig, "close_gap", ["experiment=demo"])
    came = checkpoint.load(cfg.close_gap.translator, "translator")
    assert not came.configuration["camera"]["effects"] and not came.configuration["validation_camera"]["effects"]
    assert Translator.load(cfg.close_gap.translator).size == cfg.data.validation.size == 64


def test_its_policies_aim_at_objects(views):
    real, frames = seen(views), (views.all("intrinsics"), views.all("extrinsics"))
    seeds, name = torch.arange(len(views)), f"bin-{views.size}"
    given = {name: views.all("canonical"), f"{name}-student": Translator.load(name)(real)}
    given |= {"bin-64-randomized": real} if views.size == 64 else {}
    places = [torch.tensor([pose[:2] for pose in state.object_poses], dtype=torch.float32) for state in views.states()]
    for name, pictures in given.items():
        grasps = GraspPolicy.load(name).act(pictures, *frames, seeds).actions
        near = [
            float((grasp[:2] - place).norm(dim=1).min()) < 0.045 for grasp, place in zip(grasps, places, strict=True)
        ]
        assert sum(near) >= 6, (name, near)


def test_the_table_of_the_released_is_a_command_line():
    cfg = compose(Config, overrides=["experiment=released", "data.test.seed=9", "data.test.scenes=7"])
    assert cfg.data.test.out == cfg.evaluate.scenes and "seed-9-scenes-7" in cfg.data.test.out
    rows = load_rows(cfg.evaluate, 64, Loaders())
    assert set(rows) == {"oracle", "no_translation", "domain_randomization_student", "rcan", "rcan_student"}
    mirrored = compose(Config, overrides=["experiment=mirrored"])
    pairs = {name: row.mirrored for name, row in mirrored.evaluate.rows.items() if row.present}
    assert len(pairs) == 6 and pairs == {name: name.endswith("mirrored") for name in pairs}
    with pytest.raises(UserError, match=r"trained on pictures of 64 px: the scenes have 128 px"):
        load_rows(cfg.evaluate, 128, Loaders())
    misnamed = replace(cfg.evaluate.rows["rcan"], translator=["bin-46"])
    with pytest.raises(UserError, match=r"no released translator 'bin-46', did you mean 'bin-64'\?"):
        load_rows(replace(cfg.evaluate, rows={"rcan": misnamed}), 64, Loaders())
