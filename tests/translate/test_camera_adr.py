"""A translator whose camera randomization widens by itself."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from omegaconf import OmegaConf
from test_rcan import CONFIGS, TINY, Rectangles

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraConfig, load_config
from vision_s2r.errors import UserError
from vision_s2r.training import Inputs
from vision_s2r.training.checkpoint import load, load_state
from vision_s2r.training.data import generator
from vision_s2r.translate import TranslateConfig, train_translator
from vision_s2r.translate.adr import CameraAdr, camera_dimensions
from vision_s2r.translate.config import CameraAdrConfig

CAMERA = CameraConfig(
    effects={
        "exposure": {"probability": 0.5, "stops": [-1.0, 1.0]},
        "cast_shadow": {"strength": [0.1, 0.5], "offset": [-5, 5], "angle": [0, 180], "softness": [1, 5]},
    }
)
LIMITS: dict[str, Any] = {"exposure": {"stops": [-2.0, 2.0]}, "cast_shadow": {"strength": [0.0, 1.0]}}
WIDENING = CameraAdrConfig(LIMITS, every=1, probes=6, buffer=2, threshold_high=0.0, threshold_low=-1.0, step=0.1)
WIDE = replace(TINY, adr=WIDENING)


class AStep:
    progress = 0.0

    def __init__(self, index: int):
        self.index = index
        self.shared = generator(0, index)

    def optimize(self, loss: torch.Tensor, *names: str) -> None: ...


def adr(out: Path, **changes: Any) -> CameraAdr:
    cfg = replace(WIDENING, **changes)
    return CameraAdr(cfg, Camera.from_config(CAMERA), Rectangles(16, 1), seed=0, out=out)


def run(out: Path, cfg: TranslateConfig = WIDE, camera: CameraConfig = CAMERA) -> Path:
    return train_translator(cfg, Inputs(Rectangles(48, 0), Rectangles(16, 1), camera, CameraConfig()), out, seed=3)


def test_it_begins_without_any_effect_and_widens_where_performance_is_good(tmp_path: Path) -> None:
    found = adr(tmp_path, threshold_high=0.9, threshold_low=0.8)
    parameters = found.sample(AStep(0), 64, 32)
    assert not any(parameters.on(name).any() for name in LIMITS)
    for index in range(200):
        _, _, boundary = found.probe(AStep(index))
        # boundary 1 is the upper one of exposure: all is well but there
        found.ranges.record(boundary, np.where(boundary == 1, 0.5, 1.0))
    np.testing.assert_allclose(found.ranges.bounds, [[0, 0.5], [0, 1]])
    stops = found.sample(AStep(0), 1000, 32).values["exposure"]["stops"]
    assert stops.min() < -1.9 and stops.max() == 0  # wider than picked by hand on the good side, neutral on the other
    assert 0.4 < (stops < 0).double().mean() < 0.6  # on as often as the camera has it


def test_a_boundary_draw_has_its_effect_and_is_the_same_in_every_process(tmp_path: Path) -> None:
    one, other = (adr(tmp_path) for _ in range(2))
    for each in (one, other):
        each.ranges.bounds = np.array([[0.25, 0.75], [0.0, 0.5]])
    (scenes, parameters, boundary), (_, same, _) = (each.probe(AStep(7)) for each in (one, other))
    assert parameters.to_dict() == same.to_dict()
    assert scenes.tolist() == [10, 11, 12, 13, 14, 15]  # 7 x 6 of 16, round and round
    for number, value in ((0, -1.0), (1, 1.0)):
        assert (parameters.values["exposure"]["stops"][boundary == number] == value).all()
    assert (parameters.values["cast_shadow"]["strength"][boundary == 3] == 0.5).all()


def test_training_widens_logs_and_resumes_to_the_identical_future(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vision_s2r.translate.rcan import Rcan

    best = run(tmp_path / "straight")
    step_of = Rcan.training_step

    def cut_off(self: Rcan, batch: Any, step: Any) -> Any:
        if step.index == 3:
            raise RuntimeError("power failure")
        return step_of(self, batch, step)

    with monkeypatch.context() as patch:
        patch.setattr(Rcan, "training_step", cut_off)
        with pytest.raises(RuntimeError):
            run(tmp_path / "resumed")
    run(tmp_path / "resumed")
    states = [load_state(tmp_path / name / "last.pt") for name in ("straight", "resumed")]
    assert states[0]["method"] == states[1]["method"]
    torch.testing.assert_close(states[0]["networks"], states[1]["networks"], rtol=0, atol=0)
    histories = [(tmp_path / name / "adr.csv").read_text() for name in ("straight", "resumed")]
    assert histories[0] == histories[1]
    rows = list(csv.DictReader(histories[0].splitlines()))
    assert [row["step"] for row in rows] == ["2", "4"]
    assert float(rows[0]["width"]) < float(rows[1]["width"])
    assert load(best, "translator").configuration["adr"]["limits"] == LIMITS
    assert (best.parent / "pictures" / "ranges-0000004.png").exists()


def test_without_limits_nothing_is_drawn_measured_or_kept(tmp_path: Path) -> None:
    off = replace(TINY, adr=replace(WIDENING, limits={}))
    states = [load_state(run(tmp_path / str(k), cfg).parent / "last.pt") for k, cfg in enumerate((TINY, off))]
    assert states[0]["configuration"] == states[1]["configuration"] and "adr" not in states[0]["configuration"]
    assert states[0]["method"] == {} and not (tmp_path / "0" / "adr.csv").exists()
    torch.testing.assert_close(states[0]["networks"], states[1]["networks"], rtol=0, atol=0)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"exposrue": {"stops": [-1, 1]}}, "no camera effect is called 'exposrue': did you mean 'exposure'"),
        ({"exposure": {"stop": [-1, 1]}}, "exposure has no parameter 'stop': did you mean 'stops'"),
        ({"gamma": {"gamma": [0.5, 2]}}, "the camera has no gamma"),
        ({"cast_shadow": {"angle": [0, 90]}}, r"cast_shadow\.angle has no neutral value to begin at"),
        ({"exposure": {"stops": 1.0}}, r"exposure\.stops is 1\.0, expected \[low, high\]"),
        ({"exposure": {"stops": [-9.0, 1.0]}}, r"limits: exposure: stops is -9, expected -6 to 6 EV"),
        ({"exposure": {"stops": [0, "one"]}}, r"limits: exposure: stops is 'one', expected a number"),
        ({"exposure": {"stops": [1.0, -1.0]}}, r"exposure\.stops is \[1, -1\], expected low before high"),
        ({"exposure": {"stops": [0.5, 1.0]}}, r"exposure\.stops: nominal is 0, expected 0\.5 to 1"),
    ],
)
def test_limits_that_cannot_be_are_named(tmp_path: Path, limits: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message) as error:
        run(tmp_path, replace(WIDE, adr=replace(WIDENING, limits=limits)))
    assert "\n" not in str(error.value)


def test_the_preset_widens_every_parameter_that_switches_an_effect_beyond_the_hand_picked_range() -> None:
    file = OmegaConf.load(CONFIGS / "translate" / "adr.yaml")
    camera = Camera.from_config(load_config(CONFIGS / "camera" / "augment.yaml"))
    found = camera_dimensions(OmegaConf.to_container(file.adr.limits), camera)
    switches = {(e.name, p.name) for e in CAMERA_EFFECTS for p in e.parameters if p.neutral is not None}
    assert {(each.effect, each.parameter) for each in found} == switches
    for each in found:
        low, high = camera.ranges[each.effect].ranges[each.parameter]
        assert each.low <= low and high <= each.high
