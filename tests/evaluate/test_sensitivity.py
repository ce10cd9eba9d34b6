"""Curves of success against an effect's strength, on tiny scenes with untrained networks."""

import json

import pytest
import torch
from stand_ins import SCENE, render_scenes, save_untrained_policy, save_untrained_translator

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraParameters
from vision_s2r.camera.strength import at, strength_of
from vision_s2r.errors import UserError
from vision_s2r.evaluate.columns import columns, pictures
from vision_s2r.evaluate.config import EvaluateConfig, RowConfig
from vision_s2r.evaluate.sensitivity import sensitivity
from vision_s2r.evaluate.sensitivity_config import SensitivityConfig
from vision_s2r.grasp import GraspConfig
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.render import Views
from vision_s2r.scene.changes import CHANGES


@pytest.mark.parametrize("effect", list(CAMERA_EFFECTS), ids=lambda effect: effect.name)
def test_an_effect_grows_with_its_strength(effect):
    ramp = torch.linspace(0.1, 0.9, 64)
    wave = 0.5 + 0.3 * (40 * ramp).sin() * (35 * ramp[:, None]).cos()
    picture = torch.stack([wave, ramp[:, None].expand(64, 64), ramp.expand(64, 64).sin()])[None]

    def change(strength):
        values = at(effect, strength)
        effect.check(values)
        return float((Camera()(picture, CameraParameters.of({effect.name: values}, 1)) - picture).abs().mean())

    changes = [change(strength) for strength in (0.25, 0.5, 1.0, 2.0)]
    assert changes == sorted(changes) and changes[0] < 0.7 * changes[2], changes
    assert at(effect, 1.0) == pytest.approx(effect.moderate())
    assert strength_of(effect, at(effect, 0.7)) == pytest.approx(0.7)


def test_light_and_surfaces_of_the_real_look_change(tmp_path):
    views = Views.open(render_scenes(tmp_path / "scenes"))
    alone = EvaluateConfig(
        appearances=["real"], changes={name: {name: 1.0} for name in CHANGES} | {"no": {"gloss": 0.0}}
    )
    was, *seen, no = (pictures(column, views, 0).float() for column in columns(alone))
    assert torch.equal(no, was)  # the scenes, rendered again
    apart = {name: (each - was).abs().mean().item() for name, each in zip(CHANGES, seen, strict=True)}
    assert min(apart.values()) > 0.3, apart
    assert seen[list(CHANGES).index("dim_light")].mean() < 0.8 * was.mean()
    with pytest.raises(UserError, match="did you mean 'gloss'"):
        columns(EvaluateConfig(changes={"dull": {"glos": 1.0}}))


def test_curves_are_measured_and_drawn(tmp_path):
    translator = save_untrained_translator(tmp_path / "t.safetensors", NetworkConfig(width=8, levels=2))
    policy = save_untrained_policy(tmp_path / "p.safetensors", GraspConfig(width=8))
    rows = {
        "oracle": RowConfig([policy], picture="canonical"),
        "no_translation": RowConfig([policy]),
        "rcan": RowConfig([policy], [translator]),
    }
    table = EvaluateConfig(scenes=str(render_scenes(tmp_path / "scenes")), rows=rows, workers=1)
    cfg = SensitivityConfig(effects=["gamma", "defocus_blur"], changes=["camouflage"], strengths=[0.5, 2.0], limit=2)
    points = json.loads(sensitivity(cfg, table, SCENE, tmp_path / "out").read_text())
    assert len(points) == 2 * 3 * 3  # rows that look at sources, effects and changes, strengths with none
    assert {point["row"] for point in points} == {"no_translation", "rcan"}
    assert all(point["attempts"] == 2 and point["low"] <= point["value"] <= point["high"] for point in points)
    none = {p["row"]: p["value"] for p in points if p["strength"] == 0 and p["effect"] == "gamma"}
    assert none == {p["row"]: p["value"] for p in points if p["strength"] == 0 and p["effect"] == "defocus_blur"}
    assert (tmp_path / "out" / "sensitivity.png").exists() and (tmp_path / "out" / "sensitivity.csv").exists()
    table_of = json.loads((tmp_path / "out" / "table.json").read_text())
    assert [row[0] for row in table_of["rows"]] == ["gamma", "defocus blur", "camouflage", "none"]
    assert table_of["columns"][1:3] == ["no translation, × 0.5", "no translation, × 2"]
    with pytest.raises(UserError, match="no row 'rcn'"):
        sensitivity(SensitivityConfig(rows=["rcn"]), table, SCENE, tmp_path / "out")
    with pytest.raises(UserError, match="strengths"):
        sensitivity(SensitivityConfig(strengths=[2.0, 1.0]), table, SCENE, tmp_path / "out")
    with pytest.raises(UserError, match="did you mean 'gamma'"):
        sensitivity(SensitivityConfig(effects=["gama"]), table, SCENE, tmp_path / "out")
