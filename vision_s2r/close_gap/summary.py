"""What closing the loop won, over all robots together."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from vision_s2r.close_gap.withheld import Withheld
from vision_s2r.evaluate.publish import percent
from vision_s2r.scene.machine import Machine
from vision_s2r.statistics import interval, wilson

COSTS = ("grasps", "pictures", "minutes")
LABELS = {
    "as_it_came": "as it came",
    "everything": "everything randomized",
    "diagnosed": "after the diagnosis",
    "posterior": "its posterior as ranges",
    "true_effects": "true effects known",
}


@dataclass(frozen=True)
class Closed:
    """One robot: what was diagnosed, what it cost the task, and how each row grasps on it."""

    robot: Withheld
    report: dict[str, Any]
    truth: Machine | None
    losses: dict[str, Any]
    outcomes: Mapping[str, np.ndarray]  # bool [N] by row
    costs: Mapping[str, Mapping[str, float]]  # by row: grasps, pictures and minutes


def summary(closed: Sequence[Closed], seed: int) -> dict[str, Any]:
    """JSON-able: each robot, each row over all of them, and with known truths what the diagnosis recovers.

    Intervals are over grasps, a robot's and a scene's as one.
    """
    content: dict[str, Any] = {"robots": [_robot(one) for one in closed]}
    rows = [row for row in closed[0].outcomes if all(row in one.outcomes for one in closed)]
    held = {row: np.stack([one.outcomes[row] for one in closed]).astype(float) for row in rows}
    content["rows"] = {row: asdict(wilson(int(each.sum()), each.size)) for row, each in held.items()}
    content["over_as_it_came"] = {
        row: _difference(held[row], held["as_it_came"], seed) for row in rows if row != "as_it_came"
    }
    if {"diagnosed", "everything"} <= held.keys():
        content["diagnosed_over_everything"] = _difference(held["diagnosed"], held["everything"], seed)
    if {"diagnosed", "true_effects"} <= held.keys():
        won = content["over_as_it_came"]["true_effects"]["low"] > 0  # else its share is one of what may be nothing
        content["recovered"] = recovered(held, seed) if won else None
    if all(one.truth is not None for one in closed):
        content["named_first"] = _named_first(closed)
    return content


def _robot(one: Closed) -> dict[str, Any]:
    return {
        "robot": one.robot.name,
        "verdict": one.report["verdict"],
        "named": [_effect(effect) for effect in one.report["effects"]],
        "truth": one.truth.to_dict() if one.truth else None,
        "losses": one.losses,
        "success": {row: float(held.mean()) for row, held in one.outcomes.items()},
        "attempts": len(one.outcomes["as_it_came"]),
        "costs": one.costs,
    }


def _effect(effect: dict[str, Any]) -> dict[str, Any]:
    values = {key: given["value"] for key, given in effect["parameters"].items()}
    return {"part": effect.get("part", "camera"), "name": effect["name"], "parameters": values}


def _difference(first: np.ndarray, second: np.ndarray, seed: int) -> dict[str, float]:
    """Of success [R, N] on the same scenes."""
    each = (first - second).ravel()
    low, high = interval(partial(_mean, each), len(each), seed)
    return {"value": float(each.mean()), "low": low, "high": high}


def as_table(content: Mapping[str, Any]) -> tuple[list[str], list[list[Any]]]:
    """`columns` and `rows` of a page of results: what each row holds and wins over all robots, and costs on each."""
    rows = []
    for row, held in content["rows"].items():
        over = content["over_as_it_came"].get(row)
        cells = [percent(held), percent(over) if over else ""]
        spent = [float(np.mean([one["costs"][row][key] for one in content["robots"]])) for key in COSTS]
        rows.append([LABELS[row], *cells, *(float(f"{each:.3g}") for each in spent)])
    count = sum(one["attempts"] for one in content["robots"])
    titles = [f"{len(content['robots'])} robots, {count} grasps a row", "held, %", "over as it came, points"]
    return [*titles, *(f"{key} a robot" for key in COSTS)], rows


def said(content: Mapping[str, Any]) -> Iterator[str]:
    """A summary in lines: how often each row succeeds, and what the diagnosis recovers."""
    rows = [f"{row.replace('_', ' ')} {100 * each['value']:.0f} %" for row, each in content["rows"].items()]
    yield f"grasps that succeed, {sum(one['attempts'] for one in content['robots'])} a row: {', '.join(rows)}"
    if content.get("recovered"):
        shares = (100 * content["recovered"][key] for key in ("value", "low", "high"))
        yield "the diagnosis recovers {:.0f} % ({:.0f} to {:.0f}) of what the true effects win".format(*shares)
    elif "recovered" in content:
        points = (100 * content["over_as_it_came"]["true_effects"][key] for key in ("value", "low", "high"))
        yield (
            "what part of it the diagnosis recovers these grasps do not say: "
            "the true effects win {:+.0f} points ({:+.0f} to {:+.0f})".format(*points)
        )
    if first := content.get("named_first"):
        by_source = (f"{source} {first['right'][source]} of {count}" for source, count in first["robots"].items())
        yield f"what to mend first is right on {100 * first['value']:.0f} % of the robots: {', '.join(by_source)}"


def recovered(held: dict[str, np.ndarray], seed: int) -> dict[str, float]:
    """Of what the true effects win over the simulator as it came, the part that the diagnosis wins."""
    won, possible = ((held[row] - held["as_it_came"]).ravel() for row in ("diagnosed", "true_effects"))

    def part(counts: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray((counts @ won) / (counts @ possible))

    low, high = interval(part, len(won), seed)
    return {"value": float(part(np.ones((1, len(won))))[0]), "low": low, "high": high}


def _named_first(closed: Sequence[Closed]) -> dict[str, Any] | None:
    """On how many robots the source that is said to be mended first is the one whose removal wins most.

    Of those on which some removal surely wins; None where there is none. `robots` and `right` count by source.
    """
    asked = [one for one in closed if any(source["gained_ci"][0] > 0 for source in one.losses["sources"])]
    first = [_first(one.losses) for one in asked]
    named = [_first(one.report["task"]["losses"]) if "task" in one.report else None for one in asked]
    robots = Counter(first)
    right = Counter(true for true, said in zip(first, named, strict=True) if said == true)
    counts = {"robots": dict(robots), "right": {source: right[source] for source in robots}}
    return asdict(wilson(right.total(), len(asked))) | counts if asked else None


def _first(losses: dict[str, Any]) -> str:
    return str(max(losses["sources"], key=lambda source: source["gained"])["source"])


def _mean(values: np.ndarray, counts: np.ndarray) -> np.ndarray:
    return np.asarray(counts @ values / counts.sum(axis=1))
