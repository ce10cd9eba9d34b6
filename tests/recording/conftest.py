"""Folders of recordings that are right, for tests to spoil."""

from pathlib import Path

import pytest
from recordings import a_camera, a_joint

from vision_s2r.recording import write


@pytest.fixture
def joint_folder(tmp_path: Path) -> Path:
    return write(a_joint(), tmp_path / "joint")


@pytest.fixture
def camera_folder(tmp_path: Path) -> Path:
    return write(a_camera(), tmp_path / "camera")
