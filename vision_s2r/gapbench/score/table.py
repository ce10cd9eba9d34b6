"""Totals over scores, with 95 % intervals, and the issue's table of goals."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binom
from statsmodels.stats.proportion import proportion_confint

from vision_s2r.gapbench.score.score import Score

NEAR = 0.03  # relative error of a sensor's noise, at most
MASS = 0.05  # relative error of a payload's mass, at most
EXACT = {  # goals of kinds that have their own
    "contact": {"single": 0.95, "pair": 0.85},
    "arm": {"single": 0.90, "pair": 0.80},
    "unpaired": {"single": 0.90, "pair": 0.75},
}


@dataclass(frozen=True)
class Total:
    """A share or a median over `count` cases with its 95 % interval; the goal is a range, None: there is none."""

    name: str
    value: float
    low: float
    high: float
    count: int
    goal: tuple[float, float] | None = None
    percent: bool = True

    @property
    def met(self) -> bool | None:
        """Whether the measured value lies in the goal's range."""
        return None if self.goal is None else self.goal[0] <= self.value <= self.goal[1]


def totals(kind: str, scores: Sequence[Score]) -> list[Total]:
    """Every figure of the table that these scores define, in its order."""
    parameters = [each for score in scores for each in score.parameters if score.case != "known_unknown"]
    sets = kind == "unpaired"
    shrinks = [score.shrink_ratio for score in scores if score.shrink_ratio is not None and score.exact]
    every = [score.shrink_ratio for score in scores if score.shrink_ratio is not None]
    rows = [
        *_exact(kind, scores),
        share_of("source right", (s.source_right for s in scores if s.case != "known_unknown"), (0.99, 1)),
        share_of("location right, where the effect has one", (s.location_right for s in scores)),
        share_of("verdict right", (s.verdict_right for s in scores)),
        median_of(
            "median parameter error", (p.error for p in parameters), (0, 0.05 if kind == "camera" or sets else 0.03)
        ),
        share_of("intervals that cover the truth", (p.covered for p in parameters), (0.90, 0.98)),
        median_of("shrink over the true effect's own", every, (0.95, np.inf)),
        median_of("shrink over the true effect's own, exact sets", shrinks),
        share_of("shrink at least 0.95 of the true effect's own", (ratio >= 0.95 for ratio in every)),
        share_of(
            "false alarm, null and wrong parameters", (s.false_alarm for s in scores), (0, 0.02 if sets else 0.01)
        ),
        *_unknowns(kind, scores),
        *_of_sensors(scores),
        *_of_groups(scores),
        median_of("seconds a recording", (s.seconds for s in scores), (0, 60 if kind == "arm" else 10), percent=False),
        median_of(
            "seconds of a processor a recording",
            (s.processor for s in scores if s.processor is not None),
            percent=False,
        ),
        share_of("failed", (s.failed for s in scores)),
    ]
    return [row for row in rows if row is not None]


def _exact(kind: str, scores: Sequence[Score]) -> list[Total | None]:
    goals = EXACT.get(kind, {"single": 0.97, "pair": 0.90, "triple": 0.75, "all_nominal": 0.90})
    titles = {
        "single": "one effect: exact",
        "pair": "pairs: exact set",
        "whole_pair": "two of what all joints feel: exact set",
        "triple": "triples: exact set",
        "dynamics": "wrong parameters only: exact set",
        "all_nominal": "all parameters 5–25 % off and one effect: exact",
        "known_unknown": "a known and an unknown effect: known one exact",
        "sensor": "a sensor's flat fields: exact",
    }
    rows: list[Total | None] = []
    for case, title in titles.items():
        of_case = [score for score in scores if score.case == case]
        goal = (goals[case], 1.0) if case in goals else None
        rows.append(share_of(title, (s.exact for s in of_case), goal))
        if case in goals:
            rows.append(share_of(f"{title}, or one declared confusable", (s.exact or s.confusable for s in of_case)))
        if case == "single":
            payloads = (s.exact and _mass_error(s) <= MASS for s in of_case if s.expected == ["payload"])
            rows.append(share_of(f"a payload: alone, its mass within {MASS:.0%}", payloads, (0.90, 1.0)))
        if case == "all_nominal":
            rows.append(share_of(f"{title}, effects of the drive alone", (s.drive for s in of_case)))
    return rows


def _of_sensors(scores: Sequence[Score]) -> list[Total | None]:
    """How near to the truth the noise of flat fields is."""
    found = [each for score in scores if score.case == "sensor" for each in score.parameters]
    return [
        share_of(f"a sensor's {name}: within 3 %", (each.error <= NEAR for each in found if each.parameter == key))
        for name, key in (("full well", "full_well"), ("read noise", "sigma"))
    ]


def _of_groups(scores: Sequence[Score]) -> list[Total | None]:
    """One effect, and none, of each group of machines that the table tells apart."""
    rows: list[Total | None] = []
    for group in sorted({score.group for score in scores} - {""}, key=lambda name: (len(name), name)):
        own = [score for score in scores if score.group == group]
        rows.append(share_of(f"{group}, one effect: exact", (s.exact for s in own if s.case == "single")))
        rows.append(share_of(f"{group}, none: no gap", (s.verdict_right for s in own if s.case == "null")))
    return rows


def _mass_error(score: Score) -> float:
    return next((each.error for each in score.parameters if each.parameter == "mass"), math.inf)


def _unknowns(kind: str, scores: Sequence[Score]) -> list[Total | None]:
    def of(case: str, each: Callable[[Score], bool | None]) -> Iterable[bool | None]:
        return (each(score) for score in scores if score.case == case)

    return [
        share_of(
            "effect outside the library: unknown, no false name",
            of("unknown", lambda s: s.recognized),
            (0.90 if kind in ("contact", "arm", "unpaired") else 0.95, 1),
        ),
        share_of(
            "effect left out of the library: unknown, or one declared confusable",
            of("left_out", lambda s: s.recognized),
        ),
        share_of("a known and an unknown effect: partly explained", of("known_unknown", lambda s: s.verdict_right)),
        share_of("a known and an unknown effect: no false name", of("known_unknown", lambda s: not s.false)),
        share_of("a known and an unknown effect: known one called absent", of("known_unknown", lambda s: s.denied)),
        share_of("contents that differ: no name", of("content", lambda s: not s.named and not s.failed)),
        share_of("contents that differ: no name, or said to be perhaps contents", of("content", lambda s: s.contents)),
        share_of(
            "one effect, exact: said to be perhaps contents", of("single", lambda s: s.contents if s.exact else None)
        ),
        share_of("effect too weak to matter: no false name", of("weak", lambda s: not s.false and not s.failed)),
    ]


def share_of(name: str, hits: Iterable[bool | None], goal: tuple[float, float] | None = None) -> Total | None:
    """A share with Wilson's interval, over those that are not None."""
    told = [hit for hit in hits if hit is not None]
    if not told:
        return None
    low, high = proportion_confint(sum(told), len(told), alpha=0.05, method="wilson")
    return Total(name, sum(told) / len(told), float(low), float(high), len(told), goal)


def median_of(
    name: str, values: Iterable[float], goal: tuple[float, float] | None = None, percent: bool = True
) -> Total | None:
    """A median with its interval from order statistics (exact, of no distribution)."""
    ordered = np.sort(np.fromiter(values, dtype=float))
    count = len(ordered)
    if not count:
        return None
    rank = int(binom.ppf(0.025, count, 0.5))
    low, high = ordered[max(rank - 1, 0)], ordered[min(count - rank, count - 1)]
    return Total(name, float(np.median(ordered)), float(low), float(high), count, goal, percent)


def markdown(rows: Sequence[Total]) -> str:
    """The table as Markdown."""
    lines = ["| | measured | 95 % interval | of | goal | |", "| --- | ---: | --- | ---: | --- | --- |"]
    for row in rows:
        value, low, high = (_figure(number, row.percent) for number in (row.value, row.low, row.high))
        mark = {None: "", True: "met", False: "not met"}[row.met]
        lines.append(f"| {row.name} | {value} | {low} – {high} | {row.count} | {_goal(row)} | {mark} |")
    return "\n".join(lines) + "\n"


def published(rows: Sequence[Total]) -> dict[str, Any]:
    """The table as the documentation reads it: columns, and cells with their intervals."""

    def cell(row: Total) -> dict[str, Any]:
        scale = 100 if row.percent else 1
        ends = (round(scale * number, 9) for number in (row.value, row.low, row.high))  # Wilson's 0 is 1e-17
        value, low, high = (float(f"{number:.3g}") for number in ends)
        unit = {"unit": "%"} if row.percent else {}
        return {"value": value, "low": low, "high": high, **unit, "of": row.count}

    return {"columns": ["", "measured", "goal"], "rows": [[row.name, cell(row), _goal(row)] for row in rows]}


def _figure(number: float, percent: bool) -> str:
    return f"{100 * number:.3g} %" if percent else f"{number:.3g}"


def _goal(row: Total) -> str:
    if row.goal is None:
        return ""
    low, high = row.goal
    if low <= 0:
        return f"≤ {_figure(high, row.percent)}"
    if high >= 1:
        return f"≥ {_figure(low, row.percent)}"
    return f"{_figure(low, row.percent)} – {_figure(high, row.percent)}"
