"""Score a robot's one report: each part as a machine of its own kind, and the whole by its parts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from vision_s2r.gapbench.score.score import Score, score
from vision_s2r.gapbench.score.table import Total, median_of, share_of

UNKNOWN = ("unknown", "known_unknown")


def score_robot(name: str, answer: Mapping[str, Any], report: Mapping[str, Any] | None, seconds: float) -> Score:
    """Score a robot's report; None: the diagnosis failed, and every part of it is wrong."""
    kinds = {folder: "joint" if folder.startswith("joints/") else folder for folder in answer["parts"]}
    parts = {
        folder: score(folder, kinds[folder], own, _of_part(report, folder), seconds)
        for folder, own in answer["parts"].items()
    }
    found = list(parts.values())
    false = sorted(f"{folder}.{each}" for folder, part in parts.items() for each in part.false)
    whole = all(_right(part) for part in found)
    return Score(
        id=name,
        case=answer["case"],
        verdict=report["verdict"] if report else "failed",
        named=sorted(f"{folder}.{each}" for folder, part in parts.items() for each in part.named),
        expected=sorted(answer["effects"]),
        unknown=answer["unknown"],
        severity=None,
        seconds=seconds,
        failed=report is None,
        exact=whole,
        confusable=not whole and all(_right(part) or part.confusable for part in found),
        false=false,
        verdict_right=all(part.verdict_right for part in found),
        recognized=all(part.recognized is not False for part in found) and not false
        if answer["case"] in UNKNOWN
        else None,
        parameters=[
            replace(each, effect=f"{folder}.{each.effect}")
            for folder, part in parts.items()
            for each in part.parameters
        ],
        parts=found,
    )


def _right(part: Score) -> bool:
    return part.exact if part.recognized is None else part.recognized


def _of_part(report: Mapping[str, Any] | None, folder: str) -> dict[str, Any] | None:
    """What a robot's report says of one part, as that part's own report says it; None where it says nothing."""
    if report is None:
        return None
    stage = next((each for each in report["stages"] if each["part"] == folder), None)
    own = [
        {key: of for key, of in line.items() if key != "part"} for line in report["effects"] if line["part"] == folder
    ]
    return stage and {**stage, "effects": own, "candidates": [], "where": []}


def totals_of_robots(scores: Sequence[Score]) -> list[Total]:
    """Every figure of the robots' table: of whole robots, of their parts, of parameters and of time."""
    parts = [part for each in scores for part in each.parts]
    rows = [share_of("whole robot exact", (each.exact for each in scores))]
    wrong = {"null": "nothing", "single": "one part", "pair": "two parts", "triple": "three parts"}
    for case, title in wrong.items():
        rows.append(share_of(f"{title} wrong: exact", (each.exact for each in scores if each.case == case)))
    for kind in ("camera", "joints", "contact"):
        own = [part for part in parts if part.id.split("/")[0] == kind]
        rows.append(share_of(f"{kind}, with an effect: exact", (part.exact for part in own if part.case == "single")))
        rows.append(share_of(f"{kind}, without: exact", (part.exact for part in own if part.case == "null")))
    parameters = [each for score_ in scores for each in score_.parameters]
    rows += [
        share_of("robots with a false name", (bool(each.false) for each in scores)),
        share_of("an unknown effect in a part: said, no false name", (each.recognized for each in scores)),
        share_of("verdict of every part right", (each.verdict_right for each in scores)),
        median_of("median parameter error", (each.error for each in parameters)),
        share_of("intervals that cover the truth", (each.covered for each in parameters)),
        median_of("seconds a robot", (each.seconds for each in scores), percent=False),
        share_of("failed", (each.failed for each in scores)),
    ]
    return [row for row in rows if row is not None]
