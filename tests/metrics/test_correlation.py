"""Which metric goes with success, of points made so that it is known."""

import math

import numpy as np
import pytest

from vision_s2r.metrics.correlation import correlate
from vision_s2r.metrics.points import Point
from vision_s2r.metrics.report import Report

COLUMNS = {"easy": 0.8, "hard": 0.3}


def points(translators, scenes=60):
    """Better translators from the first on; "good" knows success, "camera" the column alone, "scene" which grasps."""
    found = []
    for t in range(translators):
        for column, rate in COLUMNS.items():
            count = round(scenes * (rate - 0.05 * t))
            success = np.arange(scenes) < count
            ones = np.ones(scenes)
            measures = {
                "constant": np.stack([ones, ones], 1),
                "camera": np.stack([ones * rate * 10, ones], 1),
                "good": np.stack([-ones * count, ones], 1),
                "scene": np.stack([success + 0.0, ones], 1),
            }
            found.append(Point("row", t, column, f"t{t}", f"{t} {column}", success, measures))
    return found


def test_within_columns_takes_the_camera_out():
    found = {each.metric: each for each in correlate(points(4), 0)}
    assert found["good"].overall.value == pytest.approx(-1) and found["good"].within_columns.value == pytest.approx(-1)
    assert found["good"].overall.low == pytest.approx(-1) and found["good"].overall.high == pytest.approx(-1)
    assert 0.8 < found["camera"].overall.value < 1 and math.isnan(found["camera"].within_columns.value)
    assert found["scene"].within_points.value == pytest.approx(1) and math.isnan(found["good"].within_points.value)


def test_the_strongest_comes_first_and_one_that_says_nothing_last():
    names = [each.metric for each in correlate(points(4), 0)]
    assert set(names[:2]) == {"good", "scene"} and names[2:] == ["camera", "constant"]


def test_the_same_measurement_counts_once_and_one_translator_has_no_interval():
    given = points(3)
    once, twice = ({each.metric: each for each in correlate(some, 0)} for some in (given, given + given))
    assert once["camera"].overall == twice["camera"].overall
    alone = {each.metric: each for each in correlate([p for p in given if p.translator == "t0"] * 2, 0)}
    assert math.isnan(alone["good"].overall.low)


def test_no_metric_is_praised_for_going_the_wrong_way():
    given = points(4)
    for point in given:
        point.measures["psnr"] = point.measures["good"]  # falls as success rises: wrong of it, right of "good"
    overall, within, _ = Report.of(given, 0).verdict().splitlines()
    assert overall == "over all points, good goes with success most closely (ρ = -1.00)"
    assert within.startswith("within columns, good goes")
