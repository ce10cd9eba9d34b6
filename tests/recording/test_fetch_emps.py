"""The real axis, fetched: what is made of the published files is the recording that tests know by its checksum."""

import hashlib
import io

import numpy as np
import pytest
from data.fetch_emps import PARTS, joint_csv
from recordings import EMPS, needs_emps
from scipy.io import savemat

GAIN = 35.15


def published(rows: np.ndarray) -> bytes:
    """A file as the authors have it, of rows t, force, position."""
    file = io.BytesIO()
    t, force, position = rows.T[:, :, None]
    savemat(file, {"t": t, "vir": force / GAIN, "qm": position, "gtau": GAIN})
    return file.getvalue()


def test_columns_are_time_force_and_position():
    text = joint_csv(published(np.array([[0.0, 89.234432, 7.45e-06], [0.0010000241, -3.0, 0.25]])))
    assert text == "episode,t,force,position\n0,0,89.234432,7.45e-06\n0,0.0010000241,-3,0.25\n"


@needs_emps
@pytest.mark.parametrize("name", PARTS)
def test_checksums_are_those_of_the_recordings(name):
    rows = np.loadtxt(EMPS / name / "joint.csv", delimiter=",", skiprows=1)[:, 1:]
    text = joint_csv(published(rows))
    assert hashlib.sha256(text.encode()).hexdigest() == PARTS[name][1]
