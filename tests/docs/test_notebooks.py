"""The notebooks run as they stand."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
SLOW = {"train_with_your_camera": pytest.mark.slow}
NOTEBOOKS = [pytest.param(path, id=path.stem, marks=SLOW.get(path.stem, ())) for path in sorted(FOLDER.glob("*.ipynb"))]


@pytest.mark.parametrize("path", NOTEBOOKS)
def test_a_notebook_runs(path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    NotebookClient(
        nbformat.read(path, as_version=4), timeout=240, resources={"metadata": {"path": path.parent}}
    ).execute()
