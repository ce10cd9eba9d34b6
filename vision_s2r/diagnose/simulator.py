"""What a diagnosis ends with: a simulator, which is what its report measures and its patch holds.

It has the effects that are named and the nominal parameters that the data ask for, and no discrepancy terms, which
nobody could take over: parameters that were found beside one are found once more without, or what it did in their place
would be missing. Where something is left, an effect has to lower the held-out error of a simulator whose nominal
parameters are all identified without it; with none that does, that one is what the diagnosis ends with.
"""

from dataclasses import dataclass, replace

import numpy as np

from vision_s2r.diagnose.assess import SURE, Assessment, Assessor
from vision_s2r.diagnose.search import COINCIDENCE, MOST, Found
from vision_s2r.diagnose.shares import closed, held_out, reduced
from vision_s2r.fit.case import Case, Hypothesis, Names
from vision_s2r.fit.gap import Gap, Share
from vision_s2r.statistics import lower_bound, shapley

BETTER = 0.95  # times the error, that another simulator must leave to be preferred to the one that was found first
LEAST_SHARE = 0.01  # of the gap, that the interval of a name's share must not reach below …
LARGE_SHARE = 0.05  # … unless its share is this large: one that few episodes show reaches 0 by their draw alone …
LITTLE = 0.1  # of the squared gap: beside what leaves no more, nominal parameters are causes, not stand-ins
NEEDED = 0.5  # … or more than noise is left without it, of which it closes this part; all must, beside guesses
UNKNOWN = "?"  # one more among the names of a set
WIDE = 10.0  # between the ends of its interval: a size that is known no better beside guesses and something unknown


@dataclass(frozen=True)
class Simulator:
    """Effects and nominal parameters with their values."""

    names: Names  # what it has: named effects, and nominal parameters that are refitted beside them
    hypothesis: Hypothesis  # from all segments
    assessment: Assessment  # that this is of, with the discrepancy terms that it had
    folds: tuple[Hypothesis, ...]  # from all segments but those of each fold
    error: np.ndarray  # [segments] mean squared error, each segment under the fold that has not seen it


@dataclass(frozen=True)
class Settled:
    """A search's end, and the simulator that comes of it."""

    found: Found  # its effects are those that matter
    simulator: Simulator
    harmful: Names  # effects that would have been named, but make held-out data worse
    slight: Names  # … and those that are there, but close next to nothing of the gap
    firm: Names  # sure beside something unknown: what is stated of them is of predictions, each segment's alike
    gap: Gap
    parts: dict[str, np.ndarray]  # [segments] of the squared gap that each name closes, by Shapley
    stated: dict[str, np.ndarray]  # … and what is said of each effect: where that is next to nothing, beside all others
    vague: Names = frozenset()  # guessed parameters that would be causes, but stand in for one that is

    def share(self, name: str) -> Share:
        """What is said of an effect's part of the gap, with its interval."""
        return _share(self.gap, self.stated[name], name in self.firm)

    def source(self, name: str) -> tuple[Hypothesis, Hypothesis]:
        """The hypothesis that has a name's values, and the fit that says how sure they are."""
        if name in self.simulator.names:
            return self.simulator.hypothesis, self.simulator.assessment.hypothesis
        return self.found.final.hypothesis, self.found.final.hypothesis

    def at(self, hypothesis: Hypothesis) -> "Settled":
        """With other values of the names that the simulator has."""
        simulator, fit = self.simulator, self.simulator.assessment.hypothesis
        fit = replace(fit, values={**fit.values, **hypothesis.values})
        assessment = replace(simulator.assessment, hypothesis=fit)
        return replace(self, simulator=replace(simulator, hypothesis=hypothesis, assessment=assessment))


def settle(case: Case, assessor: Assessor, found: Found) -> Settled:
    """The simulator of a search's end, without names that do not matter or do harm."""
    slight: Names = frozenset()
    whole: Simulator | None = None  # with all the names that do no harm
    while True:
        firm = _firm(assessor, found)
        simulator = _simulator(case, assessor, found, firm)
        harmful = found.effects - simulator.names - firm - _apart(case, simulator, firm)
        found = replace(found, effects=found.effects - harmful)
        whole = whole or simulator
        if idle := _idle(case, assessor, found, simulator, firm, whole):
            found, slight = _without(assessor, found, idle), slight | {idle}
            continue
        settled = Settled(found, simulator, harmful, slight, firm, *_parts(case, assessor, found, simulator, firm))
        weak = _weak(case, assessor, settled)
        if not weak:
            return _finished(case, assessor, _without_vague(case, assessor, settled))
        least = min(weak, key=lambda name: float(settled.parts[name].sum()))
        slight |= {least} - case.refitted
        found = replace(found, effects=found.effects - {least}) if weak[least] else _without(assessor, found, least)


def _finished(case: Case, assessor: Assessor, settled: Settled) -> Settled:
    """With what free runs are better with; a guessed parameter is a cause where it is one with that and without."""
    known = _with_causes(case, settled, case.guessed)
    more = _with_more(case, assessor, settled)
    return known if more is settled else _with_causes(case, more, known.found.effects)


def _apart(case: Case, simulator: Simulator, firm: Names) -> Names:
    """Names that are there, whether or not a free run is better for them, and are in none."""
    return frozenset(case.certain) - simulator.names - firm


def _parts(
    case: Case, assessor: Assessor, found: Found, simulator: Simulator, firm: Names
) -> tuple[Gap, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The gap, whose it is, and what is said of that."""
    apart = _apart(case, simulator, firm)
    refitted, before = (held_out(case, assessor, each.folds) for each in (found.refitted, found.nominal))
    gap = Gap(before, refitted, simulator.error, case.floor(range(case.segments)), assessor.seed)
    parts = dict.fromkeys(apart, np.zeros(case.segments)) | closed(case, assessor, simulator.names, simulator.folds)
    plain = found.effects - firm - apart
    sure = _of_predictions(case, assessor, found, firm)
    stated = parts | {name: _stated(case, assessor, simulator, gap, parts, name) for name in plain} | sure
    parts |= {name: part * (gap.before - gap.floor) for name, part in sure.items()}
    return gap, parts, stated


def _weak(case: Case, assessor: Assessor, settled: Settled) -> dict[str, bool]:
    """Names that close too little of the gap, are of noise, or of whose size nothing is known; and which may stay.

    Those stay in the simulator without being named: nominal parameters, and where something is left an effect that
    takes much of that away.
    """
    found, weak = settled.found, {}
    for name in sorted(found.effects - frozenset(case.certain)):
        share, firm = settled.share(name), name in settled.firm
        open_ended = _open(found) and not assessor.cfg.plain
        little = is_slight(share) and (firm or open_ended or not _needed(assessor, found, name))
        vague = _open(found) and case.guessed and not _known(case, found.final, name)
        vain = bool(case.refitted) and name not in case.refitted and _as_believed(case, found.final, name)
        vanishing = _of_noise(assessor, found, name, share) or vague or vain
        if little or vanishing:
            helps = open_ended and bool(case.refitted) and not (firm or vanishing)
            weak[name] = name in case.refitted or helps
    return weak


def _without_vague(case: Case, assessor: Assessor, settled: Settled) -> Settled:
    """Without guessed parameters that may well be what the simulator had, while one of them would be a cause.

    One at a time, where about as little is left: of two that stand in for each other nobody knows either, and without
    one the other is known.
    """
    least = min(_left(settled.simulator), float(settled.gap.refitted.mean()))
    while True:
        simulator = settled.simulator
        guessed = (simulator.names & case.guessed) - settled.found.effects
        vague = frozenset(name for name in guessed if _as_believed(case, simulator.assessment, name))
        causes = _causes(case, settled)
        if not vague & causes:
            return settled
        fits = (assessor.one(simulator.names - {name}, simulator.hypothesis) for name in sorted(vague))
        best = min((_of(case, assessor, each, each.names) for each in fits), key=_left)
        if _left(best) * BETTER**2 > least:
            return settled
        gap, parts, stated = _parts(case, assessor, settled.found, best, settled.firm)
        gone = settled.vague | ((simulator.names - best.names) & causes)
        settled = replace(settled, simulator=best, gap=gap, parts=parts, stated=stated, vague=gone)


def _with_more(case: Case, assessor: Assessor, settled: Settled) -> Settled:
    """With effects that free runs of several motions are surely better with, where something is left beside guesses.

    Unnamed: predictions may not agree on their size, and stretches of one motion would take what is wrong on others.
    """
    if not (_open(settled.found) and case.guessed and case.motions > 1):
        return settled
    simulator = settled.simulator
    while more := _one_more(case, assessor, simulator, settled.harmful):
        simulator = more
    if simulator is settled.simulator:
        return settled
    slight = settled.slight | (simulator.names - settled.simulator.names)
    gap, parts, stated = _parts(case, assessor, settled.found, simulator, settled.firm)
    return replace(settled, simulator=simulator, slight=slight, gap=gap, parts=parts, stated=stated)


def _one_more(case: Case, assessor: Assessor, simulator: Simulator, harmful: Names) -> Simulator | None:
    """The simulator with the effect that free runs are best with, if they surely are better with one."""
    free = sorted(case.library.keys() - simulator.names - case.not_excited.keys() - harmful)
    gains = case.screen(simulator.hypothesis, free)
    promising = sorted((name for name in free if gains[name] > assessor.cfg.evidence), key=lambda name: -gains[name])
    wanted = [(simulator.names | {name}, simulator.hypothesis) for name in promising[: assessor.cfg.contenders]]
    # An encoder without steps has no size.
    fits = [each for each in assessor.assess(wanted) if all(each.hypothesis.values.values())]
    best = min((_of(case, assessor, each, each.names) for each in fits), key=_left, default=simulator)
    relief, rest = simulator.error - best.error, simulator.error - case.floor(range(case.segments))
    return best if _surely(assessor, relief, 1 - BETTER**2, rest) else None


def _surely(assessor: Assessor, relief: np.ndarray, share: float, rest: np.ndarray) -> bool:
    """Whether what is gained [segments] is this share of what was left, or more, and surely something."""
    return bool(relief.mean() >= share * rest.mean()) and lower_bound(relief, SURE, assessor.seed) > 0


def _left(simulator: Simulator) -> float:
    return float(simulator.error.mean())


def _with_causes(case: Case, settled: Settled, among: Names) -> Settled:
    """With the guessed parameters, of these, that are causes, and known to differ from what they were guessed to be."""
    found, simulator = settled.found, settled.simulator
    # Names that are sure beside something unknown may be in no simulator: then theirs is the fit that counts.
    final = simulator.assessment if found.effects <= simulator.names else found.final
    causes = (_causes(case, settled) - found.effects) & final.names & among
    causes = frozenset(name for name in causes if not _as_believed(case, simulator.assessment, name))
    if not causes:
        return settled
    found = replace(found, final=final, effects=found.effects | causes)
    return replace(settled, found=found, stated=settled.stated | {name: settled.parts[name] for name in causes})


def _causes(case: Case, settled: Settled) -> Names:
    """Guessed parameters that are causes although something is left: little is, and they close much of the gap."""
    gap = settled.gap
    if gap.after.mean() > LITTLE * gap.before.mean():
        return frozenset()
    guessed = (settled.simulator.names & case.guessed) - frozenset(case.not_excited)
    return frozenset(name for name in guessed if gap.share(settled.parts[name]).ci[0] > LARGE_SHARE)


def is_slight(share: Share) -> bool:
    """Whether an effect of this share of the gap closes too little of it to be named."""
    return share.ci[0] < LEAST_SHARE and share.value < LARGE_SHARE


def _without(assessor: Assessor, found: Found, name: str) -> Found:
    """A search's end without an effect."""
    final = assessor.one(found.final.names - {name}, found.final.hypothesis)
    return replace(found, effects=found.effects - {name}, final=final)


def _firm(assessor: Assessor, found: Found) -> Names:
    """Effects that are sure beside something unknown: with them predictions leave little, without one they leave more.

    What the unknown does to a free run hides them there, and nominal parameters refitted without it undo them. Beside a
    coincidence of unknowns nothing is sure.
    """
    if found.final.evidence is None:
        little = assessor.adequate(found.final) or assessor.little(found.final)
        if not (little and 0 < len(found.unknown) < COINCIDENCE):
            return frozenset()
    return frozenset(name for name in found.effects if _needed(assessor, found, name))


def _of_predictions(case: Case, assessor: Assessor, found: Found, firm: Names) -> dict[str, np.ndarray]:
    """The share [segments] that firm names have in what the search's predictions miss of each segment: Shapley's.

    Beside the unknown, which has a share of its own; a free run has none of that. A segment in which the unknown is
    large does not drown the others.
    """
    if not firm:
        return {}
    final = found.final
    rest = final.names - firm

    def left(on: frozenset[str]) -> np.ndarray:
        names = frozenset(on - {UNKNOWN}) | (rest if UNKNOWN in on else frozenset())
        folds = tuple(reduced(fold, names, final.names) for fold in final.folds)
        return held_out(case, assessor, folds, case.excess)

    parts = shapley([*sorted(firm), UNKNOWN], lambda on: -left(on))
    whole = np.maximum(sum(parts.values()), 1e-12)
    return {name: np.clip(parts[name] / whole, 0.0, 1.0) for name in firm}


def _share(gap: Gap, part: np.ndarray, alike: bool) -> Share:
    """The share of the gap that a part [segments] is; or the mean of shares, of segments that are `alike`."""
    return replace(gap, before=np.ones(len(part)), floor=np.zeros(len(part))).share(part) if alike else gap.share(part)


def _idle(
    case: Case, assessor: Assessor, found: Found, simulator: Simulator, firm: Names, whole: Simulator
) -> str | None:
    """The effect that brings least, where something is left, of those without which the simulator does about as well.

    Without it nominal parameters and other effects are fitted once more. Stretches of one motion are alike, other
    motions are not: what brings little on those is often lost on these. Nor do several go that bring much together:
    about as well as the `whole`, from which others have gone already.
    """
    if not (_open(found) and case.refitted):
        return None
    least = NEEDED if case.guessed else 1 - BETTER**2
    floor, idle = case.floor(range(case.segments)), {}
    for name in sorted(found.effects - frozenset(case.certain) - case.refitted - firm):
        fitted = assessor.one(simulator.names - {name}, simulator.hypothesis)
        without = _of(case, assessor, fitted, fitted.names).error
        much = any(_surely(assessor, without - each.error, least, without - floor) for each in (simulator, whole))
        if not (much or _everywhere(assessor, simulator, fitted)):
            idle[name] = float((without - simulator.error).mean())
    return min(idle, key=lambda name: (idle[name], name), default=None)


def _everywhere(assessor: Assessor, simulator: Simulator, without: Assessment) -> bool:
    """Whether a simulator leaves half of what is left without a name, or less, of segments that count alike."""
    of = simulator.assessment
    alone = of.names == simulator.names  # nothing unknown beside it
    return alone and assessor.surely_most(of, without)


def _stated(
    case: Case, assessor: Assessor, simulator: Simulator, gap: Gap, parts: dict[str, np.ndarray], name: str
) -> np.ndarray:
    """The part [segments] of the squared gap that is said to be a name's."""
    if not is_slight(gap.share(parts[name])):
        return parts[name]
    beside = _beside(case, assessor, simulator, name)
    return parts[name] if is_slight(gap.share(beside)) else beside


def _needed(assessor: Assessor, found: Found, name: str) -> bool:
    """Whether without this name more than noise is left, and most of that is its own.

    Beside play, or in a free run that drifts, an effect may be small in the gap and still be the rest of it; a support
    that is hardly tilted is, beside a wrong friction, and shows in long slides.
    """
    without = assessor.one(found.final.names - {name}, found.final.hypothesis)
    if found.final.evidence is not None:
        return assessor.gain(found.final, without).nats > assessor.cfg.evidence
    if assessor.cfg.plain and assessor.plain(found.final, without):
        return True
    return not assessor.adequate(without) and assessor.gain(found.final, without).share >= NEEDED


def _of_noise(assessor: Assessor, found: Found, name: str, share: Share) -> bool:
    """Whether a name's share may be nothing, and is of a gap that is noise: no segment shows more than that of it.

    Enough rows bring nats for what is a hundredth of their noise, and a share of next to nothing may well be large.
    """
    if share.ci[0] >= LEAST_SHARE or not assessor.adequate(found.nominal):
        return False
    without = assessor.one(found.final.names - {name}, found.final.hypothesis)
    return bool((without.excess - found.final.excess).max() <= assessor.cfg.adequate)


def _open(found: Found) -> bool:
    """Whether something is left that nothing explains."""
    return bool(found.unknown) or not found.adequate


def _known(case: Case, of: Assessment, name: str) -> bool:
    """Whether it is known how large an effect is: at least one of its parameters, within a factor of WIDE."""
    intervals = np.array(list(case.intervals(of.hypothesis)[name].values()))
    return bool((intervals.prod(axis=1) * WIDE > (intervals**2).max(axis=1)).any())


def _as_believed(case: Case, of: Assessment, name: str) -> bool:
    """Whether each parameter of an effect may well be what the simulator had: nominal values do all of its work."""
    intervals = case.intervals(of.hypothesis)[name]
    had = {each.name: each.neutral for each in case.library[name].parameters}
    had |= {"value": case.replaced[name]} if name in case.replaced else {}
    kept = [(low, had[key], high) for key, (low, high) in intervals.items()]
    return all(value is not None and low <= value <= high for low, value, high in kept)


def _beside(case: Case, assessor: Assessor, simulator: Simulator, name: str) -> np.ndarray:
    """The part [segments] of the squared gap that a name closes beside all others.

    Shapley's value may be nothing, or less, where an effect helps in the company of another only: blur beside noise.
    """
    others = simulator.names - {name}
    without = tuple(reduced(fold, others, simulator.names) for fold in simulator.folds)
    return held_out(case, assessor, without) - simulator.error


def _simulator(case: Case, assessor: Assessor, found: Found, firm: Names) -> Simulator:
    """What the named effects make of the simulator, or one that is merely identified, where that does as well.

    Firm names are in it where it is better for them. The simulator as it came where nothing is to be mended, or all are
    worse.
    """
    nominal = _of(case, assessor, found.nominal, frozenset())
    if not found.effects and assessor.adequate(found.nominal):
        return nominal
    best = _of(case, assessor, found.final, found.final.names - found.unknown - firm)
    if _open(found):
        effects = found.effects - firm
        identified = _identified(case, assessor, found)
        anew = assessor.one(effects | found.identified.names, found.final.hypothesis)
        best = _better(_of(case, assessor, anew, anew.names), best)
        others = best.names - case.refitted
        best = identified if others <= frozenset(case.certain) else _better(identified, best)
        if firm:  # as they are beside the unknown; or fitted without it, where they leave about as little
            anew = assessor.one(found.effects | found.identified.names, found.final.hypothesis)
            alone = anew.rest <= MOST * max(found.final.rest, assessor.cfg.adequate)
            fits = (found.final, anew) if alone else (found.final,)
            best = min(best, *(_of(case, assessor, each, each.names - found.unknown) for each in fits), key=_left)
    return best if best.error.mean() < nominal.error.mean() else nominal


def _identified(case: Case, assessor: Assessor, found: Found) -> Simulator:
    """No effect but what is certain, and every nominal parameter.

    A gain takes the place of one of them where that is better, or says the same beside a value that is no guess.
    """
    whole = found.identified
    best = _of(case, assessor, whole, whole.names)
    for names in case.simplify(whole.names)[:1]:
        gain = assessor.one(names)
        other = _of(case, assessor, gain, names)
        same = whole.score - gain.score <= assessor.cfg.evidence and not whole.names - names <= case.guessed
        best = other if same else _better(other, best)
    return best


def _better(other: Simulator, best: Simulator) -> Simulator:
    return other if other.error.mean() < BETTER**2 * best.error.mean() else best


def _of(case: Case, assessor: Assessor, assessment: Assessment, names: Names) -> Simulator:
    """The simulator of a fit, with only these of its names."""
    alone = [reduced(each, names, assessment.names) for each in (assessment.hypothesis, *assessment.folds)]
    error = held_out(case, assessor, tuple(alone[1:]))
    return Simulator(names, alone[0], assessment, tuple(alone[1:]), error)
