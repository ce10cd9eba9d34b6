"""The page: it stands alone, says the verdict in words, and shows every part of the report."""

import re
from html.parser import HTMLParser

import cv2
import numpy as np
import pytest
from recordings import a_camera, a_joint
from reports import a_report

from vision_s2r.fit.case import Axis, Samples
from vision_s2r.report import GapReport, figures, words, write_html
from vision_s2r.report.drawing import png

LENS = {"lens_distortion": {"k1": -0.1, "k2": 0.0}}


class _Page(HTMLParser):
    """Text, and every address that the page refers to."""

    def __init__(self, page):
        super().__init__()
        self.words, self.addresses = [], []
        self.feed(page)
        self.text = " ".join(" ".join(self.words).split())

    def handle_data(self, data):
        self.words.append(data)

    def handle_starttag(self, tag, attrs):
        assert tag not in ("script", "link", "iframe")
        self.addresses += [value for name, value in attrs if name in ("src", "href")]


def _samples(error, *axes):
    return Samples(np.full(640, error), np.full(640, 0.01), np.arange(640) % 4, axes)


def _written(report, tmp_path, shown=None):
    write_html(report, shown or {}, tmp_path / "report.html")
    return _Page((tmp_path / "report.html").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({}, "it has backlash (0.03000 rad), which the simulator lacks. With that, the gap shrinks from 0.61 rad/s to"),
        ({}, "its viscous damping (0.1800 N·m·s/rad) is not what the simulator believes"),
        ({}, "99.8 % (99.7 % to 99.9 %) of what exceeds measurement noise"),
        ({"verdict": "no_gap"}, "0.61 rad/s between them is no more than measurement noise (0.005 rad/s)"),
        ({"verdict": "unexplained"}, "a gap of 0.61 rad/s, 122 times measurement noise, that no known effect"),
        ({"verdict": "partly_explained"}, "A rest of 1 % is real and has another cause, like a torque of speed"),
        (
            {"verdict": "partly_explained", "unexplained": {"share": 2e-4, "ci": [0, 4e-4], "where": []}},
            "A rest is real",
        ),
    ],
)
def test_the_verdict_is_a_sentence(tmp_path, changes, sentence):
    report = a_report("joint", backlash={"width": 0.03}, viscous_damping={"value": 0.18}) | changes
    report["unexplained"]["resembles"] = ["a torque of speed"]
    assert sentence in _written(report, tmp_path).text


def test_every_part_of_the_report_is_there(tmp_path):
    report = a_report("joint", backlash={"width": 0.03})
    report["alternatives"] = [{"effects": ["compliance", "latency"], "evidence": 301.2}]
    report["next_experiment"] = "Reverse slowly."
    report["candidates"][0].update(status="not_excited", reason="it never <moved> fast")
    report["candidates"][1].update(status="confusable", confusable_with=["backlash"])
    page = _written(report, tmp_path)
    for expected in (
        "compliance + latency 301 nats",
        "Reverse slowly.",
        "not excited – it never <moved> fast",
        "with backlash",
        "|θ̇| < 0.4 rad/s",
        "width 0.03000 rad 0.02970 to 0.03030",
    ):
        assert expected in page.text
    for candidate in report["candidates"]:
        assert candidate["name"].replace("_", " ") in page.text


@pytest.mark.parametrize("pairing", ["paired", "unpaired"])
def test_figures_are_in_the_page_and_nothing_else_is_needed(tmp_path, pairing):
    axes = (
        Axis("radius", ("centre", "edge", "never"), np.arange(640) % 2),
        Axis("grid", tuple(map(str, range(64))), np.arange(640) % 64),
    )
    recording = a_camera()
    object.__setattr__(recording, "pairing", pairing)
    shown = figures(recording, LENS, _samples(4.0, *axes), _samples(0.02, *axes), "grey levels")
    assert len(shown) == 3
    page = _written(a_report("camera", **LENS), tmp_path, shown)
    assert len(page.addresses) == 3 and all(each.startswith("data:image/png;base64,") for each in page.addresses)
    assert not re.search(r"https?://", (tmp_path / "report.html").read_text(encoding="utf-8"))


def test_the_stretch_that_is_drawn_is_where_the_simulator_is_furthest_off():
    shown = figures(a_joint(), {"backlash": {"width": 0.03}}, _samples(1.0), _samples(0.1), "rad/s")
    (caption,) = shown
    assert re.search(r"episode \d, free run", caption)
    picture = cv2.imdecode(np.frombuffer(png(shown[caption]), np.uint8), cv2.IMREAD_COLOR)
    assert picture.std() > 10


@pytest.mark.parametrize(
    ("value", "interval", "text"),
    [(0.031234, (0.0302, 0.0322), "0.0312"), (-0.15, (-0.15, -0.15), "−0.15"), (4321.0, (4000.0, 4600.0), "4321")],
)
def test_digits_are_those_that_the_interval_leaves(value, interval, text):
    assert words.rounded(value, interval) == text


def test_a_report_in_memory_is_the_same_as_its_json():
    data = a_report("joint", backlash={"width": 0.03})
    data["gap"] |= {"described": "all", "refitted": 0.5, "shrink_by_effects": {"share": 0.9, "ci": [0.8, 1.0]}}
    data["where"][0]["samples"] = 0.2
    report = GapReport.of(data)
    assert report.to_dict() == data and list(report.to_dict()) == list(data)
    assert report.effects[0].parameters["width"].ci == pytest.approx((0.0297, 0.0303)) and report.gap.shrink_ci == (
        0.997,
        0.999,
    )
    assert "backlash" in report.summary() and "&lt;h1&gt;Reality gap of a joint" in report._repr_html_()
    with pytest.raises(TypeError, match="'sharr'"):
        GapReport.of(data | {"unexplained": {"sharr": 0.1}})


def test_what_the_simulator_has_without_a_name_is_on_the_page(tmp_path):
    report = a_report("joint", backlash={"width": 0.03})
    assert "has besides" not in _written(report, tmp_path).text
    value = {"value": 0.21, "unit": "", "ci": [0.19, 0.23]}
    kept = {"name": "external_load_friction", "source": "actuator", "parameters": {"coefficient": value}}
    text = _written(report | {"refitted": [kept]}, tmp_path).text
    assert "external load friction coefficient 0.210 0.190 to 0.230" in text


def test_what_may_be_contents_of_two_sets_is_said():
    rivals = [{"name": name, "statistic": "tone, mean light", "shift": 0.4} for name in ("exposure", "unexplained")]
    report = GapReport.of(a_report("camera", exposure={"stops": 0.2}) | {"contents": rivals})
    assert "Exposure and what is left may as well be contents that differ" in report.summary()
    assert "may as well" not in GapReport.of(report.to_dict() | {"contents": []}).summary()
