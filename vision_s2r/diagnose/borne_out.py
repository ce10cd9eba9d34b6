"""Which effects of an arm's joints the free run of the whole arm bears out.

A joint is searched under loads that are partly measured: what is wrong or noisy in them may get a name. The arm's own
free run knows nothing but commands, and stretches that no fit has seen tell.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from vision_s2r import parallel
from vision_s2r.fit.arm.drives import TWO_MASSES
from vision_s2r.fit.arm.free_run import FreeRuns, by_stretch, gap_errors, tip_errors
from vision_s2r.statistics import interval

HARM = 0.01  # of the tip's mean squared error: a tip that a joint hardly moves is surely further off by nanometres


@dataclass(frozen=True)
class _StretchErrors:
    """Mean squared errors of a held-out free run, by stretches."""

    joints: dict[str, np.ndarray]  # [S] rad² or m²
    tip: np.ndarray | None  # [S] m²


def idle(
    runs: FreeRuns,
    held_out: Mapping[str, Any],
    names: Collection[str],
    least: Mapping[str, float],
    seed: int,
    jobs: int = 1,
) -> frozenset[str]:
    """Of `names` (JOINT.EFFECT), those without which the arm runs as well; by so many threads.

    Such a name does not lower its joint's held-out mean squared error by `least` (rad² or m², by joint), its interval
    above zero; or it makes that of the tip larger, by more than its interval and a hundredth. The one that brings least
    goes first; what was needed beside it is asked again once no other goes. Named or not, what makes the arm run away
    goes before.
    """
    gone = _running_away(runs, held_out)
    asked = left = frozenset(names) - gone
    while True:
        gains = _of_no_use(runs, held_out, gone, asked, least, seed, jobs)
        if gains:
            least_of_all = min(gains, key=lambda name: (gains[name], name))
            gone, left, asked = gone | {least_of_all}, left - {least_of_all}, frozenset(gains) - {least_of_all}
        elif asked == left:
            return gone
        else:
            asked = left


def _of_no_use(
    runs: FreeRuns,
    held_out: Mapping[str, Any],
    gone: frozenset[str],
    names: Collection[str],
    least: Mapping[str, float],
    seed: int,
    jobs: int,
) -> dict[str, float]:
    """Those of the names without which an arm without others runs as well, and how much each brings."""
    ordered, gains = sorted(names), {}
    sets = ((runs, held_out, each) for each in (gone, *(gone | {name} for name in ordered)))
    now, *others = parallel.run(_errors, sets, jobs, threads=True)
    for name, without in zip(ordered, others, strict=True):
        joint = name.rpartition(".")[0]
        relief = without.joints[joint] - now.joints[joint]
        harm = None if now.tip is None or without.tip is None else now.tip - (1 + HARM) * without.tip
        if relief.mean() <= least[joint] or _low(relief, seed) <= 0 or (harm is not None and _low(harm, seed) > 0):
            gains[name] = float(relief.mean() / least[joint])
    return gains


def _running_away(runs: FreeRuns, held_out: Mapping[str, Any]) -> frozenset[str]:
    """Effects with which the arm has no motion: none, or those of joints in two halves, the fewest.

    Where a half is less than a joint's bodies have, all joints together may have no positive inertia.
    """
    keys = {key for fold in held_out["folds"] for key in fold}
    halves = sorted(key for key in keys if key.rpartition(".")[2] in TWO_MASSES)
    for count in range(len(halves) + 1):
        for gone in map(frozenset, combinations(halves, count)):
            if all(np.isfinite(errors).all() for errors in _errors(runs, held_out, gone).joints.values()):
                return gone
    return frozenset(halves)


def _errors(runs: FreeRuns, held_out: Mapping[str, Any], gone: frozenset[str]) -> _StretchErrors:
    """Of a free run without the effects that are gone."""
    folds = [{name: given for name, given in fold.items() if name not in gone} for fold in held_out["folds"]]
    states = runs.held_out({**held_out, "folds": folds})
    recording = runs.recording
    joints = by_stretch(recording, gap_errors(recording, states), held_out)
    far = tip_errors(recording, {}, states)
    tip = None if far is None else by_stretch(recording, far[..., None] ** 2, held_out)[:, 0]
    return _StretchErrors(dict(zip(recording.joints, joints.T, strict=True)), tip)


def _low(values: np.ndarray, seed: int) -> float:
    """The lower end of the interval of a mean over stretches."""
    return interval(lambda counts: counts @ values / len(values), len(values), seed)[0]
