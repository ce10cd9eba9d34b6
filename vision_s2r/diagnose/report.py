"""The report of a diagnosis, as RECORDING.md has it."""

from dataclasses import replace
from typing import Any

import numpy as np

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.diagnose.bounds import bounds
from vision_s2r.diagnose.locate import where
from vision_s2r.diagnose.search import Found
from vision_s2r.diagnose.settled import LEAST_SHARE, Settled, is_slight
from vision_s2r.fit.case import Case, Experiment, Hypothesis, Names, intervals_of
from vision_s2r.fit.gap import Gap, Share
from vision_s2r.report.reading import FORMAT

ALTERNATIVES = 3
OPEN = ("partly_explained", "unexplained")  # verdicts that leave a part of the gap
OF_EFFECT = 2  # places of each named effect
SLIGHT = (
    f"it closes less than {LEAST_SHARE:.0%} of the gap, or may do so, or of one that is noise, or others do about as "
    "well without it"
)
REFITTED = "it is refitted, to another value than was believed, and what is left may be to blame"
NEAR_FLOOR = 5.0  # times the floor: a gap this large is neither explained nor none, be it of rare instants
MORE = "Record more of it, under conditions that differ more from each other than these."
LEFT, HIDDEN = "A part of the gap is left.", "Small effects may hide in this recording."


def report(
    case: Case, assessor: Assessor, settled: Settled, bounded: bool = False
) -> tuple[dict[str, Any], Experiment]:
    """Everything that the diagnosis says, as plain data, and the recording to make next.

    `bounded`: and how large each effect without a name could be, which takes fits.
    """
    found, simulator, gap = settled.found, settled.simulator, settled.gap
    equivalent = _equivalent(case, assessor, found)
    not_excited = {name: why for name, why in case.not_excited.items() if name not in found.effects}
    said = verdict(assessor, settled)
    effects = [_effect(case, assessor, settled, said, name) for name in sorted(found.effects)]
    candidates = _candidates(case, assessor, settled, equivalent, said)
    experiment = _next(case, assessor, found, equivalent, sorted(not_excited), said)
    written = {
        "format": FORMAT,
        "kind": case.kind,
        "verdict": said,
        "gap": _gap(case, gap),
        "sources": _sources(case, settled),
        "where": _places(case, assessor, settled),
        "effects": sorted(effects, key=lambda effect: -effect["share"]),
        "refitted": [_refitted(case, settled, said, name) for name in sorted(simulator.names - found.effects)],
        "withheld": sorted(settled.harmful),
        "candidates": _with_bounds(case, assessor, settled, candidates) if bounded else candidates,
        "alternatives": _alternatives(case, assessor, found),
        "unexplained": _unexplained(case, assessor, settled, said),
        "next_experiment": experiment.sentence,
    }
    return written, experiment


def verdict(assessor: Assessor, settled: Settled) -> str:
    """no_gap, explained, partly_explained or unexplained."""
    found, gap, unsteady = settled.found, settled.gap, bool(assessor.case.unsteady)
    near = gap.after.mean() < NEAR_FLOOR**2 * gap.floor.mean()
    if found.effects:
        little = found.adequate and not found.unknown and not unsteady and near
        # Steps that are predicted to the noise may add up to a free run that nominal values alone predict better.
        if little and not gap.shrink(gap.after, gap.refitted).ci[1] < 0:
            return "explained"
        return "unexplained" if _beside_the_point(assessor.case, settled) else "partly_explained"
    if found.unknown or unsteady or settled.harmful or not (near and assessor.adequate(found.nominal)):
        return "unexplained"
    return "no_gap"


def _beside_the_point(case: Case, settled: Settled) -> bool:
    """Whether nothing is named but what is certain, such as an encoder's steps, and that closes none of the gap."""
    names = settled.found.effects
    return names <= frozenset(case.certain) and all(is_slight(settled.share(name)) for name in names)


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


def _sources(case: Case, settled: Settled) -> list[dict[str, Any]]:
    """The sources' shares of the squared gap; what is known to be there but has no name belongs to none."""
    found, gap, parts = settled.found, settled.gap, settled.parts
    names = {case.library[name].source for name in found.effects}
    sources = []
    for source in sorted(names):
        part = sum(parts[name] for name in found.effects if case.library[name].source == source)
        sources.append({"source": source, **_share(gap.share(np.asarray(part)))})
    return sorted(sources, key=lambda each: -each["share"])


def _effect(case: Case, assessor: Assessor, settled: Settled, said: str, name: str) -> dict[str, Any]:
    return {
        **_named(name),
        "source": case.library[name].source,
        **_share(settled.share(name)),
        "evidence": _evidence(case, assessor, settled, name),
        "parameters": _parameters(case, settled, said, name),
        **({} if name in settled.simulator.names else {"patched": False}),
    }


def _named(name: str) -> dict[str, Any]:
    """The name of an effect, and the label that it is of."""
    label, dot, effect = name.rpartition(".")
    return {"name": effect, "label": int(label)} if dot else {"name": name}


def _refitted(case: Case, settled: Settled, said: str, name: str) -> dict[str, Any]:
    """What the simulator has without a name: a nominal parameter as the data ask for it, or what closes too little."""
    return {
        **_named(name),
        "source": case.library[name].source,
        "parameters": _parameters(case, settled, said, name),
    }


def _parameters(case: Case, settled: Settled, said: str, name: str) -> dict[str, Any]:
    hypothesis, fit = settled.source(name)
    values = hypothesis.values[name]
    # What is left of a gap may bend values, and bends them otherwise in another motion.
    intervals = intervals_of(case, fit, elsewhere=said in OPEN)[name]
    return {
        p.name: {"value": values[p.name], "unit": case.unit_of(p), "ci": list(intervals[p.name])}
        for p in case.library[name].parameters
        if not (p.optional and values[p.name] == p.neutral)
    }


def _equivalent(case: Case, assessor: Assessor, found: Found) -> list[Assessment]:
    """Sets of no more effects that this recording cannot tell from the found one, the likeliest first."""
    final, library = found.final, frozenset(case.library)
    swaps = [
        (final.names - {name} | {rival}, final.hypothesis)
        for name in sorted(found.effects & final.names)
        for rival in sorted(case.confusable(name) & library - final.names - frozenset(case.not_excited))
    ]
    swaps += [(names, final.hypothesis) for names in case.simplify(final.names) if len(names) <= len(final.names)]
    rivals = [each for each in assessor.rivals(swaps, final) if each.names != final.names]
    close = [each for each in rivals if assessor.gain(final, each).nats < assessor.cfg.evidence]
    return sorted(close, key=lambda each: -each.score)


def _candidates(
    case: Case, assessor: Assessor, settled: Settled, equivalent: list[Assessment], said: str
) -> list[dict[str, Any]]:
    """A line for every effect. What was never tried beside the diagnosis has the evidence of the cheap screen.

    Where something is left, an effect that would explain some of it is neither present nor ruled out.
    """
    found, final = settled.found, settled.found.final
    undecided: dict[str, float] = {}
    if said in OPEN:
        undecided = dict.fromkeys(settled.slight, -np.inf) | _undecided(case, assessor, settled)
    absent = [name for name in case.library if name not in final.names and name not in case.not_excited]
    untried = [name for name in absent if final.names | {name} not in assessor.assessed]
    screened = case.screen(final.hypothesis, untried)
    lines = []
    for name in case.library:
        line: dict[str, Any] = {**_named(name), "status": "absent", "evidence": 0.0, "confusable_with": []}
        if name in found.effects:
            line |= {"status": "present", "evidence": _evidence(case, assessor, settled, name)}
        elif name in case.not_excited:
            line |= {"status": "not_excited", "reason": case.not_excited[name]}
        else:
            tried = assessor.assessed.get(final.names | {name})
            line["evidence"] = screened[name] if tried is None else assessor.gain(tried, final).nats
            if name in final.names & settled.slight:
                line["evidence"] = _evidence(case, assessor, settled, name)
            instead = [other for other in equivalent if name in other.names - final.names]
            rivals = [(final.names - other.names) & found.effects for other in instead]
            rivals += [found.effects & case.guessed] if name in settled.vague else []
            if name in settled.slight:
                line["reason"] = SLIGHT
            elif name in undecided and name in found.refitted.names:
                line["reason"] = REFITTED
            if any(rivals):
                line |= {"status": "confusable", "confusable_with": sorted(frozenset().union(*rivals))}
            elif name in undecided or (said in OPEN and line["evidence"] > assessor.cfg.evidence):
                line |= {"status": "undecided", "evidence": max(undecided.get(name, -np.inf), line["evidence"])}
        lines.append(line)
    return lines


def _with_bounds(
    case: Case, assessor: Assessor, settled: Settled, candidates: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    lines = dict(zip(case.library, candidates, strict=True))
    asked = [name for name, line in lines.items() if line["status"] not in ("present", "not_excited")]
    found = bounds(case, assessor, settled, asked)
    return [line | ({"could_be": found[name]} if name in found else {}) for name, line in lines.items()]


def _undecided(case: Case, assessor: Assessor, settled: Settled) -> dict[str, float]:
    """Effects that the recording does not rule out, and what each would gain, or all refitted nominal parameters.

    Beside the simulator that is reported, or refitted nominal parameters where it has no effect; or beside what is
    unknown as well: a flexible unknown may do an effect's work, and without it the effect may not show.
    """
    found, refitted = settled.found, settled.found.refitted
    names = [name for name in case.library if name not in case.not_excited]
    end = settled.simulator if found.effects else refitted
    base, gains = end.hypothesis, dict[str, float]()
    if values := end.names & refitted.names - found.effects:
        whole, less = (assessor.one(some, base) for some in (end.names, end.names - values))
        together = assessor.gain(whole, less).nats  # one may do another's work
        gains = {name: together for name in names if name in values}
    for each in (base, found.final.hypothesis):
        free = [name for name in names if name not in each.values and name not in refitted.names]
        for name, gain in case.screen(each, free).items():
            gains[name] = max(gain, gains.get(name, gain))
    return {name: gain for name, gain in gains.items() if gain > assessor.cfg.evidence}


def _next(
    case: Case, assessor: Assessor, found: Found, equivalent: list[Assessment], not_excited: list[str], said: str
) -> Experiment:
    """The recording to make next; where the gap is unexplained, one that tells its likeliest explanations apart.

    Where nothing is to be told apart, one that shows more than this one does; cameras have none.
    """
    rivals = [found.final.hypothesis, *(each.hypothesis for each in equivalent)]
    if said == "unexplained":
        rivals += _likeliest(case, assessor, found)
    found_next = case.experiment(rivals, not_excited)
    if not found_next.open:
        return replace(found_next, sentence=f"{LEFT if said in OPEN else HIDDEN} {found_next.sentence}")
    return found_next if found_next.sentence or said not in OPEN else Experiment(MORE)


def _likeliest(case: Case, assessor: Assessor, found: Found) -> list[Hypothesis]:
    """The best sets of effects that were tried, without discrepancy terms."""
    discrepancies = frozenset(case.discrepancies)
    plain = [each for each in assessor.assessed.values() if not each.names & discrepancies]
    best = sorted((each for each in plain if each.names - case.refitted), key=lambda each: -each.score)
    return [each.hypothesis for each in best[:ALTERNATIVES] if each.names != found.final.names]


def _evidence(case: Case, assessor: Assessor, settled: Settled, name: str) -> float:
    """Nats that a named effect brings beside the others, or by its own signature.

    Beside something unknown, which may do its work there, or in the simulator that has nothing unknown.
    """
    signature = {**case.certain, **case.measured, **settled.witnessed}
    ends = [settled.found.final]
    if settled.simulator.assessment.names == settled.simulator.names:
        ends.append(settled.simulator.assessment)
    gains = (
        assessor.gain(end, assessor.one(end.names - {name}, end.hypothesis)).nats for end in ends if name in end.names
    )
    return max([*gains, signature.get(name, 0.0)])


def _places(case: Case, assessor: Assessor, settled: Settled) -> list[dict[str, Any]]:
    """Where the named effects do what they do, those of the largest first; then where the whole gap lies.

    Of an effect the axes are those of its definition, and shares are of what it does, in which there is no noise: any
    place that has more than its samples will do where none surely stands out.
    """
    found, places = settled.found, []
    for name in sorted(found.effects, key=lambda each: -settled.share(each).value):
        moved = case.moved(settled.source(name)[0], name)
        if moved:
            there = where(moved, assessor.seed) or where(moved, assessor.seed, lift=0.0)
            places += [{**place, "effect": name} for place in there[:OF_EFFECT]]
    return [*places, *where(case.samples(found.nominal.hypothesis), assessor.seed)]


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


def _unexplained(case: Case, assessor: Assessor, settled: Settled, said: str) -> dict[str, Any]:
    """What the simulator leaves over the floor, where that lies, and which unknown function it needs."""
    found, gap = settled.found, settled.gap
    places = where(case.samples(settled.simulator.hypothesis), assessor.seed) if said in OPEN else []
    return {
        **_share(gap.share(gap.after - gap.floor)),
        "where": places,
        "resembles": [case.unsteady] * bool(case.unsteady) + [case.discrepancies[name] for name in found.resembles],
    }
