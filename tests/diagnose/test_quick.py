"""A quick diagnosis: less of the recording, fewer fits, and a report that says so."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from recordings import NOMINAL, a_camera, a_joint

from vision_s2r.diagnose import quick_study
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.quick import part_of
from vision_s2r.fit.joint.fitter import JointFitter
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording, write
from vision_s2r.report import GapReport


def a_log() -> JointRecording:
    """Five episodes of 8 s of a joint with twice the damping that it is believed to have, and latency."""
    rng = np.random.default_rng(0)
    command = np.repeat(rng.uniform(-1, 1, (5, 40)), 20, axis=1)
    machine = pack(NominalJoint(**NOMINAL), {"viscous_damping": {"value": 0.2}, "latency": {"delay": 0.021}})[None]
    states = simulate(machine, command, np.zeros((5, 2)), 0.01)[0]
    position, velocity = (states[..., k] + 1e-3 * rng.standard_normal(command.shape) for k in (0, 1))
    return JointRecording(NOMINAL, 0.01, "rotary", command, position, velocity, np.full(5, 800), tuple(range(5)))


def test_a_quick_diagnosis_says_the_same_from_less_and_that_it_was_quick(tmp_path, monkeypatch):
    work = []  # samples that were predicted, by diagnosis
    fit = JointFitter.fit
    monkeypatch.setattr(
        JointFitter, "fit", lambda self, *given: (work.append(self.track.lengths.sum()), fit(self, *given))[1]
    )
    reports = {}
    for quick in (False, True):
        work.clear()
        diagnosis = diagnose(a_log(), DiagnoseConfig(quick=quick))
        reports[quick] = diagnosis, sum(work)
        names = {effect.name: effect for effect in diagnosis.effects}
        assert names.keys() == {"viscous_damping", "latency"}
        assert abs(names["latency"].parameters["delay"].value - 0.021) < 1e-3
    (whole, much), (quick_one, little) = reports[False], reports[True]
    assert little < 0.4 * much
    assert whole.quick is None and "quick" not in whole.summary()
    page = quick_one.save(tmp_path / "report")
    assert GapReport.read(tmp_path / "report" / "report.json").quick is True
    assert "This was a quick look" in quick_one.summary() and "This was a quick look" in page.read_text()


def test_both_are_set_side_by_side(tmp_path, monkeypatch):
    said = {False: ["latency", "viscous_damping"], True: ["latency"]}

    def told(recording, cfg):
        names = [SimpleNamespace(name=name) for name in said[cfg.quick]]
        return SimpleNamespace(verdict="explained", effects=names if recording.nominal["inertia"] > 0.02 else names[:1])

    clock = iter(np.cumsum([0.0, 6.0, 0.0, 2.0, 0.0, 2.0, 0.0, 1.0]))
    monkeypatch.setattr(quick_study, "diagnose", told)
    monkeypatch.setattr(quick_study.time, "process_time", lambda: next(clock))
    folders = []
    for name, inertia in (("one", 0.02), ("two", 0.03)):
        one = a_joint()
        folders.append(write(replace(one, nominal={**one.nominal, "inertia": inertia}), tmp_path / name))
    (row,) = quick_study.study(tmp_path / "out", folders)["rows"]
    assert row[0] == "joint" and row[1]["value"] == 50.0 and row[1]["of"] == 2
    assert [each["value"] for each in row[2:]] == [4.0, 1.5, 0.38]
    assert json.loads((tmp_path / "out" / "quick.json").read_text())["rows"] == [row]


def test_a_quick_look_is_at_pairs_from_all_over_and_at_whole_motions_under_loads():
    some = part_of(a_camera(frames=30))
    assert some.names == tuple(f"{k:04}" for k in np.linspace(0, 29, 10).round().astype(int))
    assert len(part_of(a_camera(frames=4))) == 4
    joint = a_joint(samples=600)
    assert part_of(joint).lengths.tolist() == [200] * 3 and part_of(joint).position.shape == (3, 200)
    loaded = replace(joint, load_inertia=np.zeros(joint.command.shape))
    assert part_of(loaded) is loaded
