"""What a diagnosis ends with: the names that matter, and a simulator, which its report measures and its patch holds."""

from collections.abc import Mapping
from dataclasses import replace

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.diagnose.guesses import as_believed, finished, is_known, without_vague
from vision_s2r.diagnose.search import COINCIDENCE, Found
from vision_s2r.diagnose.settled import LEAST_SHARE, Settled, apart_from, is_slight
from vision_s2r.diagnose.simulator import BETTER, Simulator, simulator_at_end, simulator_of, surely
from vision_s2r.fit.case import Case, Names
from vision_s2r.fit.gap import Share

NEEDED = 0.5  # of what is left without it, more than noise, that a small effect closes; all must, beside guesses


def settle(case: Case, assessor: Assessor, found: Found) -> Settled:
    """The simulator of a search's end, without names that do not matter or do harm."""
    slight: Names = frozenset()
    whole: Simulator | None = None  # with all the names that do no harm
    while True:
        if lost := _faint(assessor, found) or _replaced(assessor, found) or _partial(assessor, found):
            found = _without(assessor, found, lost)
            continue
        firm = _firm(assessor, found)
        simulator = simulator_at_end(case, assessor, found, firm)
        harmful = found.effects - simulator.names - firm - apart_from(case, simulator, firm)
        if not found.is_open:  # nothing is left with them: a gap as small as the noise tells nothing of harm
            sure = frozenset(name for name in harmful if _needed(assessor, found, name))
            firm, harmful = firm | sure, harmful - sure
        found = replace(found, effects=found.effects - harmful)
        whole = whole or simulator
        if idle := _idle(case, assessor, found, simulator, firm, whole):
            found, slight = _without(assessor, found, idle), slight | {idle}
            continue
        settled = Settled.of(case, assessor, found, simulator, firm, harmful, slight)
        weak = _weak(case, assessor, settled)
        if not weak:
            return finished(case, assessor, without_vague(case, assessor, settled))
        least = min(weak, key=lambda name: float(settled.parts[name].sum()))
        slight |= {least} - case.refitted
        found = replace(found, effects=found.effects - {least}) if weak[least] else _without(assessor, found, least)


def _faint(assessor: Assessor, found: Found) -> str | None:
    """The name that does least, where that is lost in the noise, and without it no more than noise is left."""
    if not assessor.cfg.faint:
        return None
    less = {name: _less(assessor, found, name) for name in found.effects - frozenset(assessor.case.certain)}
    reliefs = {
        name: assessor.gain(found.final, without).relief for name, without in less.items() if assessor.adequate(without)
    }
    least = _least(reliefs)
    return least if least and reliefs[least] <= assessor.cfg.faint else None


def _replaced(assessor: Assessor, found: Found) -> str | None:
    """The name that brings least beside something unknown, where that is too little for a name: it does its work.

    Not where nominal values are refitted, which share that work.
    """
    if not found.unknown or found.final.evidence is not None or assessor.case.refitted:
        return None
    named = found.effects - frozenset(assessor.case.certain)
    nats = {name: assessor.gain(found.final, _less(assessor, found, name)).nats for name in named}
    least = _least(nats)
    return least if least and nats[least] <= assessor.cfg.evidence else None


def _partial(assessor: Assessor, found: Found) -> str | None:
    """The name that is furthest from doing all of its part, where something is left: it may be doing another's."""
    asked = assessor.cfg.mostly
    if not (asked and found.is_open):
        return None
    known = found.final.names - found.unknown
    rest = assessor.one(known, found.final.hypothesis).rest
    without = {
        name: assessor.one(known - {name}, found.final.hypothesis).rest
        for name in found.effects - frozenset(assessor.case.certain)
    }
    least = _least(without)
    return least if least and rest > asked * without[least] else None


def _weak(case: Case, assessor: Assessor, settled: Settled) -> dict[str, bool]:
    """Names that close too little of the gap, are of noise, may be as they were, vague or wavering; and which may stay.

    Those stay in the simulator without being named: nominal parameters, and where something is left an effect that
    takes much of that away.
    """
    found, weak = settled.found, {}
    for name in sorted(found.effects - frozenset(case.certain)):
        share, firm = settled.share(name), name in settled.firm
        open_ended = found.is_open and not assessor.cfg.plain
        # Of a servo's gap, which shows in few stretches, a large share that may be nothing as soon is a stand-in's.
        doubtful = bool(case.guessed) and open_ended and share.ci[0] < LEAST_SHARE
        little = doubtful or (is_slight(share) and (firm or open_ended or not _needed(assessor, found, name)))
        doubted = bool(case.guessed) or found.final.evidence is not None  # by what nobody knows, or by an unknown
        vague = found.is_open and doubted and not is_known(case, found.final, name)
        vain = bool(name in case.replaced or case.refitted) and as_believed(case, found.final, name)
        fit = settled.source(name)[1]
        elsewhere = found.is_open and case.may_vanish(fit, name)  # and so the simulator is to have none of it, too
        vanishing = _of_noise(assessor, found, name, share) or vague or vain or elsewhere
        wavering = found.is_open and case.wavers(fit, name)
        if little or vanishing or wavering:
            stays = wavering or not (firm or vanishing)  # as large as it is on average
            helps = found.is_open and bool(case.refitted or assessor.cfg.plain) and stays
            weak[name] = name in case.refitted or name in case.measured or helps
    return weak


def _idle(
    case: Case, assessor: Assessor, found: Found, simulator: Simulator, firm: Names, whole: Simulator
) -> str | None:
    """The effect that brings least, where something is left, of those without which the simulator does about as well.

    Without it nominal parameters and other effects are fitted once more. Stretches of one motion are alike, other
    motions are not: what brings little on those is often lost on these. Nor do several go that bring much together:
    about as well as the `whole`, from which others have gone already.
    """
    if not (found.is_open and case.refitted):
        return None
    least = NEEDED if case.guessed else 1 - BETTER**2
    floor, idle = case.floor(range(case.segments)), {}
    for name in sorted(found.effects - frozenset(case.certain) - case.refitted - firm):
        fitted = assessor.one(simulator.names - {name}, simulator.hypothesis)
        without = simulator_of(case, assessor, fitted, fitted.names).error
        much = any(surely(assessor, without - each.error, least, without - floor) for each in (simulator, whole))
        if not (much or _everywhere(assessor, simulator, fitted)):
            idle[name] = float((without - simulator.error).mean())
    return _least(idle)


def _everywhere(assessor: Assessor, simulator: Simulator, without: Assessment) -> bool:
    """Whether a simulator leaves half of what is left without a name, or less, of segments that count alike."""
    of = simulator.assessment
    alone = of.names == simulator.names  # nothing unknown beside it
    return alone and assessor.surely_most(of, without)


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


def _needed(assessor: Assessor, found: Found, name: str) -> bool:
    """Whether without this name more than noise is left, and most of that is its own.

    Beside play, or in a free run that drifts, an effect may be small in the gap and still be the rest of it; a support
    that is hardly tilted is, beside a wrong friction, and shows in long slides.
    """
    without = _less(assessor, found, name)
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
    without = _less(assessor, found, name)
    return bool((without.excess - found.final.excess).max() <= assessor.cfg.adequate)


def _without(assessor: Assessor, found: Found, name: str) -> Found:
    """A search's end without an effect."""
    return replace(found, effects=found.effects - {name}, final=_less(assessor, found, name))


def _least(sizes: Mapping[str, float]) -> str | None:
    """The name of the least of these; of equals the first by name."""
    return min(sizes, key=lambda name: (sizes[name], name), default=None)


def _less(assessor: Assessor, found: Found, name: str) -> Assessment:
    """What a search ends with, fitted without a name."""
    return assessor.one(found.final.names - {name}, found.final.hypothesis)
