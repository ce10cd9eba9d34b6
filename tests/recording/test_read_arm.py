"""Recordings of arms: what comes back, and what is refused."""

from dataclasses import replace

import numpy as np
import pandas
import pytest
from recordings import an_arm, edit, refused

from vision_s2r.recording import read, split, write
from vision_s2r.recording.joined import joined_arms


@pytest.fixture
def folder(tmp_path):
    return write(an_arm(seconds=2.0, episodes=2), tmp_path / "arm")


def test_an_arm_comes_back_as_it_was_written(folder):
    one, again = an_arm(seconds=2.0, episodes=2), read(folder)
    assert again.kind == "arm" and list(again.joints) == ["shoulder", "elbow"] and again.tip == "tool"
    np.testing.assert_allclose(again.position, one.position, atol=1e-8)
    assert again.joints["elbow"].nominal == one.joints["elbow"].nominal and again.joints["elbow"].servo
    assert len(split(again, [1])) == 1 and split(again, [1]).episodes == (1,)


def test_what_is_left_out_of_a_drive_is_the_models_own(folder):
    edit(folder / "recording.yaml", ("proportional_gain: 60.0", "proportional_gain: 15"))
    text = (folder / "recording.yaml").read_text().splitlines()
    kept = [line for line in text if not any(key in line for key in ("armature", "viscous", "coulomb", "torque_limit"))]
    (folder / "recording.yaml").write_text("\n".join(kept))
    shoulder, elbow = read(folder).joints.values()
    assert (shoulder.nominal["proportional_gain"], elbow.nominal["proportional_gain"]) == (15, 60)
    text = (folder / "recording.yaml").read_text()
    (folder / "recording.yaml").write_text(text[: text.index("  elbow:")] + "  elbow:\n")
    assert read(folder).joints["elbow"].nominal["proportional_gain"] == 60
    assert shoulder.nominal["inertia"] == 0.05 and shoulder.nominal["command_limit"] == 15


def test_velocity_and_torque_are_commands_too(folder):
    edit(
        folder / "recording.yaml", ("command: position", "command: velocity"), ("command: position", "command: torque")
    )
    shoulder, elbow = read(folder).joints.values()
    assert not shoulder.servo and shoulder.nominal["torque_constant"] == 60
    assert shoulder.nominal["viscous_damping"] == pytest.approx(61.0)
    assert not elbow.servo and elbow.nominal["torque_constant"] == 1


def test_a_velocity_servo_that_asks_for_more_than_its_limit_is_said_to_have_none_in_the_simulator(folder):
    edit(folder / "recording.yaml", ("command: position", "command: velocity"))
    assert "asks for more than 15 in" in read(folder).left_out["torque_limit.shoulder"]
    edit(folder / "recording.yaml", ("torque_limit: 15.0", "torque_limit: 1e6"))
    assert not read(folder).left_out


def test_a_table_in_parquet_is_the_same(folder):
    csv = read(folder)
    pandas.read_csv(folder / "arm.csv").to_parquet(folder / "arm.parquet")
    (folder / "arm.csv").unlink()
    np.testing.assert_array_equal(read(folder).position, csv.position)


def test_torques_come_back_of_the_joints_that_logged_them(folder):
    one = an_arm(seconds=2.0, episodes=2)
    torque = {"elbow": np.arange(400.0).reshape(2, 200)}
    again = read(write(replace(one, torque=torque), folder.parent / "logged"))
    np.testing.assert_allclose(again.torque["elbow"], torque["elbow"])
    assert list(again.torque) == ["elbow"] and len(split(again, [1]).torque["elbow"]) == 1
    both = joined_arms([split(again, [0]), again]).torque["elbow"]
    assert both.shape == (3, 200) and (both[0] == both[1]).all()


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("recording.yaml", "elbow:", "elbw:", r"joints: no joint 'elbw' in two_links.xml, did you mean 'elbow'\?"),
        ("recording.yaml", "elbow:", '"el\\nbow":', "joints: no joint 'el bow' in two_links.xml"),
        ("recording.yaml", "tip: tool", "tip: tol", "tip is 'tol', did you mean 'tool'"),
        ("recording.yaml", "command: position", "command: pos", "shoulder: command is 'pos', did you mean 'position'"),
        ("recording.yaml", "armature", "amature", "unknown key 'amature', did you mean 'armature'"),
        (
            "recording.yaml",
            "model: two_links.xml",
            "model: ../a.xml",
            "model is '../a.xml', expected a file in the folder",
        ),
        ("recording.yaml", "model: two_links.xml", "model: none.xml", "no such file, expected an MJCF or URDF model"),
        ("two_links.xml", 'mass="0.5"', 'mass="0"', "MuJoCo says: mass and inertia of moving bodies must be larger"),
        ("two_links.xml", "</mujoco>", "", "does not load in MuJoCo: XML"),
        ("arm.csv", "command.elbow", "command.wrist", "unknown column 'command.wrist'"),
        ("arm.csv", ",position.elbow", "", "missing column position.elbow"),
    ],
)
def test_a_spoilt_recording_is_refused_in_a_line(folder, file, old, new, message):
    edit(folder / file, (old, new))
    refused(folder, message)


def spoil(folder, column, change):
    """Change a column of arm.csv."""
    lines = (folder / "arm.csv").read_text().splitlines()
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    at = lines[0].split(",").index(column)
    table[:, at] = change(table[:, at])
    np.savetxt(folder / "arm.csv", table, "%.9g", ",", header=lines[0], comments="")


@pytest.mark.parametrize("columns", [("position.elbow",), ("command.elbow",), ("position.elbow", "command.elbow")])
def test_degrees_for_radians_are_refused_with_the_factor(folder, columns):
    for column in columns:
        spoil(folder, column, np.rad2deg)
    refused(folder, r"is it in degrees \(57.3 to a rad\)")


def test_commands_that_never_move_are_refused(folder):
    for name in ("shoulder", "elbow"):
        spoil(folder, f"command.{name}", np.zeros_like)
    refused(folder, "arm.csv: no command ever moves, expected one that does")


def test_a_log_of_one_row_is_refused(folder):
    lines = (folder / "arm.csv").read_text().splitlines()
    (folder / "arm.csv").write_text("\n".join(lines[:2]))
    refused(folder, "one sample, expected at least 100")
