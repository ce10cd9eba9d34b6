"""Which of the effects that a camera was found to have is worth mending for a policy: by its curves of sensitivity."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.camera.strength import strength_of
from vision_s2r.errors import UserError, nearest

_NAMES, _NUMBERS = ("row", "effect"), ("strength", "value", "low", "high")  # of a point
_SHOULD = "expected what vision-s2r sensitivity wrote"

Point = Mapping[str, Any]


def worth(effects: Sequence[Mapping[str, Any]], path: str, row: str = "") -> dict[str, Any] | None:
    """What each of a report's camera effects alone costs the policy of `row` (the first, if empty), the dearest first.

    Between measured strengths success is taken as linear. None where none of the effects has a curve. Raises UserError
    for a file that is none, and a row that it lacks.
    """
    points = _read(path)
    rows = list(dict.fromkeys(str(point["row"]) for point in points))
    if row and row not in rows:
        raise UserError(f"diagnose.policy: {path} has no row '{row}', {nearest(row, rows)}")
    row = row or rows[0]
    curves: dict[str, list[Point]] = {}
    for point in points:
        if point["row"] == row:
            curves.setdefault(point["effect"], []).append(point)
    found = [_cost(each, curves[each["name"]]) for each in effects if each["name"] in curves]
    if not found:
        return None
    none = min(curves[found[0]["name"]], key=lambda point: point["strength"])
    costs = sorted(found, key=lambda each: -each["lost"])
    return {"row": row, "success": none["value"], "ci": [none["low"], none["high"]], "effects": costs}


def _cost(effect: Mapping[str, Any], curve: Sequence[Point]) -> dict[str, Any]:
    values = {key: each["value"] for key, each in effect["parameters"].items()}
    strength = strength_of(CAMERA_EFFECTS[effect["name"]], values)
    ordered = sorted(curve, key=lambda point: point["strength"])
    measured = [point["strength"] for point in ordered]
    value, low, high = (
        float(np.interp(strength, measured, [point[key] for point in ordered])) for key in ("value", "low", "high")
    )
    return {
        "name": effect["name"],
        "strength": strength,
        "success": value,
        "ci": [low, high],
        "lost": ordered[0]["value"] - value,
        "sure": bool(high < ordered[0]["low"]),
        "beyond": strength > measured[-1],
    }


def _read(path: str) -> list[Point]:
    try:
        points = json.loads(Path(path).read_text())
    except (OSError, ValueError) as error:
        raise UserError(f"diagnose.sensitivity: {path} cannot be read ({error}), {_SHOULD}") from error
    if not isinstance(points, list) or not points or not all(map(_whole, points)):
        raise UserError(f"diagnose.sensitivity: {path} has no points with {', '.join([*_NAMES, *_NUMBERS])}: {_SHOULD}")
    return list(points)


def _whole(point: object) -> bool:
    return (
        isinstance(point, dict)
        and all(isinstance(point.get(key), str) for key in _NAMES)
        and all(isinstance(point.get(key), int | float) for key in _NUMBERS)
    )
