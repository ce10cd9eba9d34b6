"""A data set of LeRobot's form: what goes in comes out of the code that reads theirs."""

import json

import cv2
import numpy as np
import pandas
import pytest
from recordings import DRIVE, TWO_LINKS, a_joint

from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.errors import UserError
from vision_s2r.export.lerobot import LeRobotConfig, export_lerobot
from vision_s2r.imports import import_recording
from vision_s2r.imports.lerobot import Dataset
from vision_s2r.recording import ArmRecording, JointRecording, read, write
from vision_s2r.render import Views, render
from vision_s2r.translate.video import VideoConfig, translate_video

pytest.importorskip("pyarrow")


def exported(recording, tmp_path):
    folder = write(recording, tmp_path / "recording")
    return export_lerobot(LeRobotConfig(recording=str(folder), out=str(tmp_path / "dataset")))


def test_a_joint_comes_back(tmp_path):
    (found,) = import_recording("lerobot", exported(a_joint(), tmp_path), tmp_path / "back")
    before, after = a_joint(), read(found.folder)
    assert after.nominal == pytest.approx(before.nominal) and after.sample_time == pytest.approx(0.01)
    for key in ("command", "position", "velocity"):
        np.testing.assert_allclose(getattr(after, key), getattr(before, key), rtol=1e-6, atol=1e-6)
    assert after.episodes == before.episodes


def test_a_column_that_is_an_index(tmp_path):
    dataset = exported(a_joint(), tmp_path)
    (file,) = (dataset / "data").glob("**/*.parquet")
    pandas.read_parquet(file).set_index("episode_index").to_parquet(file)
    with pytest.raises(UserError, match=r"cannot be read .*expected columns action, .*episode_index"):
        import_recording("lerobot", dataset, tmp_path / "back")


def an_arm():
    """Two servos that follow late."""
    t = np.arange(200) * 0.01 + np.zeros((2, 1))
    joints = {
        name: JointRecording(
            DRIVE, 0.01, "rotary", 0.4 * np.sin(w * t), 0.4 * np.sin(w * (t - 0.05)), None, np.full(2, 200), (0, 1)
        )
        for name, w in (("shoulder", 3), ("elbow", 5))
    }
    return ArmRecording(TWO_LINKS, joints, dict.fromkeys(joints, "position"), {}, "tool")


def test_the_joints_of_an_arm_come_back(tmp_path):
    before = an_arm()
    found = import_recording("lerobot", exported(before, tmp_path), tmp_path / "back")
    assert [each.folder.name for each in found] == list(before.joints)
    for each in found:
        joint, after = before.joints[each.folder.name], read(each.folder)
        assert after.nominal == pytest.approx(joint.nominal)
        np.testing.assert_allclose(after.position, joint.position, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(after.command, joint.command, rtol=1e-6, atol=1e-6)
    info = json.loads((tmp_path / "dataset" / "meta" / "info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["features"]["action"]["names"][0].endswith(".pos")


@pytest.fixture(scope="module")
def renders(tmp_path_factory):
    cfg = compose(Config, overrides=["experiment=debug", "render.scenes=3", "render.real=true", "render.grasps=4"])
    cfg.render.out, cfg.render.workers = str(tmp_path_factory.mktemp("renders")), 1
    return render(cfg.scene, cfg.render)


@pytest.mark.parametrize("lossless", [True, False])
def test_renders_come_back(renders, tmp_path, lossless):
    views = Views.open(renders)
    out = export_lerobot(LeRobotConfig(renders=str(renders), out=str(tmp_path / "dataset"), lossless=lossless))
    dataset, m = Dataset.open(out), views.margin
    assert dataset.cameras == [f"observation.images.{name}" for name in ("canonical", "randomized", "real")]
    pictures = np.stack(list(dataset.pictures("observation.images.real")))
    expected = np.repeat(views.all("real")[:, m:-m, m:-m].numpy(), 4, axis=0)
    if lossless:
        np.testing.assert_array_equal(pictures, expected)
    else:
        assert np.abs(pictures - expected.astype(float)).mean() < 6  # of 255
    video = translate_video(VideoConfig(str(out), "observation.images.real", out=str(tmp_path / "canonical.mp4")))
    assert cv2.VideoCapture(str(video)).get(cv2.CAP_PROP_FRAME_COUNT) == 12
    rows = dataset.table("data", ["action", "next.success", "episode_index"])
    np.testing.assert_allclose(np.stack(rows["action"]), views.all("grasps").reshape(-1, 3), rtol=1e-6)
    assert rows["next.success"].tolist() == views.all("success").flatten().bool().tolist()
    episodes = pandas.read_parquet(out / "meta/episodes/chunk-000/file-000.parquet")
    assert episodes["dataset_to_index"].tolist() == [4, 8, 12]


def test_what_cannot_be_exported_is_one_line(tmp_path):
    with pytest.raises(UserError, match="expected recording=DIR or renders=DIR"):
        export_lerobot(LeRobotConfig(out=str(tmp_path / "out")))
    out = exported(a_joint(), tmp_path)
    with pytest.raises(UserError, match="is not empty"):
        export_lerobot(LeRobotConfig(recording=str(tmp_path / "recording"), out=str(out)))
    with pytest.raises(UserError, match="no camera 'front'"):
        list(Dataset.open(out).pictures("front"))
