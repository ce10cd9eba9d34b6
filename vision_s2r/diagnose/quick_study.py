"""Whole diagnoses beside quick ones: what each names, and how long it takes.

    python -m vision_s2r.diagnose.quick_study OUT RECORDING...

writes OUT/quick.json, a table by kind of recording.
"""

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.files import write
from vision_s2r.recording import Recording, read
from vision_s2r.statistics import interval, wilson


@dataclass(frozen=True)
class Pair:
    """One recording, diagnosed both ways: verdicts with names, and seconds of processor time."""

    kind: str
    said: tuple[Any, Any]  # whole, quick
    seconds: tuple[float, float]


def study(out: Path | str, folders: Sequence[Path | str]) -> dict[str, Any]:
    """What the module writes; returns the table."""
    recordings = [read(folder) for folder in folders]
    if recordings:
        diagnose(recordings[0], DiagnoseConfig(quick=True))  # compiles, and fills caches
    pairs = [_pair(each) for each in recordings]
    rows = [_row(kind, [pair for pair in pairs if pair.kind == kind]) for kind in sorted({p.kind for p in pairs})]
    table = {
        "command": "python -m vision_s2r.diagnose.quick_study OUT RECORDING...",
        "source": "recordings of gapbench; seconds of processor time, the mean over recordings, one thread",
        "columns": ["recordings", "the same names and verdict", "whole, s", "quick, s", "quick ÷ whole"],
        "rows": rows,
    }
    write(Path(out) / "quick.json", json.dumps(table, indent=1, ensure_ascii=False) + "\n")
    return table


def _pair(recording: Recording) -> Pair:
    said, seconds = [], []
    for quick in (False, True):
        start = time.process_time()
        report = diagnose(recording, DiagnoseConfig(quick=quick))
        seconds.append(time.process_time() - start)
        said.append((report.verdict, sorted(effect.name for effect in report.effects)))
    return Pair(recording.kind, (said[0], said[1]), (seconds[0], seconds[1]))


def _row(kind: str, pairs: Sequence[Pair]) -> list[Any]:
    same = wilson(sum(pair.said[0] == pair.said[1] for pair in pairs), len(pairs))
    share = {"value": same.value, "low": same.low, "high": same.high}
    seconds = np.array([pair.seconds for pair in pairs])  # [N, 2]
    return [
        kind,
        {key: round(100 * value, 1) for key, value in share.items()} | {"unit": "%", "of": len(pairs)},
        *map(_mean, seconds.T),
        _cell(lambda counts: counts @ seconds[:, 1] / (counts @ seconds[:, 0]), len(pairs)),
    ]


def _mean(values: np.ndarray) -> dict[str, Any]:
    return _cell(lambda counts: counts @ values / counts.sum(axis=1), len(values))


def _cell(statistic: Callable[[np.ndarray], np.ndarray], count: int) -> dict[str, Any]:
    """A figure with its 95 % interval, by bootstrap over recordings."""
    low, high = interval(statistic, count, 0)
    value = float(statistic(np.ones((1, count)))[0])
    return {"value": round(value, 2), "low": round(low, 2), "high": round(high, 2), "unit": "", "of": count}


if __name__ == "__main__":
    print(json.dumps(study(sys.argv[1], sys.argv[2:]), indent=1, ensure_ascii=False))
