"""Whatever stands in the files: a recording, or one line that says what is wrong. Never another exception."""

import tempfile
import warnings
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings import a_camera, a_contact, a_joint

from vision_s2r.contact import mesh
from vision_s2r.errors import UserError
from vision_s2r.recording import CameraRecording, ContactRecording, JointRecording, read, write

FUZZ = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))

FEW = settings(FUZZ, max_examples=60)

JOINT_KEYS = ("kind", "sample_time", "units", "nominal", "  inertia")
CAMERA_KEYS = ("kind", "pairing", "camera", "  fx", "  width")

_CELLS = st.one_of(
    st.sampled_from(
        ["", "nan", "inf", "-1e400", "1e308", "0x1", "1_0", '"1"', "1;2", "\0", "é", "0", "0.01", "-0.0", "#"]
    ),
    st.floats().map(str),
    st.integers().map(str),
)
_TABLES = st.lists(st.lists(_CELLS, max_size=6).map(",".join), max_size=40).map("\n".join)
_SCALARS = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)).map(repr)
_YAMLISH = st.one_of(
    st.text(max_size=80),
    st.sampled_from(
        ["[" * 1200, "{" * 1200, "&a [*a]", "!!python/object:os.system x", "? [a]\n: b", "a: *b", "2001-99-99"]
    ),
    _SCALARS,
)


def outcome(folder: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            recording = read(folder, hold_out=False)
        except UserError as error:
            assert str(error) and "\n" not in str(error)
            return
    if isinstance(recording, JointRecording | ContactRecording):
        for k, length in enumerate(recording.lengths):
            assert length > 1 and np.isfinite(recording.position[k, :length]).all()
    else:
        assert isinstance(recording, CameraRecording) and np.isfinite(recording.real).all()


def spoilt(name: str, content: bytes, joint: bool = True) -> None:
    with tempfile.TemporaryDirectory() as folder:
        write(a_joint(samples=12) if joint else a_camera(frames=2), folder)
        (Path(folder) / name).write_bytes(content)
        outcome(Path(folder))


@FUZZ
@given(st.binary(max_size=300))
def test_any_bytes_for_a_table(content):
    spoilt("joint.csv", content)


@FUZZ
@given(_TABLES)
def test_any_cells_in_a_table(body):
    spoilt("joint.csv", f"episode,t,current,position,velocity\n{body}".encode())


@FUZZ
@given(st.lists(st.tuples(st.integers(0, 36), st.integers(0, 4), _CELLS), min_size=1, max_size=4))
def test_any_change_to_a_table_that_is_right(changes):
    with tempfile.TemporaryDirectory() as folder:
        path = write(a_joint(samples=12), folder) / "joint.csv"
        rows = [row.split(",") for row in path.read_text().splitlines()]
        for row, column, cell in changes:
            rows[row][column] = cell
        path.write_text("\n".join(map(",".join, rows)))
        outcome(Path(folder))


@FUZZ
@given(st.one_of(st.binary(max_size=200), _YAMLISH.map(lambda text: text.encode("utf-8", "surrogatepass"))))
def test_any_bytes_for_a_header(content):
    spoilt("recording.yaml", content)


@FUZZ
@given(
    st.sampled_from([(True, key) for key in JOINT_KEYS] + [(False, key) for key in CAMERA_KEYS]),
    _YAMLISH,
)
def test_any_value_of_a_key(which, value):
    joint, key = which
    with tempfile.TemporaryDirectory() as folder:
        path = write(a_joint(samples=12) if joint else a_camera(frames=2), folder) / "recording.yaml"
        rows = [row if row.split(":")[0] != key else f"{key}: {value}" for row in path.read_text().splitlines()]
        path.write_bytes("\n".join(rows).encode("utf-8", "surrogatepass"))
        outcome(Path(folder))


@FUZZ
@given(st.data())
def test_any_damage_to_a_picture(data):
    with tempfile.TemporaryDirectory() as folder:
        path = write(a_camera(frames=2), folder) / "real" / "0000.png"
        content = bytearray(path.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
        path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
        outcome(Path(folder))


@FEW
@given(st.lists(st.tuples(st.integers(0, 48), st.integers(0, 14), _CELLS), min_size=1, max_size=4))
def test_any_change_to_a_contact_table_that_is_right(changes):
    with tempfile.TemporaryDirectory() as folder:
        path = write(a_contact(samples=12), folder) / "contact.csv"
        rows = [row.split(",") for row in path.read_text().splitlines()]
        for row, column, cell in changes:
            rows[row][column] = cell
        path.write_text("\n".join(map(",".join, rows)))
        outcome(Path(folder))


@FEW
@given(st.sampled_from(["  shape", "  half_extents", "  mass", "  restitution", "  gravity", "nominal"]), _YAMLISH)
def test_any_value_of_a_contact_key(key, value):
    with tempfile.TemporaryDirectory() as folder:
        path = write(a_contact(samples=12), folder) / "recording.yaml"
        rows = [row if row.split(":")[0] != key else f"{key}: {value}" for row in path.read_text().splitlines()]
        path.write_bytes("\n".join(rows).encode("utf-8", "surrogatepass"))
        outcome(Path(folder))


@FEW
@given(
    st.one_of(
        st.text(max_size=120),
        st.lists(st.sampled_from(["v", "f", "1", "-1", "0.1", "nan", "\n", "v 0 0 1\n", "f 1 2 3\n", "1/2"])).map(
            " ".join
        ),
    )
)
def test_any_mesh(text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "body.obj"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        try:
            mesh(path)
        except UserError as error:
            assert str(error) and "\n" not in str(error)
