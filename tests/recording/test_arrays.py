"""Recordings from memory are those of a folder with the same content."""

import numpy as np
import pandas
import pytest
from recordings import NOMINAL, a_camera, a_joint

from vision_s2r.errors import UserError
from vision_s2r.recording import from_arrays, from_pictures, from_table, read, write

HEAD = {"nominal": NOMINAL, "sample_time": 0.01}


def same(one, other):
    for name, value in vars(one).items():
        if isinstance(value, np.ndarray):
            np.testing.assert_allclose(getattr(other, name), value, rtol=1e-7, atol=1e-9)
        elif name not in ("names", "real_names"):
            assert getattr(other, name) == value, name


def test_arrays_a_table_and_a_folder_are_one_joint(tmp_path):
    joint = a_joint()
    position, velocity = joint.position.copy(), list(joint.velocity)
    position[1, 60:], velocity[1] = np.nan, velocity[1][:60]  # both ways of saying that an episode is shorter
    arrays = from_arrays(position=position, velocity=velocity, current=joint.command, **HEAD)
    assert arrays.lengths.tolist() == [120, 60, 120] and np.isnan(arrays.velocity[1, 60:]).all()
    folder = write(arrays, tmp_path / "log")
    same(arrays, read(folder))
    frame = pandas.read_csv(folder / "joint.csv")
    same(arrays, from_table(frame, **HEAD))
    same(arrays, from_table(frame.drop(columns="t"), **HEAD))
    one = from_arrays(position=position[0], current=joint.command[0], **HEAD)
    assert len(one) == 1 and one.velocity is None


def test_pictures_and_a_folder_are_one_camera(tmp_path):
    camera = a_camera()
    read_again = read(write(camera, tmp_path / "pictures"))
    whole = {name: np.rint(getattr(camera, name) * 255).astype(np.uint8) for name in ("real", "sim")}
    beside = {"labels": camera.labels, "mask": camera.mask, "intrinsics": camera.intrinsics}
    same(read_again, from_pictures(**whole, **beside))
    same(read_again, from_pictures(camera.real, camera.sim, **beside))
    assert from_pictures(camera.real[..., 0], camera.sim[..., 0]).grey


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"position": np.zeros((2, 90)), "current": np.zeros((1, 90))}, "current and position are of different length"),
        ({"position": np.zeros(200), "curent": np.zeros(200)}, "unknown column 'curent', did you mean 'current'"),
        ({"position": np.zeros(200)}, "missing column current"),
        ({"position": np.zeros(50), "current": np.zeros(50)}, "50 samples are too short"),
        ({"position": "text", "current": np.zeros(50)}, "position is no array of numbers"),
        ({"position": np.zeros(200), "current": np.full(200, np.inf)}, "arrays, line 0: current is inf"),
    ],
)
def test_what_is_wrong_with_arrays_is_one_line(columns, message):
    with pytest.raises(UserError, match=message):
        from_arrays(**columns, **HEAD)


def test_what_is_wrong_with_pictures_is_one_line():
    fine = np.zeros((4, 20, 24, 3), np.uint8)
    for real, sim, message in (
        (fine[:3], fine, "at least 4 pictures"),
        (fine, fine[:, :16], "pictures of one size"),
        (fine, fine.astype(np.float32) + 255, "numbers from 0 to 1"),
        (fine[0], fine, "at least 4 pictures|expected"),
    ):
        with pytest.raises(UserError, match=message):
            from_pictures(real, sim)
