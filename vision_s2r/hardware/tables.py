"""What was measured, as tables of the docs."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vision_s2r.statistics import Estimate, agree

SOURCE = (
    "one core; held out: root mean square on parts that no fit has seen; other recordings: mean absolute, nothing "
    "refitted; in free run, servos by position (mrad), others by velocity (mm/s or mrad/s); seconds of processor time"
)

KINDS = ("ci", "elsewhere")  # of intervals
SIMULATORS = ("believed", "identified", "diagnosed")


def table(measured: Sequence[Mapping[str, Any]], experts: Mapping[str, str]) -> dict[str, Any]:
    """Every recording: what was named, and errors as the simulator came, with nominal values identified, and ours."""
    rows: list[list[Any]] = []
    for each in measured:
        gap = each["gap"]
        rows.append(
            [
                f"{each['machine']}, {each['motions'][0]}",
                _diagnosis(each),
                experts[each["machine"]],
                _three(1e3 * gap[key] for key in ("before", "refitted", "after")),
                _by_simulator(each["others"]),
                round(each["seconds"]),
            ]
        )
    return {
        "command": "vision-s2r hardware path=DIR",
        "source": SOURCE,
        "columns": [
            "recording",
            "diagnosis",
            "an expert would say",
            "held out: believed / identified / diagnosed",
            "other recordings: the same",
            "s",
        ],
        "rows": rows,
    }


def together_table(together: Sequence[Mapping[str, Any]], alone: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Motions diagnosed together: errors on those that they were not, beside what each of them alone leaves there."""
    rows: list[list[Any]] = []
    for each in together:
        others = each["others"]
        parts = [
            f"{one['motions'][0]} {1e3 * np.mean([one['others'][name]['diagnosed'] for name in others]):.3g}"
            for one in alone
            if one["machine"] == each["machine"] and one["motions"][0] in each["motions"] and others
        ]
        rows.append(
            [
                each["machine"],
                _diagnosis(each),
                _three(1e3 * each["gap"][key] for key in ("before", "refitted", "after")),
                _by_simulator(others),
                "; ".join(parts) or "–",
                round(each["seconds"]),
            ]
        )
    motions = sorted({",".join(each["motions"]) for each in together})
    return {
        "command": " and ".join(f"vision-s2r hardware path=DIR 'together=[{each}]'" for each in motions),
        "source": SOURCE,
        "columns": [
            "machine",
            "diagnosis",
            "held out: believed / identified / diagnosed",
            "motions that it was not made from: the same",
            "there, from one motion alone",
            "s",
        ],
        "rows": rows,
    }


def identified_table(identified: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Nominal values of each recording, tried on the others of its machine; none of a machine with one recording."""
    rows: list[list[Any]] = []
    for each in identified:
        errors = dict(each["errors"])
        own = errors.pop(each["motion"])
        if not errors:
            continue
        means = [float(np.mean([other[key] for other in errors.values()])) for key in ("believed", "identified")]
        rows.append(
            [
                f"{each['machine']}, {each['motion']}",
                _three(1e3 * own[key] for key in ("believed", "identified")),
                _three(1e3 * mean for mean in means),
                ", ".join(f"{1e3 * other['identified']:.1f}" for other in errors.values()),
                round(means[1] / means[0], 2),
                round(each["seconds"], 1),
            ]
        )
    return {
        "command": "vision-s2r hardware path=DIR diagnose=false",
        "source": "nominal values that one recording asks for; mean absolute error in free run, nothing refitted, "
        "servos by position (mrad), others by velocity (mm/s or mrad/s); seconds of processor time",
        "columns": [
            "identified from",
            "itself: believed / identified",
            "mean of the others: the same",
            "each of the others",
            "identified ÷ believed",
            "s",
        ],
        "rows": rows,
    }


def agreement_table(identified: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How often two recordings of a machine agree about a parameter, within intervals of either kind."""
    agreed: dict[str, list[list[bool]]] = {}
    for one, other in itertools.combinations(identified, 2):
        shared = one["parameters"].keys() & other["parameters"].keys() - {"encoder_quantization"}
        for name in shared if one["machine"] == other["machine"] else ():
            for key, value in one["parameters"][name].items():
                found = other["parameters"][name][key]
                within = [agree(*(Estimate(each["value"], *each[kind]) for each in (value, found))) for kind in KINDS]
                agreed.setdefault(name, []).append(within)
    whole = {"all": [pair for pairs in agreed.values() for pair in pairs]} if agreed else {}
    return {
        "command": "vision-s2r hardware path=DIR diagnose=false",
        "source": "pairs of recordings of one machine whose identified values are no further apart than their 95 % "
        "intervals reach towards each other (root of the sum of squares)",
        "columns": ["", "pairs", "sure of this recording", "of what another would say"],
        "rows": [
            [
                name.replace("_", " "),
                len(pairs),
                *(f"{sum(kind)} ({np.mean(kind):.0%})" for kind in zip(*pairs, strict=True)),
            ]
            for name, pairs in [*sorted(agreed.items()), *whole.items()]
        ],
    }


def added_table(added: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, Any]:
    """Effects added, a recording a column: what is found of them beyond what the recording itself asks for."""
    told = {log: {str(each["effect"]): _told(each) for each in effects} for log, effects in added.items() if effects}
    effects = sorted({effect for of_log in told.values() for effect in of_log})
    return {
        "command": "vision-s2r hardware path=DIR added=true",
        "source": "found of what was added, beyond what the recording as it is asks for; 95 % interval, of joints of "
        "what another motion would say; with its share of the gap where it is named",
        "columns": ["added", *told],
        "rows": [
            [effect.replace("_", " "), *(of_log.get(effect, "–") for of_log in told.values())] for effect in effects
        ],
    }


def _told(each: Mapping[str, Any]) -> str:
    found, size, unit = each["found"], f"{each['size']:.3g}", f" {each['unit']}".rstrip()
    others = "".join(f"; and {name.replace('_', ' ')}" for name in each["others"])
    if found is None:
        return f"not found, of {size}{unit}{others}"
    value, *ends = (f"{number - each['from']:.3g}" for number in (found["value"], *found["ci"]))
    said = "without a name" if each["share"] is None else f"named, {each['share']:.0%}"
    return f"{value} of {size}{unit} ({' to '.join(ends)}), {said}{others}"


def friction_table(measured: Mapping[str, Any], errors: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Logs left out in turn: mean absolute errors under friction models, and under what the diagnosis names."""
    count = len(next(iter(errors.values()))["errors"])
    rows: list[list[Any]] = [
        [
            name if name != "diagnosed" else f"diagnosed: {_names(measured)}",
            *(round(1e3 * error, 1) for error in each["errors"]),
            round(1e3 * float(np.mean(each["errors"])), 1),
            round(1e3 * float(np.mean(each["all"])), 1),
            round(each["seconds"], 1),
        ]
        for name, each in errors.items()
    ]
    return {
        "command": "vision-s2r hardware path=DIR",
        "source": "each log held out in turn, fitted on the others; mean absolute error in free run, mrad",
        "columns": ["model", *(f"log {k + 1}" for k in range(count)), "mean", "fitted to all of them", "s"],
        "rows": rows,
    }


def _diagnosis(measured: Mapping[str, Any]) -> str:
    return f"{measured['verdict'].replace('_', ' ')}: {_names(measured)}{_refitted(measured)}"


def _by_simulator(others: Mapping[str, Mapping[str, float]]) -> str:
    """Mean errors on other recordings, of the simulator as it came, identified and diagnosed."""
    if not others:
        return "–"
    return _three(1e3 * np.mean([each[key] for each in others.values()]) for key in SIMULATORS)


def _names(measured: Mapping[str, Any]) -> str:
    return "; ".join(named(each) for each in measured["effects"]) or "no name"


def named(effect: Mapping[str, Any]) -> str:
    """An effect of a report and its values, in words."""
    return f"{effect['name'].replace('_', ' ')} " + ", ".join(
        f"{one['value']:.3g}{'' if one['unit'] == '–' else ' ' + one['unit']}" for one in effect["parameters"].values()
    )


def _refitted(measured: Mapping[str, Any]) -> str:
    names = ", ".join(name.replace("_", " ") for name in measured["refitted"])
    return f" (refitted: {names})" if names else ""


def _three(values: Any) -> str:
    return " / ".join(f"{value:.3g}" for value in values)
