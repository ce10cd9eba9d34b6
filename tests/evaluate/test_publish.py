"""What pages of results are made of."""

import json

import pytest

from vision_s2r.errors import UserError
from vision_s2r.evaluate.publish import publish

PAIR = {"column": "webcam", "first": "rcan", "second": "oracle", "p": None}
TABLE = {
    "format": "vision-s2r/transfer-table/1",
    "seed": 0,
    "scenes": {"count": 10, "render": {"seed": 2}},
    "columns": [{"name": "webcam", "appearance": "real"}],
    "cells": [{"row": "rcan", "column": "webcam", "seed": "all", "successes": 9, "attempts": 10, "rate": 0.9}],
    "differences": [PAIR | {"value": -0.1, "low": -0.3, "high": 0.0}],
    "ratios": [PAIR | {"value": 0.9, "low": 0.7, "high": None}],
    "checkpoints": {"rcan": [{"policy": {"training": {"step": 3}, "configuration": {"long": 1}}}]},
    "versions": {},
}


def test_a_table_and_its_comparisons_are_kept(tmp_path):
    (tmp_path / "table.json").write_text(json.dumps(TABLE))
    table, compared = (json.loads(p.read_text()) for p in publish(tmp_path / "table.json", tmp_path / "run", "make it"))
    assert table["cells"] == TABLE["cells"] and table["command"] == "make it"
    assert table["training"] == {"rcan": [{"policy": {"step": 3}}]} and "long" not in json.dumps(table)
    assert compared["columns"] == ["", "webcam"]
    assert compared["rows"] == [
        ["rcan − oracle, points", {"value": -10.0, "low": -30.0, "high": 0.0}],
        ["rcan / oracle, %", "–"],
    ]
    (tmp_path / "table.json").write_text("{}")
    with pytest.raises(UserError, match="no transfer table"):
        publish(tmp_path / "table.json", tmp_path / "run", "make it")
