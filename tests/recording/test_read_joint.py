"""Joint recordings: what is right comes back as it was, what is wrong is one line that says so."""

import dataclasses

import numpy as np
import pytest
from recordings import a_joint, edit, refused

from vision_s2r.recording import read, split, write


def test_it_comes_back_as_it_was_written(tmp_path):
    one = a_joint()
    uneven = dataclasses.replace(one, lengths=np.array([120, 60, 90]), episodes=(4, 1, 2))
    for k, length in enumerate(uneven.lengths):
        uneven.command[k, length:], uneven.position[k, length:], uneven.velocity[k, length:] = 0, np.nan, np.nan
    again = read(write(uneven, tmp_path / "out"))
    assert again.nominal == uneven.nominal and again.episodes == (4, 1, 2) and again.sample_time == 0.01
    for name in ("command", "position", "velocity", "lengths"):
        np.testing.assert_allclose(getattr(again, name), getattr(uneven, name), rtol=1e-8, atol=1e-12)
    some = split(again, [2, 1])
    assert some.position.shape == (2, 90) and some.episodes == (2, 1)
    np.testing.assert_allclose(some.first[1], [uneven.position[1, 0], uneven.velocity[1, 0]], atol=1e-12)


def test_a_force_has_a_torque_constant_of_one_and_a_velocity_may_be_absent(joint_folder):
    edit(joint_folder / "recording.yaml", ("units: rotary", "units: linear"))
    path = joint_folder / "joint.csv"
    rows = [row.rsplit(",", 1)[0] for row in path.read_text().splitlines()]
    path.write_text("\n".join(rows).replace("current", "force"))
    recording = read(joint_folder)
    assert recording.nominal["torque_constant"] == 1 and recording.velocity is None
    assert (recording.first[:, 1] == 0).all()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("kind: joint", "kind: jiont", "kind is 'jiont', did you mean 'joint'"),
        ("kind: joint", "kind: robot", "a robot has several recordings"),
        ("recording/1", "recording/9", "format is .*expected 'vision-s2r/recording/1'"),
        ("inertia", "inertai", "unknown key 'inertai', did you mean 'inertia'"),
        ("sample_time", "sampel_time", "unknown key 'sampel_time', did you mean 'sample_time'"),
        ("  inertia: 0.02\n", "", "nominal: missing inertia"),
        ("inertia: 0.02", "inertia: -1", "inertia is '-1', expected a number above 0"),
        ("inertia: 0.02", "inertia: .nan", "inertia is '.nan', expected a number"),
        ("sample_time: 0.01", "sample_time: 0", "sample_time is '0', expected a number above 0"),
        ("sample_time: 0.01", "sample_time: 0.02", "rows every 0.01 s, but sample_time is 0.02 s"),
        ("units: rotary", "units: degrees", "units is 'degrees'"),
        ("nominal:", "nominal: {", "is not YAML"),
        ("nominal:\n", "nominal: 3\nother:\n", "unknown key 'other'"),
    ],
)
def test_a_wrong_header_is_named(joint_folder, old, new, message):
    edit(joint_folder / "recording.yaml", (old, new))
    refused(joint_folder, message)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "episode,t,current,position",
            "episode,t,current,positoin",
            "unknown column 'positoin', did you mean 'position'",
        ),
        ("episode,t,current,", "episode,t,velocity,", "two columns are called 'velocity'"),
        (
            "episode,t,current,",
            "episode,t,force,",
            "force does not go with units 'rotary', expected current or torque or t",
        ),
        ("\n0,0.01,", "\n0,0.0,", "line 3: time stands still"),
        ("\n0,0.05,", "\n0,0.01,", "line 7: time goes backward, from 0.04 to 0.01"),
        ("\n0,1.19,", "\n0,70,", "line 121: no row for 68.82 s, expected another episode"),
        ("\n0,0.05,", "\n0,nan,", "line 7: t is nan, expected a finite number"),
        ("\n0,0.05,", "\n0,0.05,inf,", "line 7: 6 values, expected 5"),
        ("\n0,0.05,", "\n0.5,0.05,", "line 7: episode is 0.5, expected a whole number"),
        ("\n0,0.05,", "\n0,,", "line 7: '' is not a number"),
        ("\n0,0.05,", "\n0,soon,", "line 7: 'soon' is not a number"),
    ],
)
def test_a_wrong_table_is_named_by_its_line(joint_folder, old, new, message):
    edit(joint_folder / "joint.csv", (old, new))
    refused(joint_folder, message)


def test_missing_columns_are_named(joint_folder):
    path = joint_folder / "joint.csv"
    rows = [",".join(row.split(",")[:2]) for row in path.read_text().splitlines()]
    path.write_text("\n".join(rows))
    refused(joint_folder, r"missing column position, current \(or torque, force or target\)")


def test_too_little_is_refused_only_where_some_must_be_held_out(joint_folder, tmp_path):
    path = joint_folder / "joint.csv"
    rows = path.read_text().splitlines()
    path.write_text("\n".join(rows[:31]))
    refused(joint_folder, "30 samples are too short to hold any out, expected at least 100")
    assert read(joint_folder, hold_out=False).lengths.tolist() == [30]
    path.write_text("\n".join(rows[:2]))
    refused(joint_folder, "one sample", hold_out=False)
    path.write_text(rows[0] + "\n")
    refused(joint_folder, "no row under the header")
    path.unlink()
    refused(joint_folder, "joint.csv: cannot be read")
    (tmp_path / "empty").mkdir()
    refused(tmp_path / "empty", "an empty folder, expected a recording")
    refused(tmp_path / "absent", "no such folder")
    refused(tmp_path / ("absent" * 1000), "no such folder")


@pytest.mark.parametrize(
    ("position", "velocity", "message"),
    [
        (1, 180 / np.pi, r"velocity is 57\.\d times the derivative of position: velocity in degrees\?"),
        (180 / np.pi, 1, r"velocity is 0\.017\d times the derivative of position: position in degrees\?"),
        (1, 30 / np.pi, r"9\.5\d times.*rpm\?"),
        (1, -1, r"-(1|0\.99\d) times.*sign"),
        (1, 2, r"velocity is 2 times the derivative of position, expected them in one unit"),
        (1, 0, "velocity stays at rest while position does not"),
    ],
)
@pytest.mark.parametrize(("noise", "quantum"), [(0.0, 0.0), (3e-3, 0.0), (0.0, 0.02)])
def test_a_velocity_that_is_not_the_derivative_is_named_by_its_factor(
    tmp_path, position, velocity, message, noise, quantum
):
    one = a_joint(noise=noise, quantum=quantum)
    read(write(one, tmp_path / "right"))
    wrong = dataclasses.replace(one, position=position * one.position, velocity=velocity * one.velocity)
    refused(write(wrong, tmp_path / "wrong"), message)


def test_an_unrelated_velocity_is_refused_and_one_that_is_mostly_noise_is_not(tmp_path):
    one = a_joint()
    refused(
        write(dataclasses.replace(one, velocity=one.velocity[::-1]), tmp_path / "other"), "does not follow position"
    )
    for k, (noise, quantum) in enumerate([(1e-3, 0.0), (1e-2, 0.0), (0.0, 0.01)]):
        read(write(a_joint(noise, quantum, speed=2e-3), tmp_path / f"{k}"))  # hardly moves at all


def test_an_angle_that_wraps_around_is_refused(tmp_path):
    one = a_joint(speed=4)
    wrapped = dataclasses.replace(one, position=np.mod(one.position, 2 * np.pi))
    read(write(one, tmp_path / "right"))
    refused(write(wrapped, tmp_path / "wrong"), "position jumps by .*6\\.\\d+ rad")


@pytest.mark.timeout(60)  # a second; minutes with a loop over rows
def test_twenty_five_thousand_rows_are_no_loop(tmp_path):
    assert read(write(a_joint(samples=8400), tmp_path / "long")).lengths.sum() > 25_000
