"""Score one report against its answer."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

DYNAMICS = {
    *("viscous_damping", "coulomb_friction", "inertia", "gravity_torque", "bias_torque", "torque_constant"),
    *("proportional_gain", "derivative_gain", "position_offset", "back_emf", "payload", "base_tilt"),
}
APPEARANCE = {"albedo", "texture", "light_direction", "ambient", "missing_object"}
UNKNOWN_VERDICTS = {"unexplained", "partly_explained"}
NAMED_CASES = ("dynamics", "single", "pair", "whole_pair", "triple", "all_nominal", "known_unknown")
TURNS = {  # period of `angle` (deg) or `azimuth` (rad)
    **{"motion_blur": 180.0, "uneven_illumination": 360.0, "cast_shadow": 360.0},
    "light_direction": 2 * math.pi,
}


@dataclass(frozen=True)
class ParameterScore:
    """One estimated parameter of an effect that was rightly named."""

    effect: str
    parameter: str
    true: float
    estimate: float
    interval: tuple[float, float]
    error: float  # relative; see `parameter_scores`
    covered: bool


@dataclass(frozen=True)
class Score:
    """What is right and wrong about one report. None: the case does not define it.

    `exact`: the effects of the answer are named and no other (its optional ones may be; a description of as many
    effects that predicts the same is the same answer). `confusable`: not exact, but a larger equivalent set, or one
    whose difference to the answer the report itself declares as confusable. `drive`: the effects of the drive among
    the named ones are right, whatever parameters of the simulator are named. `false`: effects named that are not there.
    `denied`: an effect beside an unknown one is said to be absent, rather than named or left undecided. `contents`: all
    effects that are named are said to be perhaps contents that differ between two sets of pictures.
    """

    id: str
    case: str
    verdict: str
    named: list[str]
    expected: list[str]
    unknown: str | None
    severity: float | None
    seconds: float
    failed: bool
    exact: bool
    confusable: bool
    false: list[str]
    verdict_right: bool
    drive: bool | None = None
    source_right: bool | None = None
    location_right: bool | None = None
    false_alarm: bool | None = None
    recognized: bool | None = None
    denied: bool | None = None
    contents: bool | None = None
    shrink_ratio: float | None = None
    parameters: list[ParameterScore] = field(default_factory=list)
    group: str = ""
    processor: float | None = None  # seconds
    parts: list["Score"] = field(default_factory=list)  # of a robot


def score(name: str, kind: str, answer: Mapping[str, Any], report: Mapping[str, Any] | None, seconds: float) -> Score:
    """Score a report; None: the diagnosis failed, and everything that the case defines is wrong."""
    case = answer["case"]
    said = report or {"verdict": "failed", "effects": [], "candidates": [], "where": [], "gap": {"shrink": 0.0}}
    named = {label(effect) for effect in said["effects"]}
    required, optional = set(answer["effects"]), set(answer["optional"])
    equivalents = [set(names) for names in answer["equivalents"]]
    same = [required, *(names for names in equivalents if len(names) <= len(required))]
    there = set().union(required, optional, *equivalents)
    exact = report is not None and any(names <= named <= names | optional for names in same)
    confusable = report is not None and not exact and (named in equivalents or _declared(said, named, required))
    verdict = said["verdict"]
    described = case in NAMED_CASES
    return Score(
        id=name,
        case=case,
        verdict=verdict,
        named=sorted(named),
        expected=sorted(required),
        unknown=answer["unknown"],
        severity=answer["severity"],
        seconds=seconds,
        failed=report is None,
        exact=exact,
        confusable=confusable,
        false=sorted(named - there),
        verdict_right=_verdict_right(case, verdict, named),
        drive=_drive(report, named, required, optional) if described and kind in ("joint", "servo") else None,
        source_right=_source_right(kind, said, required, optional, equivalents) if described else None,
        location_right=_location_right(said, answer["where"]) if described and answer["where"] else None,
        false_alarm=_false_alarm(report, case, named - there, verdict),
        recognized=_recognized(report, answer, named, optional, equivalents),
        denied=_denied(said, required - named) if case == "known_unknown" and report else None,
        contents=_contents(said, named) if kind == "unpaired" and report else None,
        shrink_ratio=_shrink_ratio(said, answer) if described else None,
        parameters=list(_parameter_scores(said, answer["effects"])) if required <= named else [],
        group=answer.get("group", ""),
    )


def label(line: Mapping[str, Any]) -> str:
    """What a line of a report is about: an effect, in an arm that of a joint, in a scene that of a label."""
    part = line.get("joint", line.get("label"))
    return str(line["name"]) if part is None else f"{part}.{line['name']}"


def _declared(report: Mapping[str, Any], named: set[str], required: set[str]) -> bool:
    """Whether the report itself says that what it names wrongly may be what it does not name."""
    missing, extra = required - named, named - required
    status = {
        label(line): {
            found for each in line.get("confusable_with", ()) for found in (each, label({**line, "name": each}))
        }
        for line in report["candidates"]
    }
    declared = [status.get(name, set()) & named for name in missing]
    return bool(missing) and all(declared) and extra <= set().union(*declared)


def _verdict_right(case: str, verdict: str, named: set[str]) -> bool:
    if case in ("null", "weak"):
        return verdict == "no_gap" or (case == "weak" and bool(named) and verdict == "explained")
    if case == "known_unknown":
        return verdict == "partly_explained"
    if case == "content":  # whether that shows is drawn
        return not named and verdict in ("no_gap", "unexplained")
    if case == "sensor":  # how uneven its pixels are, and whether that shows, is drawn
        return verdict in ("explained", "partly_explained")
    return verdict in UNKNOWN_VERDICTS if case in ("unknown", "left_out") else verdict == "explained"


def _drive(report: Any, named: set[str], required: set[str], optional: set[str]) -> bool:
    required, named = required - DYNAMICS, named - DYNAMICS
    return report is not None and required <= named <= required | optional


def source_of(kind: str, effect: str) -> str:
    """The source of the gap that an effect of this kind of recording belongs to."""
    if kind == "appearance":
        return kind if effect.rpartition(".")[2] in APPEARANCE else "camera"
    if kind == "unpaired":
        return "camera"
    if kind not in ("joint", "servo", "arm"):
        return kind
    return "dynamics" if effect.rpartition(".")[2] in DYNAMICS else "actuator"


def _source_right(
    kind: str, report: Mapping[str, Any], required: set[str], optional: set[str], equivalents: list[set[str]]
) -> bool:
    """The sources of the named effects are those of the answer or of a degenerate description."""
    claimed = {effect["source"] for effect in report["effects"] if label(effect) not in optional - required}
    return any(claimed == {source_of(kind, name) for name in names} for names in (required, *equivalents))


def _location_right(report: Mapping[str, Any], places: list[str]) -> bool:
    """The place that the report puts first is one of these, or lies on one of these axes."""
    first = report["where"][0] if report["where"] else {"axis": ""}
    return first["axis"] in places or f"{first['axis']}: {first.get('at')}" in places


def _false_alarm(report: Any, case: str, false: set[str], verdict: str) -> bool | None:
    """A machine without an effect that is said to have one, known or not. A failed diagnosis raises none."""
    if case not in ("null", "dynamics") or report is None:
        return None
    return bool(false) or verdict in UNKNOWN_VERDICTS


def _recognized(
    report: Any, answer: Mapping[str, Any], named: set[str], optional: set[str], equivalents: list[set[str]]
) -> bool | None:
    """What has no name was said to be there, with no false name beside it (or under the name of a confusable)."""
    if answer["case"] not in ("unknown", "left_out"):
        return None
    if report is None:
        return False
    if answer["case"] == "left_out" and (named in equivalents or _declared(report, named, {answer["withhold"]})):
        return True
    return report["verdict"] in UNKNOWN_VERDICTS and named <= optional


def _denied(report: Mapping[str, Any], missing: set[str]) -> bool:
    """Whether the report rules out an effect that is there."""
    return any(label(line) in missing and line["status"] == "absent" for line in report["candidates"])


def _contents(report: Mapping[str, Any], named: set[str]) -> bool:
    return named <= {each["name"] for each in report.get("contents", ())}


def _shrink_ratio(report: Mapping[str, Any], answer: Mapping[str, Any]) -> float | None:
    """The share of the gap that the diagnosis removes, over the share that the true effects remove."""
    if answer["shrink"] is None or answer["shrink"] <= 0:
        return None
    return float(report["gap"]["shrink"] or 0.0) / float(answer["shrink"])


def _parameter_scores(report: Mapping[str, Any], truth: Mapping[str, Mapping[str, float]]) -> Iterator[ParameterScore]:
    """Errors relative to the true value; of an angle to half a turn; of parameters of one unit to the largest of them.

    (A yaw of zero beside a pitch of one degree is not infinitely wrong, nor is a k2 of nothing beside a large k1.)
    """
    for effect in report["effects"]:
        name = label(effect)
        true = truth.get(name, {})
        units = {key: effect["parameters"].get(key, {}).get("unit", "") for key in true}
        for key, value in true.items():
            told = effect["parameters"].get(key)
            if told is None:
                continue
            estimate, (low, high) = float(told["value"]), (float(edge) for edge in told["ci"])
            if key in ("angle", "azimuth") and name in TURNS:
                turns = TURNS[name] * round((estimate - value) / TURNS[name])
                half = 180.0 if key == "angle" else math.pi
                estimate, low, high, scale = estimate - turns, low - turns, high - turns, half
            else:
                scale = max(abs(true[other]) for other in true if units[other] == units[key])
            slack = 1e-6 * scale  # of decimals in files
            covered = low - slack <= value <= high + slack
            error = abs(estimate - value) / max(scale, 1e-12)
            yield ParameterScore(name, key, value, estimate, (low, high), error, covered)
