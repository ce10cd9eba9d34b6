"""The gap of an arm's tip: how large it is, and whose."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from vision_s2r.fit.arm.free_run import free_run, of_whole, tip_errors
from vision_s2r.fit.case import Values
from vision_s2r.fit.gap import Gap
from vision_s2r.recording import ArmRecording
from vision_s2r.statistics import shapley

ROWS = 2000  # of a recording, for shares
PLAYERS, OTHERS = 4, "others"  # that shares are told apart of, and the rest of them
STRETCHES = 20  # into which its rows are cut, for intervals


def tip_gap(recording: ArmRecording, whole: Values, before: np.ndarray, after: np.ndarray) -> dict[str, Any] | None:
    """How far the tip is off (mm, root mean square), before and after; None where the tip is not known.

    Of free runs [E, T, J, 2] of the simulator as it came and of the one that was found.
    """
    far = [tip_errors(recording, whole, states) for states in (before, after)]
    if far[0] is None or far[1] is None:
        return None
    one, two = (float(1e3 * np.sqrt(np.nanmean(each**2))) for each in far if each is not None)
    return {"unit": "mm", "before": one, "after": two}


def tip_shares(recording: ArmRecording, effects: Values, seed: int) -> list[dict[str, Any]]:
    """What each joint's effects, and those of the whole arm, close of the tip's squared gap, the largest share first.

    Shapley's values over free runs of the first rows with any of them; those of little effect count as one.
    """
    some = _shortened(recording)
    whole = of_whole(effects)
    of: dict[str, dict[str, Mapping[str, float]]] = {}
    for name, values in effects.items():
        of.setdefault(name.rpartition(".")[0] or name, {})[name] = values

    @cache
    def error(on: frozenset[str]) -> np.ndarray:
        with_these = {name: values for each in on for name, values in of[each].items()}
        far = tip_errors(some, whole, free_run(some, with_these))
        assert far is not None
        squares = far[np.isfinite(far)] ** 2
        return np.array([part.mean() for part in np.array_split(squares, STRETCHES)])

    ranked = sorted(of, key=lambda each: error(frozenset({each})).mean())
    if len(ranked) > PLAYERS:
        slight = ranked[PLAYERS - 1 :]
        of[OTHERS] = {name: values for each in slight for name, values in of[each].items()}
        ranked = [*ranked[: PLAYERS - 1], OTHERS]
    before, after = error(frozenset()), error(frozenset(ranked))
    gap = Gap(before, before, after, np.zeros(STRETCHES), seed)
    parts = shapley(ranked, lambda on: -error(on))
    shares = {name: gap.share(part) for name, part in parts.items()}
    found = [{"of": name, "share": share.value, "ci": list(share.ci)} for name, share in shares.items()]
    return sorted(found, key=lambda each: -each["share"])


def _shortened(recording: ArmRecording) -> ArmRecording:
    """The first rows of each episode, ROWS in all."""
    rows = max(ROWS // len(recording.any.lengths), 1)
    joints = {name: replace(each, lengths=np.minimum(each.lengths, rows)) for name, each in recording.joints.items()}
    return replace(recording, joints=joints)
