"""Logs of other projects become recordings, and what is not in them is said."""

import csv
import json
import shutil

import numpy as np
import pandas
import pytest
from recordings import REAL

from vision_s2r.errors import UserError
from vision_s2r.imports import ImportOptions, import_recording
from vision_s2r.recording import read

T = np.arange(200) * 0.02
GOAL = 0.5 * np.sin(3 * T)
POSITION = 0.5 * np.sin(3 * (T - 0.05))


def a_motion(folder, lag=0.02):
    """Two joints as SAGE's script writes them, the speed `lag` late."""
    folder.mkdir(parents=True)
    (folder / "joint_list.txt").write_text("Rotation\nJaw\n")
    speed = 1.5 * np.cos(3 * (T - 0.05 - lag))
    columns = {
        "control": {"positions": GOAL},
        "state_motor": {"positions": POSITION, "velocities": speed, "torques": abs(speed)},
    }
    for name, values in columns.items():
        with (folder / f"{name}.csv").open("w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(["type", "timestamp", *values])
            rows.writerows(
                [name.upper(), 1e6 * t, *([float(each[k]), 0.5] for each in values.values())] for k, t in enumerate(T)
            )
    return folder


def test_a_motion_becomes_a_recording_a_joint(tmp_path):
    found = import_recording("sage", a_motion(tmp_path / "wave"), tmp_path / "out")
    assert [each.folder.name for each in found] == ["Rotation", "Jaw"]
    recording = read(tmp_path / "out" / "Rotation")
    assert recording.servo and recording.nominal["proportional_gain"] == 17.8
    np.testing.assert_allclose(recording.command[0], GOAL, atol=1e-8)
    said = str(found[0])
    assert "200 rows" in said and "50 Hz" in said and "no torque" in said and "velocity, it lags the positions" in said
    assert (found[0].folder / "import.png").read_bytes().startswith(b"\x89PNG")
    only = import_recording(
        "sage", tmp_path / "wave", tmp_path / "one", ImportOptions(joint="Jaw", nominal={"inertia": 0.01})
    )
    assert read(only[0].folder).nominal["inertia"] == 0.01 and only[0].folder == tmp_path / "one"


def test_a_pendulum_log_has_its_weight_and_its_supply(tmp_path):
    entries = [
        {
            "position": float(q),
            "speed": 0.0,
            "load": 0,
            "input_volts": 11.4,
            "temp": 20,
            "timestamp": 0.01 + float(t),
            "goal_position": float(g),
            "torque_enable": bool(t < 3),
        }
        for t, q, g in zip(T, POSITION, GOAL, strict=True)
    ]
    log = {
        "mass": 1.0,
        "length": 0.1,
        "kp": 16,
        "vin": 12.0,
        "motor": "sts3250",
        "trajectory": "sin",
        "entries": entries,
    }
    for name in ("a", "b"):
        (tmp_path / f"{name}.json").write_text(json.dumps(log))
    recording = read(import_recording("bam", tmp_path, tmp_path / "out")[0].folder)
    assert len(recording) == 2 and recording.nominal["gravity_torque"] == pytest.approx(0.980665)
    (tmp_path / "a.json").write_text(json.dumps(log | {"length": 1e308}))  # whose square no float holds
    with pytest.raises(UserError, match=r"a\.json: length is .*expected a number from 0"):
        import_recording("bam", tmp_path, tmp_path / "again")
    assert recording.nominal["proportional_gain"] == 13.0 and recording.nominal["back_emf"] == 0.62
    np.testing.assert_allclose(recording.supply[0], np.where(T < 3, 0.95, 0.0))
    # The same bench at two and a half times the gain.
    (tmp_path / "a.json").write_text(json.dumps(log | {"kp": 40}))
    recording = read(import_recording("bam", tmp_path, tmp_path / "gains")[0].folder)
    assert recording.nominal["proportional_gain"] == 13.0 and recording.gains.tolist() == [2.5, 1.0]
    # Half the gain that is usual, one and a half times the data sheet's supply.
    other = log | {"motor": "xl330", "kp": 200, "vin": 7.5, "arm_mass": 0.3}
    (tmp_path / "a.json").write_text(json.dumps(other))
    (tmp_path / "b.json").unlink()
    recording = read(import_recording("bam", tmp_path, tmp_path / "xl330")[0].folder)
    stall = 0.52 * 1.5
    assert recording.nominal["proportional_gain"] == pytest.approx(
        stall * 200 * 4096 / (2 * np.pi) / 128 / 885, rel=1e-3
    )
    assert recording.nominal["command_limit"] == pytest.approx(stall)
    assert recording.nominal["back_emf"] == pytest.approx(0.52 / (103 * 2 * np.pi / 60), rel=1e-2)
    assert recording.nominal["inertia"] == pytest.approx(0.002 + (1.0 + 0.1) * 0.01)
    assert recording.nominal["gravity_torque"] == pytest.approx(1.15 * 0.980665)


def test_any_table_is_read_by_the_names_of_its_columns(tmp_path):
    table = np.stack([T, np.rad2deg(POSITION), GOAL, T], axis=1)
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="time,angle,goal,spare", comments="")
    options = ImportOptions(
        columns={"t": "time", "position": "angle", "target": "goal"}, scale={"position": np.pi / 180}, drive="sts3215"
    )
    (found,) = import_recording("csv", tmp_path / "log.csv", tmp_path / "out", options)
    np.testing.assert_allclose(read(found.folder).position[0], POSITION, atol=1e-7)
    assert found.summary["left_out"] == {"spare": "not asked for"}
    pandas.read_csv(tmp_path / "log.csv").to_parquet(tmp_path / "log.parquet")
    (same,) = import_recording("csv", tmp_path / "log.parquet", tmp_path / "parquet", options)
    np.testing.assert_array_equal(read(same.folder).position, read(found.folder).position)
    options.drive = ""
    with pytest.raises(UserError, match=r"nominal.inertia.*control.proportional is not known"):
        import_recording("csv", tmp_path / "log.csv", tmp_path / "again", options)
    del options.columns["t"]
    with pytest.raises(UserError, match=r"no column t among time, angle, goal, spare; .*\+columns=\{t: THEIR_NAME\}"):
        import_recording("csv", tmp_path / "log.csv", tmp_path / "again", options)
    options.columns["position"] = "angel"
    with pytest.raises(UserError, match="no column 'angel', did you mean 'angle'"):
        import_recording("csv", tmp_path / "log.csv", tmp_path / "again", options)


@pytest.mark.parametrize(("version", "files"), [("v2.1", 2), ("v3.0", 1)])
def test_a_data_set_of_lerobot_becomes_a_recording_a_joint(tmp_path, version, files):
    """Version 2.1 has a file an episode, version 3 has many in one; angles are in degrees."""
    names = ["shoulder_pan.pos", "gripper.pos"]
    spelled = {"motors": names} if version == "v2.1" else names
    features = {key: {"dtype": "float32", "names": spelled} for key in ("action", "observation.state")}
    info = {"codebase_version": version, "fps": 50, "total_frames": 2 * len(T), "features": features}
    goal, seen = (np.rad2deg(np.stack([each, 0.5 * each], axis=1)) for each in (GOAL, POSITION))
    episodes = [
        pandas.DataFrame(
            {
                "action": list(goal.astype(np.float32)),
                "observation.state": list(seen.astype(np.float32)),
                "timestamp": (T / 0.02).round() / 50,
                "frame_index": np.arange(len(T)),
                "episode_index": k,
            }
        )
        for k in range(2)
    ]
    (tmp_path / "set" / "meta").mkdir(parents=True)
    (tmp_path / "set" / "meta" / "info.json").write_text(json.dumps(info))
    data = tmp_path / "set" / "data" / "chunk-000"
    data.mkdir(parents=True)
    for k, frame in enumerate(episodes if files == 2 else [pandas.concat(episodes)]):
        frame.to_parquet(data / (f"episode_{k:06}.parquet" if files == 2 else f"file-{k:03}.parquet"))
    found = import_recording("lerobot", tmp_path / "set", tmp_path / "out")
    assert [each.folder.name for each in found] == ["shoulder_pan", "gripper"]
    pan = read(found[0].folder)
    assert len(pan) == 2 and pan.sample_time == pytest.approx(0.02)
    np.testing.assert_allclose(pan.position[1], POSITION, atol=1e-6)
    np.testing.assert_allclose(pan.command[1], GOAL, atol=1e-6)


def test_what_cannot_be_imported_is_one_line(tmp_path):
    with pytest.raises(UserError, match="no source is called 'sgae': did you mean 'sage'"):
        import_recording("sgae", tmp_path, tmp_path / "out")
    with pytest.raises(UserError, match=r"no control\.csv in it"):
        import_recording("sage", tmp_path, tmp_path / "out")
    with pytest.raises(UserError, match="no such file or folder"):
        import_recording("bam", tmp_path / "absent", tmp_path / "out")
    with pytest.raises(UserError, match="expected a LeRobot data set"):
        import_recording("lerobot", tmp_path, tmp_path / "out")
    (tmp_path / "one.csv").write_text("t,position,target\n0,0,0\n")
    with pytest.raises(UserError, match=r"one\.csv: one has 1 row, expected a log of motion"):
        import_recording("csv", tmp_path / "one.csv", tmp_path / "out", ImportOptions(drive="sts3215"))
    back = "".join(f"{0.02 * k},{0.1 * k},0\n" for k in [*range(20), 3])
    (tmp_path / "back.csv").write_text("t,position,target\n" + back)
    with pytest.raises(UserError, match=r"^back: joint\.csv, line 22: "):
        import_recording("csv", tmp_path / "back.csv", tmp_path / "out", ImportOptions(drive="sts3215"))
    assert not (tmp_path / "out").exists()  # so that it can be tried again
    folder = a_motion(tmp_path / "wave")
    with pytest.raises(UserError, match="no joint is called 'Jwa', did you mean 'Jaw'"):
        import_recording("sage", folder, tmp_path / "out", ImportOptions(joint="Jwa"))
    (folder / "control.csv").write_text(f'timestamp,positions\n0,"[{10**400}, 0]"\n')
    with pytest.raises(UserError, match="expected timestamp and positions"):
        import_recording("sage", folder, tmp_path / "out")
    shutil.copy(folder / "joint_list.txt", folder / "control.csv")
    with pytest.raises(UserError, match="expected timestamp and positions"):
        import_recording("sage", folder, tmp_path / "out")


def test_real_logs_come_in(tmp_path):
    roll = import_recording("sage", REAL / "sage" / "multisine", tmp_path / "so101", ImportOptions(joint="Wrist_Roll"))
    assert "velocity" in roll[0].summary["left_out"] and roll[0].summary["rows"] == 500
    swing = import_recording("bam", REAL / "sts3250", tmp_path / "sts3250")
    assert swing[0].summary["episodes"] == 1 and "lags" in swing[0].summary["left_out"]["velocity"]
