"""What the pages' code finds: a folder with small recordings, renders and checkpoints."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import world

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.joint import JOINT_EFFECTS

sys.path.append(str(Path(__file__).resolve().parents[2] / "docs" / "hooks"))


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return world.make(tmp_path_factory.mktemp("world"))


@pytest.fixture
def worked(made: Path) -> Iterator[Path]:
    """The folder; effects that a page registers are gone afterwards."""
    before = [(registry, dict(registry._effects)) for registry in (CAMERA_EFFECTS, JOINT_EFFECTS)]
    yield made
    for registry, effects in before:
        registry._effects.clear()
        registry._effects.update(effects)
