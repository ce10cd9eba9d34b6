"""A few machines of each kind, diagnosed: a kind that nobody counts for days loses nothing unseen."""

import json

import pytest

from vision_s2r.cli import compose
from vision_s2r.gapbench.bench import bench
from vision_s2r.gapbench.config import COUNTS, GapbenchConfig

SEEDS = {  # of sets to tune on, of which the first machines are right
    "joint": 9191,
    "servo": 9331,
    "camera": 7821,
    "unpaired": 9611,
    "contact": 8121,
    "arm": 9221,
    "appearance": 9321,
}
EACH = {"null": 1, "single": 6, "pair": 3}
BESIDE_UNKNOWN = {"joint": 2, "camera": 2}
WRONG = 1  # by rounding, on another processor


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("kind", SEEDS)
def test_what_was_right_still_is(kind, tmp_path):
    counts = dict.fromkeys(COUNTS, 0) | EACH | {"known_unknown": BESIDE_UNKNOWN.get(kind, 0)}
    given = [f"counts.{case}={count}" for case, count in counts.items()]
    bench(compose(GapbenchConfig, "gapbench", [f"kind={kind}", f"seed={SEEDS[kind]}", f"out={tmp_path}", *given]))
    scores = json.loads((tmp_path / "results.json").read_text())["recordings"]
    wrong = [f"{each['case']}: {each['expected']} → {each['named']}" for each in scores if not each["exact"]]
    assert len(scores) == sum(counts.values()) and len(wrong) <= WRONG, wrong
