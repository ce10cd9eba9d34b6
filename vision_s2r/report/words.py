"""A report in words: the verdict as a sentence, numbers with as many digits as they deserve."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

QUICK = "This was a quick look: at a part of the recording, with only the most promising sets of effects."


def verdict(report: Mapping[str, Any]) -> str:
    """The whole report in two sentences; what may be contents; and that it was quick where it was."""
    quick = QUICK if report.get("quick") else ""
    return " ".join(
        filter(None, [_touching(report) or _verdict(report), contents(report.get("contents") or ()), quick])
    )


def _touching(report: Mapping[str, Any]) -> str:
    """What the tip of an arm touches, and what is said of other rows; nothing where it touches nothing."""
    touches, rest = report.get("touches"), report["unexplained"]
    if not touches:
        return ""
    elsewhere = {**rest, "resembles": rest["resembles"][1:]}  # the first is what it touches
    return (
        f"The tip touches something that the simulator has not, at a height of {number(touches['height'])} m, in "
        f"{percent(touches['share'])} of the rows. {'Elsewhere' if report['held_out']['without'] else 'In all rows'}: "
        f"{_verdict({**report, 'verdict': touches['verdict'], 'unexplained': elsewhere})}"
    )


def _verdict(report: Mapping[str, Any]) -> str:
    gap = report["gap"]
    before, after, floor = (f"{number(gap[key])} {gap['unit']}" for key in ("before", "after", "floor"))
    if report["verdict"] == "no_gap":
        return f"Simulator and recording agree: {before} between them is no more than measurement noise ({floor})."
    if report["verdict"] == "unexplained":
        resembles = report["unexplained"].get("resembles", [])
        hint = f" It looks like {listed(resembles)}." if resembles else ""
        return (
            f"There is a gap of {before}, {number(floor_ratio(gap))} times measurement noise, that no known effect or "
            f"set of them explains.{hint}"
        )
    shrink = f"{percent(gap['shrink'])} ({interval_percent(gap['shrink_ci'])}) of what exceeds measurement noise"
    apart = [each["name"].replace("_", " ") for each in report["effects"] if each.get("patched") is False]
    text = causes(report)
    if len(apart) < len(report["effects"]):
        text += f" With that, the gap shrinks from {before} to {after}: {shrink}."
    if report["verdict"] == "partly_explained":
        rest = report["unexplained"]
        hint = f", like {listed(rest['resembles'])}" if rest.get("resembles") else ""
        size = f" of {percent(rest['share'])}" if percent(rest["share"]) != percent(0.0) else ""
        text += f" A rest{size} is real and has another cause{hint}."
    if apart:
        text += f" No simulator without that cause is better for {listed(apart)}: not in the patch."
    return text + (f" {worth(report['policy'])}" if report.get("policy") else "")


def contents(rivals: Sequence[Mapping[str, Any]]) -> str:
    """What may be contents that differ between two sets of pictures."""
    if not rivals:
        return ""
    names = ["what is left" if each["name"] == "unexplained" else each["name"].replace("_", " ") for each in rivals]
    said, most = listed(names), max(each["shift"] for each in rivals)
    return (
        f"{said[0].upper()}{said[1:]} may as well be contents that differ between the two sets: nothing is moved by "
        f"more than {number(most)} standard deviations between pictures. Make sure that both sets show the same things."
    )


def worth(policy: Mapping[str, Any]) -> str:
    """Which of the effects found is worth mending for a policy."""
    before, each = f"{percent(policy['success'])} of grasps without any", policy["effects"]
    who = policy["row"].replace("_", " ")
    dear = [effect for effect in each if effect["sure"]]
    if not dear:
        return f"None of these effects alone costs the policy {who} more than its curves can tell ({before})."
    told = [
        f"{effect['name'].replace('_', ' ')} ({'at most ' if effect['beyond'] else ''}{percent(effect['success'])}, "
        f"{interval_percent(effect['ci'])})"
        for effect in dear
    ]
    first, *others = told
    rest = f"; then {listed(others)}" if others else ""
    return f"For the policy {who}, which holds {before}, mend this first: {first}{rest}."


def causes(report: Mapping[str, Any]) -> str:
    """Which nominal values are wrong, and which effects the simulator lacks."""
    wrong = [each for each in report["effects"] if each["source"] == "dynamics"]
    looks = [each for each in report["effects"] if each["source"] == "appearance"]
    lacking = [each for each in report["effects"] if each["source"] not in ("dynamics", "appearance")]
    parts = []
    if wrong:
        are = "is" if len(wrong) == 1 else "are"
        parts.append(f"its {listed([parameters(each) for each in wrong])} {are} not what the simulator believes")
    if lacking:
        parts.append(f"it has {listed([parameters(each) for each in lacking])}, which the simulator lacks")
    if looks:
        parts.append(f"of the scene, {surfaces(looks)}")
    return f"The real {report['kind']} differs: {', and '.join(parts)}."


def parameters(effect: Mapping[str, Any]) -> str:
    """`backlash (0.031 rad)`, `lens distortion (k1 −0.15, k2 0.036)`."""
    given = effect["parameters"]
    shown = [
        f"{'' if len(given) == 1 else name.replace('_', ' ') + ' '}{measured(each)}".strip()
        for name, each in given.items()
    ]
    joint = f"{effect['joint']}: " if effect.get("joint") else ""
    return f"{joint}{effect['name'].replace('_', ' ')} ({', '.join(shown)})"


def surfaces(effects: Sequence[Mapping[str, Any]]) -> str:
    """Effects of surfaces and light, as in `the table is 30 % darker`, or `label 2 …` where it has no name."""
    by_label: dict[int, list[str]] = {}
    called: dict[int, str] = {}
    for each in effects:
        if each.get("label") is not None:
            by_label.setdefault(each["label"], []).append(_surface(each))
            called[each["label"]] = f"the {each['label_name']}" if each.get("label_name") else f"label {each['label']}"
    rest = [_light(each) for each in effects if each.get("label") is None]
    return listed([*(f"{called[label]} {listed(said)}" for label, said in sorted(by_label.items())), *rest])


def _surface(effect: Mapping[str, Any]) -> str:
    """What an effect makes of its label, as it ends `label 2 …`."""
    given = {key: each["value"] for key, each in effect["parameters"].items()}
    if effect["name"] == "albedo":
        gains = {key: given[key] for key in ("red", "green", "blue")}
        mean = sum(gains.values()) / 3
        brightness = f"{percent(abs(mean - 1))} {'darker' if mean < 1 else 'brighter'}"
        if max(gains.values()) < 1.1 * min(gains.values()):
            return f"is {brightness}"
        colours = ", ".join(f"{key} × {number(gain)}" for key, gain in gains.items())
        return f"is of another colour ({colours}), {brightness}"
    if effect["name"] == "texture":
        return f"has a grain of {number(given['scale'])} px that varies it by {percent(given['amplitude'])}"
    return f"has {parameters(effect)}"


def _light(effect: Mapping[str, Any]) -> str:
    given = {key: each["value"] for key, each in effect["parameters"].items()}
    if effect["name"] == "light_direction":
        turns = (f"{key} {number(math.degrees(given[key]))}°" for key in ("azimuth", "elevation"))
        return f"the light comes from another direction ({', '.join(turns)})"
    if effect["name"] == "ambient":
        return f"{percent(given['share'])} of the light has no direction"
    if effect["name"] == "missing_object":
        x, y, width, height = (number(given[key]) for key in ("x", "y", "width", "height"))
        return f"{width} × {height} px from x {x}, y {y} on show something that was not rendered"
    return parameters(effect)


def measured(parameter: Mapping[str, Any]) -> str:
    """A parameter's value with its unit, in the digits that its interval leaves."""
    unit = f" {parameter['unit']}" if parameter["unit"] else ""
    return f"{rounded(parameter['value'], parameter['ci'])}{unit}"


def rounded(value: float, interval: Sequence[float]) -> str:
    """`value` in the digits that its interval leaves: two of its width."""
    width = abs(interval[1] - interval[0])
    if not 0 < width < math.inf:
        return number(value)
    return signed(f"{value:.{min(max(1 - math.floor(math.log10(width)), 0), 9)}f}")


def interval(parameter: Mapping[str, Any]) -> str:
    """95 % interval of a parameter."""
    return " to ".join(rounded(end, parameter["ci"]) for end in parameter["ci"])


def room(parameter: Mapping[str, Any]) -> str:
    """Between what a parameter of an effect without a name could be."""
    low, high = parameter["ci"]
    if high is None:
        ends = "anything" if low is None else f"at least {number(low)}"
    else:
        ends = f"at most {number(high)}" if low in (None, 0) else interval(parameter)
    return f"{ends} {parameter['unit']}".rstrip()


def number(value: float) -> str:
    """Three significant digits."""
    return signed(f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}")


def signed(text: str) -> str:
    """With a minus sign that is one."""
    return text.replace("-", "−")


def percent(share: float) -> str:
    """A share of 1 in per cent, with a decimal where it is close to all or nothing."""
    value = 100 * share
    text = f"{value:.0f}" if 5 <= abs(value) <= 95 else f"{value:.1f}".removesuffix(".0")
    return signed(f"{text} %").replace("−0 %", "0 %")


def interval_percent(ends: Sequence[float]) -> str:
    """An interval of shares in per cent."""
    return " to ".join(percent(end) for end in ends)


def floor_ratio(gap: Mapping[str, Any]) -> float:
    """The gap in units of measurement noise."""
    return gap["before"] / gap["floor"] if gap["floor"] else math.inf


def listed(items: Sequence[str]) -> str:
    """`a, b and c`."""
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)
