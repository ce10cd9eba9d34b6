"""Camera recordings: what is right comes back as it was, what is wrong is one line that says so."""

import cv2
import numpy as np
import pytest
from recordings import a_camera, refused

from vision_s2r.recording import read, split, write


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("grey", [False, True])
def test_it_comes_back_as_it_was_written(tmp_path, bits, grey):
    one = a_camera(bits, grey)
    again = read(write(one, tmp_path / "out"))
    assert again.bits == bits and again.grey == grey and again.names == one.names == again.real_names
    for name in ("sim", "real", "labels", "mask", "intrinsics"):
        np.testing.assert_allclose(getattr(again, name), getattr(one, name), atol=1e-7)
    some = split(again, [2, 0])
    np.testing.assert_array_equal(some.sim[1], again.sim[0])
    assert some.names == ("0002", "0000") and len(some.mask) == 2


def test_a_render_of_8_bit_goes_with_a_sensor_of_16(camera_folder, tmp_path):
    deep = write(a_camera(16), tmp_path / "deep")
    (camera_folder / "sim").rename(tmp_path / "away")
    (deep / "real").rename(tmp_path / "real")
    for path in (camera_folder / "real").iterdir():
        path.unlink()
    (camera_folder / "real").rmdir()
    (tmp_path / "real").rename(camera_folder / "real")
    (tmp_path / "away").rename(camera_folder / "sim")
    recording = read(camera_folder)
    assert recording.bits == 16
    np.testing.assert_allclose(recording.real, a_camera(16).real, atol=1e-7)


def test_sets_of_pictures_need_not_match(camera_folder):
    header = camera_folder / "recording.yaml"
    header.write_text(header.read_text().replace("pairing: paired", "pairing: unpaired"))
    for path in sorted((camera_folder / "real").iterdir()):
        path.rename(path.with_name(f"x{path.name}"))
    picture = cv2.imread(str(camera_folder / "real" / "x0000.png"))
    cv2.imwrite(str(camera_folder / "real" / "y.jpg"), picture)
    recording = read(camera_folder)
    assert (len(recording.sim), len(recording.real), recording.real_names[-1]) == (4, 5, "y")
    assert len(split(recording, [0]).sim) == 4


def _replace(picture):
    def spoil(folder):
        cv2.imwrite(str(folder / "real" / "0002.png"), picture)

    return spoil


def _bytes(path, content):
    def spoil(folder):
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).write_bytes(content)

    return spoil


def _header(old, new):
    def spoil(folder):
        path = folder / "recording.yaml"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    return spoil


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: (folder / "real" / "0002.png").unlink(), r"sim/0002\.png: no picture of this name in real/"),
        (lambda folder: (folder / "sim" / "0002.png").unlink(), r"real/0002\.png: no picture of this name in sim/"),
        (lambda folder: (folder / "mask" / "0002.png").unlink(), r"sim/0002\.png: no picture of this name in mask/"),
        (_replace(np.zeros((20, 25, 3), np.uint8)), r"0002\.png: height and width \(20, 25\), but \(20, 24\)"),
        (_replace(np.zeros((20, 24, 3), np.uint16)), r"0002\.png: bits 16, but 8"),
        (_replace(np.zeros((20, 24), np.uint8)), r"0002\.png: channels 1, but 3"),
        (_replace(np.zeros((20, 24, 4), np.uint8)), r"0002\.png: partly transparent"),
        (_bytes("real/0001.png", b""), r"0001\.png: cannot be decoded"),
        (_bytes("real/0001.png", b"\x89PNG\r\n\x1a\nnothing"), r"0001\.png: cannot be decoded"),
        (_bytes("real/notes.txt", b""), r"notes\.txt: expected only files ending in \.png"),
        (_bytes("real/0001.jpg", b""), r"0001\.png: there is 0001\.jpg too"),
        (_bytes("sim/0009.jpg", b""), r"0009\.jpg: expected only files ending in \.png"),
        (_header("pairing: paired", "pairing: piared"), "did you mean 'paired'"),
        (_header("encoding: srgb", "encodign: srgb"), "unknown key 'encodign', did you mean 'encoding'"),
        (_header("encoding: srgb", "label_names: {table: 1}"), "'table' is no label, expected numbers from 0 to 255"),
        (_header("encoding: srgb", "label_names: {1: []}"), "1 has no name, expected a word or a few"),
        (_header("width: 24", "width: 128"), "width is 128, but pictures have 24 px"),
        (_header("  fx: 30.0\n", ""), "camera: missing fx"),
        (_header("fx: 30.0", "fx: 0"), "fx is '0', expected a number above 0"),
    ],
)
def test_what_is_wrong_is_named(camera_folder, spoil, message):
    read(camera_folder)
    spoil(camera_folder)
    refused(camera_folder, message)


def test_sizes_of_the_two_sets_must_match(camera_folder):
    for path in (camera_folder / "real").iterdir():
        cv2.imwrite(str(path), np.zeros((24, 24, 3), np.uint8))
    refused(camera_folder, "24 x 20 px, expected 24 x 24 px like those of real/")


def test_too_few_pictures_and_empty_folders(camera_folder, tmp_path):
    for name in ("real", "sim", "labels", "mask"):
        for path in sorted((camera_folder / name).iterdir())[1:]:
            path.unlink()
    refused(camera_folder, "too few to hold any out, expected 4")
    assert len(read(camera_folder, hold_out=False)) == 1
    (camera_folder / "real" / "0000.png").unlink()
    refused(camera_folder, "real: an empty folder", hold_out=False)
    (camera_folder / "real").rmdir()
    refused(camera_folder, "real: no such folder", hold_out=False)
