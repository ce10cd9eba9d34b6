"""The report of a diagnosis, as RECORDING.md has it."""

from typing import Any

import numpy as np

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.diagnose.locate import where
from vision_s2r.diagnose.search import Found
from vision_s2r.diagnose.shares import measure, shapley
from vision_s2r.fit.case import Case, Names
from vision_s2r.fit.gap import Gap, Share
from vision_s2r.report.reading import FORMAT

ALTERNATIVES = 3


def report(case: Case, assessor: Assessor, found: Found) -> dict[str, Any]:
    """Everything that the diagnosis says, as plain data."""
    gap = measure(case, assessor, found)
    parts = shapley(case, assessor, found)
    effects = [_effect(case, assessor, found, gap, name, parts[name]) for name in sorted(found.effects)]
    equivalent = _equivalent(case, assessor, found)
    not_excited = {name: why for name, why in case.not_excited.items() if name not in found.effects}
    rivals = [found.final.hypothesis, *(each.hypothesis for each in equivalent)]
    return {
        "format": FORMAT,
        "kind": case.kind,
        "verdict": verdict(assessor, found),
        "gap": _gap(case, gap),
        "sources": _sources(case, found, gap, parts),
        "where": where(case.samples(found.nominal.hypothesis), assessor.seed),
        "effects": sorted(effects, key=lambda effect: -effect["share"]),
        "candidates": _candidates(case, assessor, found, equivalent),
        "alternatives": _alternatives(case, assessor, found),
        "unexplained": _unexplained(case, assessor, found, gap, parts),
        "next_experiment": case.experiment(rivals, sorted(not_excited)),
    }


def verdict(assessor: Assessor, found: Found) -> str:
    """no_gap, explained, partly_explained or unexplained."""
    if found.effects:
        return "explained" if found.adequate and not found.unknown else "partly_explained"
    if found.unknown or not assessor.adequate(found.nominal):
        return "unexplained"
    return "no_gap"


def _gap(case: Case, gap: Gap) -> dict[str, Any]:
    def root(errors: np.ndarray) -> float:
        return float(np.sqrt(errors.mean()))

    shrink, by_values = gap.shrink(gap.after), gap.shrink(gap.refitted)
    by_effects = gap.shrink(gap.after, gap.refitted)
    return {
        "metric": case.metric,
        "unit": case.unit,
        "described": case.described,
        "before": root(gap.before),
        "refitted": root(gap.refitted),
        "after": root(gap.after),
        "floor": root(gap.floor),
        "shrink": shrink.value,
        "shrink_ci": list(shrink.ci),
        "shrink_by_refitting": _share(by_values),
        "shrink_by_effects": _share(by_effects),
    }


def _share(share: Share) -> dict[str, Any]:
    return {"share": share.value, "ci": list(share.ci)}


def _sources(case: Case, found: Found, gap: Gap, parts: dict[str, np.ndarray]) -> list[dict[str, Any]]:
    """The four sources' shares of the squared gap; what is known to be there but has no name belongs to none."""
    names = {case.library[name].source for name in found.effects}
    sources = []
    for source in sorted(names):
        part = sum(parts[name] for name in found.effects if case.library[name].source == source)
        sources.append({"source": source, **_share(gap.share(np.asarray(part)))})
    return sorted(sources, key=lambda each: -each["share"])


def _effect(case: Case, assessor: Assessor, found: Found, gap: Gap, name: str, part: np.ndarray) -> dict[str, Any]:
    effect, values = case.library[name], found.final.hypothesis.values[name]
    intervals = case.intervals(found.final.hypothesis)[name]
    return {
        "name": name,
        "source": effect.source,
        **_share(gap.share(part)),
        "evidence": _evidence(case, assessor, found, name),
        "parameters": {
            p.name: {"value": values[p.name], "unit": case.unit_of(p), "ci": list(intervals[p.name])}
            for p in effect.parameters
        },
    }


def _equivalent(case: Case, assessor: Assessor, found: Found) -> list[Assessment]:
    """Sets of no more effects that this recording cannot tell from the found one, the likeliest first."""
    final, library = found.final, frozenset(case.library)
    swaps = [
        (final.names - {name} | {rival}, final.hypothesis)
        for name in sorted(found.effects)
        for rival in sorted(case.confusable(name) & library - final.names - frozenset(case.not_excited))
    ]
    swaps += [(names, final.hypothesis) for names in case.simplify(final.names) if len(names) <= len(final.names)]
    rivals = [each for each in assessor.assess(swaps) if each.names != final.names]
    close = [each for each in rivals if assessor.gain(final, each).nats < assessor.cfg.evidence]
    return sorted(close, key=lambda each: -each.score)


def _candidates(case: Case, assessor: Assessor, found: Found, equivalent: list[Assessment]) -> list[dict[str, Any]]:
    """A line for every effect. What was never tried beside the diagnosis has the evidence of the cheap screen."""
    final = found.final
    absent = [name for name in case.library if name not in final.names and name not in case.not_excited]
    untried = [name for name in absent if final.names | {name} not in assessor.assessed]
    screened = case.screen(final.hypothesis, untried)
    lines = []
    for name in case.library:
        line: dict[str, Any] = {"name": name, "status": "absent", "evidence": 0.0, "confusable_with": []}
        if name in found.effects:
            line |= {"status": "present", "evidence": _evidence(case, assessor, found, name)}
        elif name in case.not_excited:
            line |= {"status": "not_excited", "reason": case.not_excited[name]}
        else:
            tried = assessor.assessed.get(final.names | {name})
            line["evidence"] = screened[name] if tried is None else assessor.gain(tried, final).nats
            rivals = [(final.names - other.names) & found.effects for other in equivalent if name in other.names]
            if any(rivals):
                line |= {"status": "confusable", "confusable_with": sorted(frozenset().union(*rivals))}
        lines.append(line)
    return lines


def _evidence(case: Case, assessor: Assessor, found: Found, name: str) -> float:
    """Nats that a named effect brings beside the others, or by its own signature."""
    without = assessor.one(found.final.names - {name}, found.final.hypothesis)
    return max(assessor.gain(found.final, without).nats, case.certain.get(name, 0.0))


def _alternatives(case: Case, assessor: Assessor, found: Found) -> list[dict[str, Any]]:
    """The likeliest other sets of named effects, with their evidence against the simulator as it came."""
    discrepancies, plain = frozenset(case.discrepancies), found.final.names
    others: dict[Names, Assessment] = {}
    for each in assessor.assessed.values():
        effects = each.names - discrepancies - case.refitted
        if each.names & discrepancies or not effects or effects == plain - discrepancies - case.refitted:
            continue
        if effects not in others or each.score > others[effects].score:
            others[effects] = each
    best = sorted(others.values(), key=lambda each: -each.score)[:ALTERNATIVES]
    return [
        {
            "effects": sorted(each.names - case.refitted),
            "evidence": assessor.gain(each, found.nominal).nats,
        }
        for each in best
    ]


def _unexplained(
    case: Case, assessor: Assessor, found: Found, gap: Gap, parts: dict[str, np.ndarray]
) -> dict[str, Any]:
    """What no named effect explains: the rest over the floor, and what needed an unknown function."""
    rest = gap.after - gap.floor + sum(parts[name] for name in found.unknown)
    places = (
        []
        if verdict(assessor, found) in ("no_gap", "explained")
        else where(case.samples(found.final.hypothesis), assessor.seed)
    )
    return {
        **_share(gap.share(np.asarray(rest))),
        "where": places,
        "resembles": [case.discrepancies[name] for name in sorted(found.resembles)],
    }
