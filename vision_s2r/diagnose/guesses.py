"""The end of a search where a simulator's nominal values are wrong, though something else is left.

A guess that is off, as a position servo's may be, is a cause, unless it may well be what the simulator had; a value
that was measured is one where next to nothing is left with it. Effects that free runs of several motions are surely
better with stay in the simulator without a name.
"""

from dataclasses import replace

import numpy as np

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.diagnose.search import Found
from vision_s2r.diagnose.settled import LARGE_SHARE, Settled
from vision_s2r.diagnose.simulator import BETTER, Simulator, simulator_of, surely
from vision_s2r.fit.case import Case, Names, intervals_of

LITTLE = 0.1  # of the squared gap: beside what leaves no more, guessed parameters are causes, not stand-ins
HARDLY = 0.01  # … and measured ones, that close so much of it that they do no unknown's work: that leaves more
MUCH_SHARE = 0.25  # of the gap, that the interval of a measured value's share must not reach below
UNLIKE_UNKNOWNS = frozenset({"inertia"})  # that no function of motion or command does the work of
WIDE = 10.0  # between the ends of its interval: a size that is known no better beside guesses and something unknown


def finished(case: Case, assessor: Assessor, settled: Settled) -> Settled:
    """With what free runs are better with; a nominal parameter is a cause where it is one with that and without."""
    known = _with_causes(case, assessor, settled, frozenset(case.library))
    more = _with_more(case, assessor, settled)
    return known if more is settled else _with_causes(case, assessor, more, known.found.effects)


def _off(case: Case, simulator: Simulator) -> Names:
    """Nominal values that another motion would find off, too."""
    nominal = [name for name in simulator.names if case.library[name].source == "dynamics"]
    return frozenset(name for name in nominal if not as_believed(case, simulator.assessment, name, elsewhere=True))


def without_vague(case: Case, assessor: Assessor, settled: Settled) -> Settled:
    """Without guessed parameters that may well be what the simulator had, while one of them would be a cause.

    One at a time, where about as little is left: of two that stand in for each other nobody knows either, and without
    one the other is known.
    """
    least = min(settled.simulator.left, float(settled.gap.refitted.mean()))
    while True:
        simulator = settled.simulator
        guessed = (simulator.names & case.guessed) - settled.found.effects
        vague = frozenset(name for name in guessed if as_believed(case, simulator.assessment, name))
        causes = _causes(case, settled)
        if not vague & causes:
            return settled
        fits = (assessor.one(simulator.names - {name}, simulator.hypothesis) for name in sorted(vague))
        best = min((simulator_of(case, assessor, each, each.names) for each in fits), key=lambda one: one.left)
        if best.left * BETTER**2 > least:
            return settled
        gone = settled.vague | ((simulator.names - best.names) & causes)
        settled = replace(settled.with_simulator(case, assessor, best), vague=gone)


def _with_more(case: Case, assessor: Assessor, settled: Settled) -> Settled:
    """With effects that free runs of several motions are surely better with, where something is left beside guesses.

    Unnamed: predictions may not agree on their size, and stretches of one motion would take what is wrong on others.
    """
    if not (settled.found.is_open and case.guessed and case.motions > 1):
        return settled
    simulator = settled.simulator
    while more := _one_more(case, assessor, simulator, settled.harmful):
        simulator = more
    if simulator is settled.simulator:
        return settled
    slight = settled.slight | (simulator.names - settled.simulator.names)
    return replace(settled.with_simulator(case, assessor, simulator), slight=slight)


def _one_more(case: Case, assessor: Assessor, simulator: Simulator, harmful: Names) -> Simulator | None:
    """The simulator with the effect that free runs are best with, if they surely are better with one."""
    free = sorted(case.library.keys() - simulator.names - case.not_excited.keys() - harmful)
    gains = case.screen(simulator.hypothesis, free)
    promising = sorted((name for name in free if gains[name] > assessor.cfg.evidence), key=lambda name: -gains[name])
    wanted = [(simulator.names | {name}, simulator.hypothesis) for name in promising[: assessor.cfg.contenders]]
    fits = [each for each in assessor.assess(wanted) if each.is_sized]
    tried = [simulator_of(case, assessor, each, each.names) for each in fits]
    best = min(tried, key=lambda each: each.left, default=simulator)
    relief, rest = simulator.error - best.error, simulator.error - case.floor(range(case.segments))
    return best if surely(assessor, relief, 1 - BETTER**2, rest) else None


def _with_causes(case: Case, assessor: Assessor, settled: Settled, among: Names) -> Settled:
    """With the nominal parameters, of these, that are causes, and known to differ from what was believed."""
    found, simulator = settled.found, settled.simulator
    # Names that are sure beside something unknown may be in no simulator: then theirs is the fit that counts.
    final = simulator.assessment if found.effects <= simulator.names else found.final
    causes = ((_causes(case, settled) | _measured(case, assessor, settled)) - found.effects) & final.names & among
    causes = frozenset(name for name in causes if not as_believed(case, simulator.assessment, name))
    if not causes:
        return settled
    found = replace(found, final=final, effects=found.effects | causes)
    return replace(settled, found=found, stated=settled.stated | {name: settled.parts[name] for name in causes})


def _causes(case: Case, settled: Settled) -> Names:
    """Guessed parameters that are causes although something is left: little is, and they close much of the gap."""
    gap = settled.gap
    guessed = settled.parts.keys() & case.guessed - case.not_excited.keys() if gap.left <= LITTLE else Names()
    return frozenset(name for name in guessed if gap.share(settled.parts[name]).ci[0] > LARGE_SHARE)


def _measured(case: Case, assessor: Assessor, settled: Settled) -> Names:
    """Likewise measured values, if hardly anything is left; none where a gain alone does better than each of them."""
    gap = settled.gap
    if case.guessed or not settled.found.is_open or gap.left > LITTLE:
        return Names()
    causes = _off(case, settled.simulator) - case.not_excited.keys()
    causes = causes if gap.left <= HARDLY else causes & UNLIKE_UNKNOWNS
    causes = frozenset(name for name in causes if gap.share(settled.parts[name]).ci[0] > MUCH_SHARE)
    gains = Names().union(*case.simplify(settled.simulator.names)) - settled.simulator.names - case.refitted
    alone = {name: _left_by(assessor, case, settled.found, name) for name in causes | gains if causes}
    return causes if min(alone, key=lambda name: alone[name], default="") in causes else Names()


def _left_by(assessor: Assessor, case: Case, found: Found, name: str) -> float:
    """What is left where one nominal value alone is off, beside the named effects."""
    names = found.effects | {name}
    return simulator_of(case, assessor, assessor.one(names, found.final.hypothesis), names).left


def is_known(case: Case, of: Assessment, name: str) -> bool:
    """Whether it is known how large an effect is: at least one of its parameters, within a factor of WIDE."""
    intervals = np.array(list(case.intervals(of.hypothesis)[name].values()))
    return bool((intervals.prod(axis=1) * WIDE > (intervals**2).max(axis=1)).any())


def as_believed(case: Case, of: Assessment, name: str, elsewhere: bool = False) -> bool:
    """Whether each parameter of an effect may well be what the simulator had: nominal values do all of its work.

    `elsewhere`: as another motion would say.
    """
    intervals = intervals_of(case, of.hypothesis, elsewhere)[name]
    had = {each.name: each.neutral for each in case.library[name].parameters}
    had |= {"value": case.replaced[name]} if name in case.replaced else {}
    kept = [(low, had[key], high) for key, (low, high) in intervals.items()]
    return all(value is not None and low <= value <= high for low, value, high in kept)
