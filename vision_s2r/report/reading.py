"""A report, read back: which effects it names, with their parameters."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vision_s2r.effects import Effect, Parameter, Registry
from vision_s2r.errors import UserError, nearest
from vision_s2r.lazy import load

FORMAT = "vision-s2r/report/1"
LIBRARIES = {
    "joint": "vision_s2r.joint:JOINT_EFFECTS",
    "camera": "vision_s2r.appearance:PICTURE_EFFECTS",
    "contact": "vision_s2r.contact:CONTACT_EFFECTS",
    "arm": "vision_s2r.arm.effect:ARM_EFFECTS",
}


@dataclass(frozen=True)
class ReportedParameter:
    """A parameter with its 95 % interval, within the physical bounds; a point where there is no interval."""

    value: float
    low: float
    high: float


# By effect, its parameters by name; an arm's are called JOINT.EFFECT, those of a label LABEL.EFFECT, but for those of
# the whole arm or scene.
Diagnosed = dict[str, dict[str, ReportedParameter]]


def library(kind: str) -> Registry[Any]:
    """The effects of a kind of recording, imported only now: a camera's need torch. Raises UserError for another."""
    if kind not in LIBRARIES:
        raise UserError(f"kind is {kind!r}: {nearest(kind, LIBRARIES)}")
    effects: Registry[Any] = load(LIBRARIES[kind])
    return effects


def read_report(path: Path | str) -> dict[str, Any]:
    """The report in a file, with the effects that it names checked. Raises UserError for what cannot be one."""
    path = Path(path)
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}), expected a report.json") from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: is not JSON ({error})") from error
    if not isinstance(report, dict) or report.get("format") != FORMAT:
        raise UserError(f"{path}: is no report, expected format '{FORMAT}'")
    try:
        diagnosed(report)
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    return report


def diagnosed(report: Mapping[str, Any]) -> Diagnosed:
    """The simulator of a report: the effects that it names, and nominal parameters that are refitted beside them.

    Effects that are sure only beside something unknown (`patched` is false) are no part of it. Raises UserError for
    names, values or a kind that cannot be.
    """
    effects = library(str(report.get("kind")))
    named: Diagnosed = {}
    for each in [*_patched(report), *(_list(report, "refitted") if "refitted" in report else [])]:
        effect = effects[str(each.get("name"))]
        given = each.get("parameters")
        if not isinstance(given, Mapping) or not all(isinstance(one, Mapping) for one in given.values()):
            raise UserError(f"{effect.name}: parameters are missing, expected value, unit and ci of each")
        values = effect.check({name: one.get("value") for name, one in given.items()})
        part = each.get("joint", each.get("label"))
        named[effect.name if part is None else f"{part}.{effect.name}"] = {
            parameter.name: _estimate(
                parameter, values[parameter.name], given.get(parameter.name, {}).get("ci"), effect
            )
            for parameter in effect.parameters
        }
    return named


def values(named: Diagnosed) -> dict[str, dict[str, float]]:
    """The values alone."""
    return {name: {key: one.value for key, one in given.items()} for name, given in named.items()}


def _patched(report: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [each for each in _list(report, "effects") if each.get("patched") is not False]


def _list(report: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    found = report.get(key)
    if not isinstance(found, list) or not all(isinstance(each, Mapping) for each in found):
        raise UserError(f"{key} is missing, expected a list")
    return found


def _estimate(parameter: Parameter, value: float, interval: Any, effect: Effect) -> ReportedParameter:
    try:
        low, high = (float(end) for end in interval or (value, value))
    except (TypeError, ValueError, OverflowError):
        raise UserError(f"{effect.name}: ci of {parameter.name} is {interval!r}, expected [low, high]") from None
    low, high = (value if math.isnan(end) else min(max(end, parameter.low), parameter.high) for end in (low, high))
    return ReportedParameter(value, min(low, value), max(high, value))
