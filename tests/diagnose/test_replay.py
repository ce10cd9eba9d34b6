"""Replays: with the true effects, another recording of the same machine comes out as it was measured."""

import csv
import dataclasses
import json

import cv2
import numpy as np
import pytest
from recordings import a_camera, a_joint
from reports import a_report

from vision_s2r.diagnose.replay import ReplayConfig, free_run, replay_all
from vision_s2r.errors import UserError
from vision_s2r.fit.camera.pictures import show
from vision_s2r.recording import write

JOINT = {"latency": {"delay": 0.023}, "viscous_damping": {"value": 0.2}}


def _joint(effects, lengths=(120, 120, 80)):
    """The recording that a machine with these effects would give."""
    one = dataclasses.replace(a_joint(), lengths=np.array(lengths))
    states = free_run(one, effects)
    return dataclasses.replace(one, position=states[..., 0], velocity=states[..., 1])


def _camera(effects, bits=8):
    """Smooth random pictures, and what a camera with these effects makes of them."""
    one = dataclasses.replace(a_camera(bits), mask=None)
    smooth = np.stack([cv2.resize(picture[:5, :6], (24, 20), interpolation=cv2.INTER_CUBIC) for picture in one.sim])
    one = dataclasses.replace(one, sim=0.4 + 0.5 * np.clip(smooth, 0, 1))
    return dataclasses.replace(one, real=np.stack([show(one, k, effects, seed=9).picture for k in range(4)]))


def _replay(tmp_path, recording, report, **keys):
    folder = write(recording, tmp_path / "recording")
    (tmp_path / "report.json").write_text(json.dumps(report))
    cfg = ReplayConfig(str(folder), str(tmp_path / "report.json"), str(tmp_path / "out"), **keys)
    (path,) = replay_all(cfg)
    return json.loads(path.read_text())


def test_a_joint_is_replayed_from_its_first_row(tmp_path):
    recording = _joint(JOINT)
    result = _replay(tmp_path, recording, a_report("joint", **JOINT))
    assert result["gap"]["metric"] == "velocity_rmse" and result["gap"]["unit"] == "rad/s"
    assert result["gap"]["before"] > 0.1 and result["gap"]["after"] < 1e-6
    with (tmp_path / "out" / "replay.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert ",".join(rows[0]) == (
        "episode,t,position_measured,position_before,position_after,velocity_measured,velocity_before,velocity_after"
    )
    assert len(rows) == 320 and rows[200]["episode"] == "1" and float(rows[200]["t"]) == pytest.approx(0.8)
    difference = [float(row["velocity_before"]) - float(row["velocity_measured"]) for row in rows]
    assert np.sqrt(np.mean(np.square(difference))) == pytest.approx(result["gap"]["before"], rel=1e-6)
    assert rows[120]["position_measured"] == rows[120]["position_before"] == rows[120]["position_after"]


def test_a_camera_is_replayed_with_and_without(tmp_path):
    effects = {"exposure": {"stops": -0.5}, "lens_distortion": {"k1": -0.1, "k2": 0.0}}
    recording = _camera(effects)
    result = _replay(tmp_path, recording, a_report("camera", **effects))
    assert result["gap"]["before"] > 10 and result["gap"]["after"] < 0.6  # of the rounding to 8 bits
    for k, name in enumerate(recording.names):
        before, after = (
            cv2.imread(str(tmp_path / "out" / each / f"{name}.png"))[..., ::-1] for each in ("before", "after")
        )
        assert np.abs(before / 255 - recording.sim[k]).max() < 1 / 255
        assert np.abs(after / 255 - recording.real[k]).max() < 1.1 / 255


def test_noise_counts_by_its_amount(tmp_path):
    right, wrong = {"read_noise": {"sigma": 0.02}}, {"read_noise": {"sigma": 0.06}}
    recording = _camera(right, bits=16)
    gaps = [_replay(tmp_path / f"{k}", recording, a_report("camera", **e))["gap"] for k, e in enumerate((right, wrong))]
    assert gaps[0]["after"] < 0.8 * gaps[0]["before"]
    assert gaps[1]["after"] > 1.3 * gaps[0]["after"]


def test_sets_of_pictures_are_compared_as_sets(tmp_path):
    effects = {"exposure": {"stops": -1.0}}
    recording = _camera(effects)
    names = ("x", "y", "z", "w")
    unpaired = dataclasses.replace(recording, pairing="unpaired", real=recording.real[::-1], real_names=names)
    result = _replay(tmp_path, unpaired, a_report("camera", **effects))
    assert result["gap"]["metric"] == "value_distance" and result["gap"]["after"] < 0.5 * result["gap"]["before"]


@pytest.mark.slow
def test_the_number_of_jobs_changes_nothing_and_names_stay_apart(tmp_path):
    report = tmp_path / "report.json"
    report.write_text(json.dumps(a_report("camera", read_noise={"sigma": 0.02})))
    given = [str(write(_camera({}), tmp_path / name / "same")) for name in "ab"]
    found = []
    for jobs in (1, 2):
        cfg = ReplayConfig(given, str(report), str(tmp_path / f"out{jobs}"), jobs)
        found.append([path.parent for path in replay_all(cfg)])
    assert [path.name for path in found[0]] == ["a-same", "b-same"]
    for one, two in zip(*found, strict=True):
        for name in ("replay.json", "after/0001.png"):
            assert (one / name).read_bytes() == (two / name).read_bytes()


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda report: report.update(format="other"), "is no report"),
        (lambda report: report.update(kind="camera"), "no camera effect is called 'latency'"),
        (lambda report: report.pop("effects"), "effects is missing"),
        (lambda report: report["effects"][0]["parameters"].clear(), "latency: missing delay"),
        (
            lambda report: report["effects"][0]["parameters"]["delay"].update(value=-1),
            "delay is -1, expected 0 to 10 s",
        ),
        (lambda report: report["effects"][0]["parameters"]["delay"].update(ci=3), "ci of delay is 3"),
    ],
)
def test_a_wrong_report_is_named(tmp_path, spoil, message):
    report = a_report("joint", **JOINT)
    spoil(report)
    with pytest.raises(UserError, match=message):
        _replay(tmp_path, a_joint(), report)


def test_kinds_must_agree(tmp_path):
    with pytest.raises(UserError, match="a recording of a joint, but the report is of a camera"):
        _replay(tmp_path, a_joint(), a_report("camera"))
