"""Measured machines: diagnosed once, and tried on what no fit has seen."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from recordings import NOMINAL, an_arm

from tests.fit.camera.test_camera_case import recorded
from vision_s2r.diagnose.config import DiagnoseConfig, SearchConfig
from vision_s2r.errors import UserError
from vision_s2r.hardware import added_pictures, arms, bam
from vision_s2r.hardware import study as hardware
from vision_s2r.hardware.config import HardwareConfig
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording
from vision_s2r.recording.write import write

QUICK = SearchConfig(folds=2, beam=1, breadth=1, contenders=1, most=1)


def log(seed):
    """Three episodes of an axis with twice the damping that it is believed to have."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(-1, 1, (3, 12)), 10, axis=1)
    machine = pack(NominalJoint(**NOMINAL), {"viscous_damping": {"value": 0.2}})[None]
    states = simulate(machine, command, np.zeros((3, 2)), 0.01)[0]
    position, velocity = (states[..., k] + 1e-3 * rng.standard_normal(command.shape) for k in (0, 1))
    return JointRecording(NOMINAL, 0.01, "rotary", command, position, velocity, np.full(3, 120), (0, 1, 2))


def test_every_recording_is_measured_once_and_tried_on_the_others(tmp_path, monkeypatch):
    for name, seed in (("one", 3), ("two", 4)):
        write(log(seed), tmp_path / "logs" / "axis" / name)
    write(log(2), tmp_path / "logs" / "alone" / "all")
    monkeypatch.setattr(hardware, "DiagnoseConfig", lambda: DiagnoseConfig(joint=QUICK))
    monkeypatch.setattr(bam, "fit", lambda model, _: bam.packed(model, np.full(len(bam.MODELS[model]), 0.1)))
    cfg = HardwareConfig(path=str(tmp_path / "logs"), out=str(tmp_path / "out"))
    tables = {path.stem: json.loads(path.read_text()) for path in hardware.study(cfg)}
    rows = {row[0]: row for row in tables["hardware"]["rows"]}
    assert list(rows) == ["alone, all", "axis, one", "axis, two"]
    for name in ("axis, one", "axis, two"):
        assert "viscous damping 0.2 " in rows[name][1]
        believed, _, diagnosed = (float(x) for x in rows[name][4].split(" / "))
        assert diagnosed < 0.2 * believed
    assert [row[0].split(":")[0] for row in tables["alone"]["rows"]] == [
        "as believed",
        *bam.MODELS,
        "diagnosed",
    ] and rows["alone, all"][4] == "–"
    monkeypatch.setattr(hardware, "diagnose", None)  # nothing is left to be measured
    assert {path.stem: json.loads(path.read_text()) for path in hardware.study(cfg)} == tables
    alone = replace(cfg, out=str(tmp_path / "alone"), diagnose=False, only=["axis"])
    sensors, identified, agreement = [json.loads(path.read_text()) for path in hardware.study(alone)]
    assert [row[0] for row in sensors["rows"]] == ["alone, all", "axis, one", "axis, two"]
    assert all(row[1:] == ["none seen", "–", "used"] for row in sensors["rows"])
    assert [row[0] for row in identified["rows"]] == ["axis, one", "axis, two"]
    assert all(row[4] < 0.2 for row in identified["rows"])
    *each, whole = agreement["rows"]
    assert ["viscous damping", 1, "1 (100%)", "1 (100%)"] in each and whole[:2] == ["all", len(each)]


@pytest.mark.slow
def test_motions_are_diagnosed_together_and_tried_on_the_rest(tmp_path, monkeypatch):
    for name, seed in (("one", 3), ("two", 4), ("three", 5)):
        write(log(seed), tmp_path / "logs" / "axis" / name)
    monkeypatch.setattr(hardware, "DiagnoseConfig", lambda: DiagnoseConfig(joint=QUICK))
    cfg = HardwareConfig(path=str(tmp_path / "logs"), out=str(tmp_path / "out"), only=["one"])
    hardware.study(cfg)
    cfg = replace(cfg, together=["one", "two"])
    tables = {path.stem: json.loads(path.read_text()) for path in hardware.study(cfg)}
    assert [row[0] for row in tables["hardware"]["rows"]] == ["axis, one"]
    ((machine, diagnosis, _, others, alone, _),) = tables["together"]["rows"]
    believed, _, diagnosed = (float(x) for x in others.split(" / "))
    assert machine == "axis" and "viscous damping 0.2 " in diagnosis and diagnosed < 0.2 * believed
    assert alone.startswith("one ") and float(alone.split()[1]) < 0.2 * believed
    with pytest.raises(UserError, match="no machine has all of one, tow; there are one, three, two"):
        hardware.study(replace(cfg, together=["one", "tow"]))


@pytest.mark.slow
def test_an_arm_is_diagnosed_from_one_motion_and_tried_on_the_others(tmp_path, monkeypatch):
    for name, seed in (("one", 3), ("two", 4)):
        effects = {"elbow": {"viscous_damping": {"value": 2.5}}}
        write(an_arm(effects, seconds=3.0, seed=seed), tmp_path / "logs" / "arm" / name)
    monkeypatch.setattr(arms, "DiagnoseConfig", lambda: DiagnoseConfig(joint=QUICK))
    cfg = HardwareConfig(path=str(tmp_path / "logs"), out=str(tmp_path / "out"), only=["arm/one"])
    found = {path.stem: json.loads(path.read_text()) for path in hardware.study(cfg)}["arms"]
    ((motion, diagnosis, own, other, mean),) = found["rows"]
    assert motion == "one" and "elbow: viscous damping 2.5 " in diagnosis and own.endswith(" *") and mean == other
    before, after = (float(part) for part in other.partition(";")[0].split(" → "))
    assert after < 0.05 * before and " mm" in other
    monkeypatch.setattr(arms, "diagnose", None)  # its report is there
    reports = tmp_path / "out" / "reports" / "arm"
    shutil.copytree(reports / "one", reports / "one+gone")  # of a motion that is not there any more
    assert {path.stem: json.loads(path.read_text()) for path in hardware.study(cfg)}["arms"] == found


def test_a_folder_without_logs_is_one_line(tmp_path):
    with pytest.raises(UserError, match="no logs in it"):
        hardware.study(HardwareConfig(path=str(tmp_path)))


@pytest.mark.slow
def test_what_is_added_to_a_log_is_found_beside_what_it_has(tmp_path, monkeypatch):
    write(log(3), tmp_path / "logs" / "axis" / "one")
    monkeypatch.setattr(hardware, "DiagnoseConfig", lambda: DiagnoseConfig(joint=QUICK))
    cfg = HardwareConfig(path=str(tmp_path / "logs"), out=str(tmp_path / "out"), added=True)
    table = next(json.loads(path.read_text()) for path in hardware.study(cfg) if path.stem == "added")
    assert table["columns"] == ["added", "axis, one"] and len(table["rows"]) == 12
    said = dict(table["rows"])["viscous damping"]  # of which the log has twice as much as is believed
    found, size = float(said.split()[0]), float(said.split()[2])
    assert found == pytest.approx(size, rel=0.1) and "named" in said
    monkeypatch.setattr(hardware, "diagnose", None)  # nothing is left to be measured
    alone = tmp_path / "out" / "reports" / "axis" / "one" / "measured.json"
    together = json.loads(alone.read_text()) | {"motions": ["one", "two"]}
    alone.parent.with_name("one+two").mkdir()
    (alone.parent.with_name("one+two") / "measured.json").write_text(json.dumps(together))
    assert json.loads(next(path for path in hardware.study(cfg) if path.stem == "added").read_text()) == table
    with pytest.raises(UserError, match="added asks for diagnoses, but diagnose is false"):
        hardware.study(replace(cfg, diagnose=False))


@pytest.mark.slow
def test_what_is_added_to_photographs_is_found(tmp_path, monkeypatch):
    write(recorded(lens_distortion={"k1": -0.2, "k2": 0.04}), tmp_path / "logs" / "camera" / "one")
    few, all_of_them = {"exposure", "gamma"}, added_pictures.with_effects
    monkeypatch.setattr(
        added_pictures, "with_effects", lambda *given: (each for each in all_of_them(*given) if each.effect in few)
    )
    cfg = HardwareConfig(path=str(tmp_path / "logs"), out=str(tmp_path / "out"), added=True)
    table = next(json.loads(path.read_text()) for path in hardware.study(cfg) if path.stem == "added")
    assert table["columns"] == ["added", "camera, one"] and len(table["rows"]) == 2
    for _, said in table["rows"]:
        found, size = float(said.split()[0]), float(said.split()[2])
        assert found == pytest.approx(size, rel=0.15) and "named" in said and "; and" not in said
