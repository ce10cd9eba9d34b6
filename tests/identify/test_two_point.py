"""The worked example, to the digit: from the formula, and from logs that know nothing of it."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from vision_s2r.identify import IdentifyConfig, identify, identify_all
from vision_s2r.identify.two_point import (
    CORRECTED,
    DRAWN,
    IDENTIFIED,
    REAL,
    REALITY,
    SIMULATOR,
    from_steady_states,
    log,
    open_loop,
    reached,
    response,
    short,
)
from vision_s2r.randomize.coverage import covered

PUBLISHED = Path(__file__).resolve().parents[2] / "docs" / "results" / "data" / "two_point.json"


def test_two_steady_states_give_damping_and_friction():
    assert from_steady_states(0.5, (1.0, 1.9), (3.0, 6.0)) == pytest.approx((0.15, 0.05), rel=1e-12)


@pytest.mark.parametrize(
    ("model", "current", "speed", "missing"),
    [(SIMULATOR, 1.04, 3.13, 37.3), (CORRECTED, 1.34, 4.13, 17.3), (REALITY, 1.6, 5.0, 0.0)],
)
def test_what_a_wrong_model_costs(model, current, speed, missing):
    asked = open_loop(model, 5.0)
    assert asked == pytest.approx(current, abs=1e-12)
    assert round(reached(REALITY, asked), 2) == speed
    assert round(100 * short(reached(REALITY, asked)), 1) == missing
    assert response(REALITY, asked)[-1] == pytest.approx(reached(REALITY, asked), rel=1e-9)


def test_a_range_that_covers_two_thirds():
    assert round(100 * covered(DRAWN, REAL), 1) == 66.7


def test_a_log_of_both_currents_gives_the_same():
    found = identify(log(seed=3), IdentifyConfig())
    for name, value in zip(IDENTIFIED, (0.15, 0.05), strict=True):
        low, high = found.estimate.intervals[name]["value"]
        assert low < value < high and high - low < 0.02 * value
    # Whatever pushes one way and never the other cannot be told from dry friction.
    assert "tied to coulomb_friction" in found.left["bias_torque"].why
    model = replace(SIMULATOR, **{name: found.values[name]["value"] for name in IDENTIFIED})
    assert abs(short(reached(REALITY, open_loop(model, 5.0)))) < 0.001


def test_the_command_prints_the_numbers_and_draws_them(tmp_path, capsys):
    (picture,) = identify_all(IdentifyConfig(example="two_point", out=str(tmp_path)))
    printed = capsys.readouterr().out
    for number in ("37.3 %", "17.3 %", "1.04 A", "1.34 A", "3.13 rad/s", "4.13 rad/s", "0.1500", "0.0500"):
        assert number in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log-0", "two_point.json", "two_point.png"]
    assert (tmp_path / "two_point.json").read_text() == PUBLISHED.read_text()
    (written,) = identify_all(IdentifyConfig(recording=str(tmp_path / "log-0"), out=str(tmp_path / "again")))
    effects = {each["name"]: each["parameters"]["value"] for each in json.loads(written.read_text())["effects"]}
    low, high = effects["viscous_damping"]["ci"]
    assert low < 0.15 < high
    assert cv2.imread(str(picture)).std() > 10
