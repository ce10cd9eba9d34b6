"""The checks of reliability find what they are to find."""

import json
import os
from pathlib import Path

import pytest

from vision_s2r.errors import UserError
from vision_s2r.reliability import ReliabilityConfig, reliability
from vision_s2r.reliability.accidents import Accident, accidents, filled, killed
from vision_s2r.reliability.fuzz import READERS
from vision_s2r.reliability.fuzz import fuzz as spoil
from vision_s2r.reliability.samples import Reader


def test_a_reader_that_breaks_is_found_with_the_input_that_broke_it(tmp_path, monkeypatch):
    def careless(folder: Path) -> None:
        text = (folder / "a.json").read_text(errors="replace")
        if '"' not in text:
            raise UserError("no quotes in it")
        json.loads(text)

    def make(folder: Path) -> None:
        (folder / "a.json").write_text('{"a": {"b": [1, 2]}}')

    monkeypatch.setitem(READERS, "careless", Reader(make, careless))
    found = spoil("careless", 60, 0, tmp_path / "found.json")
    assert found["outcomes"]["traceback"] > 5 and found["outcomes"]["result"] > 5 and found["outcomes"]["line"] > 0
    assert any("JSONDecodeError" in why for why in found["failures"])
    assert spoil("careless", 30, 0, tmp_path / "again.json")["inputs"] == 30
    assert spoil("careless", 60, 0, tmp_path / "again.json") == found  # goes on to the same


def test_a_reader_that_runs_code_is_found(tmp_path, monkeypatch):
    import pickle

    def make(folder: Path) -> None:
        (folder / "a.bin").write_bytes(pickle.dumps({"step": 1}))

    monkeypatch.setitem(READERS, "unsafe", Reader(make, lambda folder: pickle.loads((folder / "a.bin").read_bytes())))
    assert spoil("unsafe", 60, 0, tmp_path / "found.json")["outcomes"]["code"] > 0


def test_no_reader_of_ours_breaks(tmp_path):
    quick = [name for name, reader in READERS.items() if reader.slow == 1 and name != "data set of LeRobot"]
    (table,) = reliability(ReliabilityConfig(["fuzz"], inputs=25, readers=quick, seed=11, out=str(tmp_path)))
    for name, inputs, result, line, *worse in json.loads(table.read_text())["rows"]:
        assert result + line == inputs == 25 and not any(worse), name
    with pytest.raises(UserError, match="readers: nothing is called 'reprt', did you mean 'report'"):
        reliability(ReliabilityConfig(readers=["reprt"], out=str(tmp_path)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "accident", "other"),
    [
        ("gapbench by 2 workers", killed, "no workers left"),
        ("translate", killed, "no workers left"),
        pytest.param(
            *("translate", filled, "one line"),
            marks=pytest.mark.skipif(os.geteuid() != 0, reason="only root makes small disks"),
        ),
    ],
)
def test_a_command_goes_on_to_the_same_result(tmp_path: Path, command: str, accident: Accident, other: str) -> None:
    found = accidents(command, accident, 2, 0, tmp_path / "found.json")
    assert found["identical"] == found[other] == found["times"] == 2
    assert json.loads((tmp_path / "found.json").read_text()) == found
