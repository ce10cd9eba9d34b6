"""Photographs become recordings of a camera: a board beside its ideal, a bench beside its renders."""

import json

import cv2
import numpy as np
import pytest
from PIL import Image

from vision_s2r.commands.main import run
from vision_s2r.commands.table import COMMANDS
from vision_s2r.errors import UserError
from vision_s2r.imports import chessboard, import_chessboard, import_images
from vision_s2r.recording import read

WIDTH, HEIGHT, FOCAL = 320, 240, 260.0
MATRIX = np.array([[FOCAL, 0, 162.0], [0, FOCAL, 118.0], [0, 0, 1]])
LENS = np.array([-0.3, 0.08, 0, 0, 0])
POSES = [(0.0, 0.0, 0.1), (0.4, 0.1, -0.2), (-0.4, 0.2, 0.0), (0.1, 0.5, 0.2), (0.1, -0.5, -0.1), (0.3, 0.3, 0.4)]


def board(rotation, lens, brightness=1.0):
    """A photograph of a board of 7 x 5 inner corners, by tracing each pixel's ray."""
    x, y = np.meshgrid(np.arange(0, WIDTH, 0.5) - 0.25, np.arange(0, HEIGHT, 0.5) - 0.25)
    rays = cv2.undistortPoints(np.stack([x.ravel(), y.ravel()], 1)[:, None], MATRIX, lens).reshape(-1, 2)
    turned, _ = cv2.Rodrigues(np.array(rotation, float))
    centre = -turned @ np.array([3.0, 2.0, 0.0]) + [0.0, 0.0, 9.0]
    u, v, w = np.linalg.inv(np.c_[turned[:, :2], centre]) @ np.c_[rays, np.ones(len(rays))].T
    u, v = u / w, v / w
    inside = (u > -0.6) & (u < 6.6) & (v > -0.6) & (v < 4.6)  # the outer squares are cut
    value = np.where(inside, np.where((np.floor(u) + np.floor(v)) % 2 > 0, 30, 220), 200).reshape(x.shape)
    picture = cv2.resize(value.astype(np.float32), (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    return np.rint((picture * brightness).clip(0, 255)).astype(np.uint8)


@pytest.fixture
def photographs(tmp_path):
    folder = tmp_path / "photographs"
    folder.mkdir()
    for k, pose in enumerate(POSES):
        cv2.imwrite(str(folder / f"shot{k}.jpg"), board(pose, LENS, 1 - 0.03 * k), [cv2.IMWRITE_JPEG_QUALITY, 95])
    return folder


def test_a_calibration_set_becomes_pairs_without_the_lens(photographs, tmp_path, capsys):
    cv2.imwrite(str(photographs / "wall.jpg"), np.full((HEIGHT, WIDTH), 128, np.uint8))
    run(COMMANDS["import"], ["chessboard", str(photographs), "inner=[7,5]", f"out={tmp_path / 'board'}"])
    assert "left out: wall.jpg" in capsys.readouterr().out
    recording = read(tmp_path / "board")
    assert recording.pairing == "paired" and len(recording) == len(POSES) and recording.mask is not None
    assert recording.intrinsics == pytest.approx([FOCAL, FOCAL, 162, 118], rel=0.02)
    found = json.loads((tmp_path / "board" / "import.json").read_text())
    assert found["calibration"]["k1"] == pytest.approx(-0.3, abs=0.05) and found["rms_px"] < 0.2
    # Bytes are those of the camera's files.
    assert (tmp_path / "board/real/shot0.jpg").read_bytes() == (photographs / "shot0.jpg").read_bytes()
    # The pinhole's picture is the same board as if the camera had no lens.
    ideal = board(POSES[1], np.zeros(5)).astype(float)
    where = recording.mask[1]
    dark, rendered, seen = (
        each[where] < 115 for each in (ideal, *(255 * p[1, ..., 0] for p in (recording.sim, recording.real)))
    )
    assert where.mean() > 0.1 and (rendered != dark).mean() < 0.02
    assert (seen != dark).mean() > 3 * (rendered != dark).mean()


def test_a_part_of_a_board_that_more_small_pictures_show_is_not_taken_for_it(photographs, monkeypatch):
    whole = chessboard._corners

    def of_small_pictures(photograph, size):
        if size == (6, 5):
            return np.zeros((30, 2))
        return None if photograph.path.name == "shot0.jpg" else whole(photograph, size)

    monkeypatch.setattr(chessboard, "_corners", of_small_pictures)
    *_, about = chessboard.load(photographs, [])
    assert about["inner_corners"] == [7, 5] and list(about["left_out"]) == ["shot0.jpg"]


def test_what_is_no_board_is_said(tmp_path):
    for k in range(4):
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.full((HEIGHT, WIDTH), 128, np.uint8))
    with pytest.raises(UserError, match="0 of 4 photographs show a whole board"):
        import_chessboard(tmp_path, tmp_path / "out", [9, 6])
    with pytest.raises(UserError, match="expected two numbers of inner corners"):
        import_chessboard(tmp_path, tmp_path / "out", [9])
    assert not (tmp_path / "out").exists()


def bench(folder, names, size, seed=0):
    folder.mkdir()
    pictures = np.random.default_rng(seed).integers(0, 255, (len(names), *size[::-1], 3)).astype(np.uint8)
    for picture, name in zip(pictures, names, strict=True):
        exif = Image.Exif()
        exif.get_ifd(0x8769).update({0xA405: 28, 0x829A: 0.01 * (1 + len(name) % 2), 0x829D: 2.0, 0x8827: 100})
        Image.fromarray(picture).save(folder / name, exif=exif)
    return folder


def test_a_bench_is_paired_by_names_aligned_and_its_exif_read(tmp_path, capsys):
    real = bench(tmp_path / "real", ["a.jpg", "bb.jpg", "ccc.jpg", "dddd.jpg"], (80, 60))
    sim = bench(tmp_path / "sim", ["a.png", "bb.png", "ccc.png", "dddd.png"], (40, 30))
    run(COMMANDS["import"], ["images", f"real={real}", f"sim={sim}", f"out={tmp_path / 'out'}"])
    said = capsys.readouterr().out
    assert "paired by their names" in said and "averaged down" in said and "exposures differ by 1.0 EV" in said
    recording = read(tmp_path / "out")
    assert recording.pairing == "paired" and recording.real.shape == (4, 30, 40, 3)
    assert recording.intrinsics[0] == pytest.approx(28 / 36 * 40)


def test_other_names_are_two_sets_unless_said(tmp_path):
    real = bench(tmp_path / "real", [f"x{k}.png" for k in range(4)], (40, 30))
    sim = bench(tmp_path / "sim", [f"y{k}.png" for k in range(4)], (40, 30))
    assert import_images(real, sim, tmp_path / "sets", "").summary["pairing"] == "unpaired"
    assert import_images(real, sim, tmp_path / "pairs", "paired").summary["pairing"] == "paired"
    crooked = bench(tmp_path / "crooked", ["x0.png"], (40, 40))
    with pytest.raises(UserError, match="the same proportions"):
        import_images(real, crooked, tmp_path / "no", "")
