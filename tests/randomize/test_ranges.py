"""Ranges, and that cameras and scenes draw from them what they always drew."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from effects_to_draw import EFFECTS

from vision_s2r.camera import CAMERA_EFFECTS, Camera, load_config
from vision_s2r.errors import UserError
from vision_s2r.randomize import Range, effect_ranges
from vision_s2r.scene import SceneConfig, randomized, sample_state
from vision_s2r.scene.config import check
from vision_s2r.scene.sampling import Stream, generator

AUGMENT = Path(__file__).parents[2] / "configs" / "camera" / "augment.yaml"


@pytest.mark.parametrize("array", [np.array, torch.tensor])
def test_numbers_become_values_on_the_parameters_scale(array: Any) -> None:
    unit = array([0.0, 0.25, 0.5, 1.0])
    assert Range(-1.0, 3.0).at(unit).tolist() == [-1.0, 0.0, 1.0, 3.0]
    assert Range(0.01, 100.0).at(unit, "log").tolist() == pytest.approx([0.01, 0.1, 1.0, 100.0])
    assert Range(math.inf, math.inf).at(unit, "log").tolist() == [math.inf] * 4
    for value in unit.tolist():
        assert Range(0.01, 100.0).position(10 ** (4 * value - 2), "log") == pytest.approx(value)


def test_low_above_high_is_one_clear_line() -> None:
    with pytest.raises(UserError, match=r"^damping: value is \[0.2, 0.1\], expected low before high$"):
        effect_ranges({"damping": {"value": [0.2, 0.1]}}, EFFECTS)
    config = SceneConfig()
    config.objects.count = [6, 3]
    with pytest.raises(UserError, match=r"^scene.objects.count is \[6, 3\], expected low before high$"):
        check(config)
    config.objects.count = [3, 9]
    with pytest.raises(UserError, match=r"scene.objects.count = \[3, 9\]: expected 2 values, 1 to 8"):
        check(config)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"dampng": {"value": 1.0}}, "no toy effect is called 'dampng': did you mean 'damping'"),
        ({"play": {"widht": 0.1}}, "play has no parameter 'widht': did you mean 'width'"),
        ({"play": {"width": [0.0, 0.1]}}, r"play: width is \[0, 0.1\], expected a range from 1e-06 on"),
        ({7: {"width": 0.1}}, "no toy effect is called '7'"),
        (["play"], "expected effects by name"),
    ],
)
def test_what_cannot_be_drawn_is_named(effects: Any, message: str) -> None:
    with pytest.raises(UserError, match=message):
        effect_ranges(effects, EFFECTS)


def test_a_camera_draws_what_it_always_drew() -> None:
    """To the bit, by the formula and in the order of its first release, with nothing but a generator."""
    config = load_config(AUGMENT)
    drawn = Camera.from_config(config).sample(500, torch.Generator().manual_seed(3), 128, 160)
    stream = torch.Generator().manual_seed(3)
    for name, given in config.effects.items():
        on = torch.rand(500, generator=stream, dtype=torch.float64) < given["probability"]
        for key, (low, high) in ((key, value) for key, value in given.items() if key != "probability"):
            parameter = CAMERA_EFFECTS[name].parameter(key)
            at = torch.rand(500, generator=stream, dtype=torch.float64)
            value = low * (high / low) ** at if parameter.scale == "log" else low + (high - low) * at
            value = value.clamp(low, high)
            expected = value if parameter.neutral is None else torch.where(on, value, parameter.neutral)
            assert torch.equal(drawn.values[name][key], expected), (name, key)
    assert torch.equal(drawn.seeds, torch.randint(2**31, (500,), generator=stream))


def test_a_scene_draws_what_it_always_drew() -> None:
    state = sample_state(SceneConfig(), 3, 0)
    count = generator(3, 0, Stream.STATE).integers(3, 7)
    assert len(state.object_ids) == count
    light, rng = randomized(SceneConfig(), state).light, generator(3, 0, Stream.RANDOMIZED)
    angle = rng.uniform(0.0, 0.8)
    assert light.direction[2] == np.cos(angle)
    rng.uniform(0, 2 * np.pi)
    assert light.colour == tuple(rng.uniform(0.75, 1.0, size=3))
    assert [light.ambient, light.diffuse, light.specular] == [
        rng.uniform(0.3, 0.7),
        rng.uniform(0.3, 0.8),
        rng.uniform(0.0, 0.6),
    ]
