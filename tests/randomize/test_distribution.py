"""Boxes and posteriors: what they draw, that it can be repeated anywhere, and that they survive the disk."""

import logging
import math
from pathlib import Path

import numpy as np
import pytest
import torch
from effects_to_draw import EFFECTS

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraParameters, load_config
from vision_s2r.errors import UserError
from vision_s2r.joint import JOINT_EFFECTS, NominalJoint, pack
from vision_s2r.randomize import Box, Posterior, load_distribution, sample_at

BOX = Box.of(
    {
        "damping": {"value": [0.08, 0.2]},
        "play": {"probability": 0.25, "width": [1e-3, 1e-1]},
        "spring": {"probability": 0.5, "stiffness": [10.0, 1000.0], "loss": [0.0, 1.0]},
    },
    EFFECTS,
)
# Damping close to its bound at 0, play on a log scale, correlated by -0.6.
POSTERIOR = Posterior(
    EFFECTS,
    {"damping": {"value": 0.1}, "play": {"width": 0.01}, "tone": {"gamma": 1.0}},
    np.array([[0.01, -0.012, 0], [-0.012, 0.04, 0], [0, 0, 0]]),
)


def test_a_box_is_uniform_on_each_parameters_scale_and_neutral_where_off() -> None:
    drawn = BOX.sample(4000, np.random.default_rng(0))
    assert np.quantile(drawn["damping"]["value"], [0, 0.5, 1]) == pytest.approx([0.08, 0.14, 0.2], abs=0.004)
    width, stiffness = drawn["play"]["width"], drawn["spring"]["stiffness"]
    assert (width == 0).mean() == pytest.approx(0.75, abs=0.03)
    assert np.median(width[width > 0]) == pytest.approx(1e-2, rel=0.2) and width[width > 0].min() >= 1e-3
    assert np.isinf(stiffness).mean() == pytest.approx(0.5, abs=0.03)
    assert np.median(stiffness[np.isfinite(stiffness)]) == pytest.approx(100, rel=0.2)
    assert np.isfinite(drawn["spring"]["loss"]).all()  # which switches nothing, and has no value to be off at
    assert abs(((width == 0) & np.isinf(stiffness)).mean() - 0.375) < 0.03  # independent of each other


def test_draws_serve_cameras_and_joints() -> None:
    augment = load_config(Path(__file__).parents[2] / "configs" / "camera" / "augment.yaml")
    drawn = Box.of(augment.effects, CAMERA_EFFECTS).sample(4, np.random.default_rng(0))
    as_tensors = {name: {key: torch.from_numpy(value) for key, value in given.items()} for name, given in drawn.items()}
    assert Camera()(torch.rand(4, 3, 16, 16), CameraParameters.of(as_tensors, 4)).shape == (4, 3, 16, 16)
    nominal = {"inertia": {"value": 0.02}}
    box = Box.of({"inertia": {"probability": 0.5, "value": [0.02, 0.04]}}, JOINT_EFFECTS, nominal)
    inertia = box.sample(200, np.random.default_rng(0))["inertia"]["value"]
    assert (inertia == 0.02).sum() == pytest.approx(100, abs=25)
    assert pack(NominalJoint(0.5, 0.02, 0.1, 0.02), {"inertia": {"value": float(inertia[0])}})[1] == inertia[0]


def test_an_effect_without_any_value_to_be_off_at_must_be_on() -> None:
    with pytest.raises(UserError, match=r"damping: probability is 0\.5, but no value is known at which it is off"):
        Box.of({"damping": {"probability": 0.5, "value": [0.1, 0.2]}}, EFFECTS)
    with pytest.raises(UserError, match="did you mean 'damping'"):
        Box.of({}, EFFECTS, {"dampin": {"value": 0.1}})


def test_a_range_that_leaves_out_the_nominal_value_warns(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        Box.of({"damping": {"value": [0.08, 0.2]}}, EFFECTS, {"damping": {"value": 0.1}})
        Box.of({"tone": {"probability": 0.9, "gamma": [1.1, 2.0]}}, EFFECTS)  # off at times, hence nominal
        assert not caplog.messages
        Box.of({"damping": {"value": [0.12, 0.2]}}, EFFECTS, {"damping": {"value": 0.1}})
        Box.of({"tone": {"gamma": [1.1, 2.0]}}, EFFECTS)
    assert caplog.messages == [
        "damping: value from 0.12 to 0.2 leaves out the nominal value, 0.1",
        "tone: gamma from 1.1 to 2 leaves out the nominal value, 1",
    ]


def test_a_posteriors_moments_are_those_of_the_truncated_normal() -> None:
    drawn = POSTERIOR.sample(40_000, np.random.default_rng(0))
    damping, log_width = drawn["damping"]["value"], np.log(drawn["play"]["width"] / 0.01)
    # N(0.1, 0.1²) cut off at 0, one deviation below its mean: the mean rises by 0.1·φ(1)/Φ(1).
    ratio = math.exp(-0.5) / math.sqrt(2 * math.pi) / (0.5 * (1 + math.erf(math.sqrt(0.5))))
    assert damping.min() >= 0
    assert damping.mean() == pytest.approx(0.1 + 0.1 * ratio, abs=0.002)
    assert damping.std() == pytest.approx(0.1 * math.sqrt(1 - ratio - ratio**2), rel=0.02)
    # The other follows by regression: -0.6 · 0.2/0.1 of it.
    assert log_width.mean() == pytest.approx(-1.2 * 0.1 * ratio, abs=0.004)
    assert np.polyfit(damping, log_width, 1)[0] == pytest.approx(-1.2, abs=0.03)
    assert (drawn["tone"]["gamma"] == 1.0).all()


def test_a_sample_depends_on_seed_and_index_alone() -> None:
    for distribution in (BOX, POSTERIOR):
        together = sample_at(distribution, 7, range(10))
        halves = [sample_at(distribution, 7, indices) for indices in ([9, 8, 7, 6, 5], range(5))]
        for name, given in together.items():
            for key, values in given.items():
                assert values.tolist() == [*halves[1][name][key], *halves[0][name][key][::-1]]
        value = together["damping"]["value"]
        assert len(set(value)) == 10 and (value != sample_at(distribution, 8, range(10))["damping"]["value"]).all()
        assert sample_at(distribution, 7, [])["damping"]["value"].shape == (0,)


@pytest.mark.parametrize("distribution", [BOX, POSTERIOR])
def test_a_distribution_survives_the_disk_bit_for_bit(distribution: Box | Posterior, tmp_path: Path) -> None:
    distribution.write(tmp_path / "new" / "mine.yaml")
    again = load_distribution(tmp_path / "new" / "mine.yaml", EFFECTS)
    before, after = (each.sample(5, np.random.default_rng(1)) for each in (distribution, again))
    assert str(before) == str(after)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["mine.yaml"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("distribution: posteriour\nvalues: {}", "distribution is posteriour, did you mean 'posterior'"),
        ("effects: {}", "distribution is missing, known: box, posterior"),
        ("distribution: box\nefects: {}", "unknown key 'efects', did you mean 'effects'"),
        ("distribution: posterior\nvalues: {}", "missing covariance"),
        (
            "distribution: box\neffects: {dampin: {value: 1}}",
            "no toy effect is called 'dampin': did you mean 'damping'",
        ),
        ("distribution: posterior\nvalues: {damping: 1}\ncovariance: [[1]]", "expected the parameters of each effect"),
        ("distribution: posterior\nvalues: {spring: {stiffness: 9}}\ncovariance: [[1]]", "missing loss"),
        ("distribution: posterior\nvalues: {damping: {value: 1}}\ncovariance: [[a]]", "expected rows of numbers"),
        (
            f"distribution: posterior\nvalues: {{damping: {{value: 1}}}}\ncovariance: [[{10**400}]]",
            "expected rows of numbers",
        ),
        ("distribution: posterior\nvalues: {damping: {value: 1}}\ncovariance: [[-1]]", "negative eigenvalue"),
        ("distribution: posterior\nvalues: {damping: {value: 1}}\ncovariance: [1]", r"shape \(1,\), expected \(1, 1\)"),
        (
            "distribution: posterior\nvalues: {play: {width: 0}}\ncovariance: [[1]]",
            "play: width is 0, out of the bounds",
        ),
        ("- 1", "expected keys and values"),
    ],
)
def test_files_that_cannot_be_are_one_clear_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(UserError, match=message) as caught:
        load_distribution(path, EFFECTS)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_covariances_that_cannot_be_are_named() -> None:
    two = {"damping": {"value": 0.1}, "play": {"width": 0.01}}
    with pytest.raises(UserError, match="not symmetric"):
        Posterior(EFFECTS, two, np.array([[1e-8, 1e-5], [0.0, 1.0]]))
    with pytest.raises(UserError, match="negative eigenvalue"):
        Posterior(EFFECTS, two, np.array([[1e-8, 2e-4], [2e-4, 1.0]]))
    far = Posterior(EFFECTS, {"tone": {"gamma": 1.0}}, np.array([[1e12]]))
    with pytest.raises(UserError, match="fewer than 1 in 1000 draws"):
        far.sample(10, np.random.default_rng(0))
