"""An arm that presses on a table its simulator has not: found, said, and left out of what joints are blamed for."""

from dataclasses import replace
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from recordings import TWO_LINKS, an_arm
from test_arm_diagnosis import QUICK

from vision_s2r.arm.model import ArmModel
from vision_s2r.diagnose.arm import diagnose_arm
from vision_s2r.diagnose.locate import where
from vision_s2r.diagnose.replay import replay
from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.arm.places import samples
from vision_s2r.recording import ArmRecording
from vision_s2r.recording.pieces import without
from vision_s2r.report.page import html
from vision_s2r.report.reading import diagnosed, read_report, values

STEP = 1e-4  # s


def over_a_table(height: float, damping: float = 1.0) -> tuple[ArmRecording, np.ndarray]:
    """An arm that MuJoCo moves, its elbow so damped, above a plane; and where it touches [E, T]."""
    recording = an_arm(seconds=8.0)
    spec = ArmModel(TWO_LINKS).spec.copy()
    for geom in list(spec.geoms):
        spec.delete(geom)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], pos=[0, 0, height])
    tool = spec.site("tool")
    tool.parent.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.005, 0, 0], pos=tool.pos, mass=0)
    model = spec.compile()
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.dof_damping[1] = damping
    measured, touching = np.empty_like(recording.position), np.zeros(recording.position.shape[:2], dtype=bool)
    for episode in range(len(recording)):
        data = mujoco.MjData(model)
        data.qpos[:2] = recording.position[episode, 0]
        for k, command in enumerate(np.array([joint.command[episode] for joint in recording.joints.values()]).T):
            measured[episode, k], data.ctrl[:] = data.qpos[:2], command
            for _ in range(round(recording.any.sample_time / STEP)):
                mujoco.mj_step(model, data)
                touching[episode, k] |= data.ncon > 0
    measured += 2e-4 * np.random.default_rng(3).standard_normal(measured.shape)
    joints = {
        name: replace(joint, position=measured[..., j]) for j, (name, joint) in enumerate(recording.joints.items())
    }
    return replace(recording, joints=joints), touching


@pytest.mark.slow
def test_what_the_tip_touches_is_found_and_joints_are_not_blamed_for_it(tmp_path):
    recording, touching = over_a_table(0.85, damping=1.5)
    assert 0.05 < touching.mean() < 0.4
    done = diagnose_arm(recording, QUICK)
    done.save(tmp_path / "report")
    report = read_report(tmp_path / "report" / "report.json")
    assert [(each["joint"], each["name"]) for each in report["effects"]] == [("elbow", "viscous_damping")]
    assert report["effects"][0]["parameters"]["value"]["value"] == pytest.approx(1.5, rel=0.03)
    assert report["touches"]["height"] == pytest.approx(0.855, abs=0.01) and report["touches"]["times"] >= 2
    out = np.zeros_like(touching)
    for episode, first, end in report["held_out"]["without"]:
        out[episode, first:end] = True
    assert not (touching & ~out).any()
    assert (
        report["verdict"] == "partly_explained"
        and "touches at a height of 0.8" in report["unexplained"]["resembles"][0]
    )
    assert "0.8" in report["next_experiment"]
    page = html(report, done.plot())
    assert "The tip touches something" in page and "Elsewhere: The real arm differs: its elbow: viscous damping" in page
    again = replay(recording, values(diagnosed(report)), tmp_path, held_out=report["held_out"])
    assert again["gap"]["before"] == report["gap"]["before"] and again["gap"]["after"] == report["gap"]["after"]


@pytest.mark.slow
def test_an_arm_that_touches_nothing_keeps_all_of_its_rows():
    report = diagnose_arm(over_a_table(0.0, damping=1.5)[0], QUICK).to_dict()
    assert "touches" not in report and "without" not in report["held_out"]
    assert [(each["joint"], each["name"]) for each in report["effects"]] == [("elbow", "viscous_damping")]


def test_stretches_between_rows_that_are_left_out_are_episodes():
    recording = an_arm(seconds=4.0)
    left = without(recording, [(0, 100, 150), (1, 20, 400)])
    assert left.any.lengths.tolist() == [100, 250] and left.episodes == (0, 1)  # 0.2 s are too short
    for name, joint in left.joints.items():
        whole = recording.joints[name]
        np.testing.assert_array_equal(joint.position[1], whole.position[0, 150:])
        np.testing.assert_array_equal(joint.command[0, :100], whole.command[0, :100])
        assert np.isnan(joint.position[0, 100:]).all()


def test_where_an_arms_gap_lies_is_said_by_the_height_of_its_tip_and_by_goals():
    recording = over_a_table(0.85)[0]
    runs, rows = FreeRuns(recording), int(recording.any.lengths[0])
    edges = np.linspace(0, rows, 9).astype(int)
    held_out = {"segments": [(k, *ends, 0) for k in range(2) for ends in pairwise(map(int, edges))]}
    found = where(samples(recording, runs.states({}), runs.noise**2, held_out), seed=0)
    (height,) = [each for each in found if each["axis"] == "height of the tip"]
    assert height["at"].startswith("0.8") and height["share"] > 0.7 and height["ci"][0] > 1.5 * height["samples"]
    assert any(each["axis"].startswith("goal of ") for each in found)


def test_stretches_of_one_motion_are_not_taken_for_several():
    recording = an_arm(seconds=4.0)
    joints = {name: replace(each, source=np.arange(len(recording))) for name, each in recording.joints.items()}
    left = without(replace(recording, joints=joints), [(0, 100, 150), (0, 250, 300)]).any
    assert list(left.source) == list(left.stretch_of) == [0, 0, 0, *range(1, len(recording))]
    assert left.motions == len(recording) and len(left) == len(recording) + 2
