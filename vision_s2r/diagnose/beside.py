"""Which effects are there beside something unknown: the set of most evidence, whatever the unknown may be.

Evidence has the unknown integrated out (`fit/joint/smooth_unknown.py`), so that sets are compared by what they spare it
and not by whether it could do their work. Sets move by one effect more, one less, or one for another.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.fit.case import BesideUnknown, Hypothesis, Names
from vision_s2r.fit.selection import EVIDENCE, WORK

BEGUN = 4  # sets that are looked at first
FOLLOWED = 4  # effects more, the most promising by the screen, that are fitted; half as many in another's place
FAR = 4.0  # of the noise's variance, that all of the unknown leaves beside the first sets: more is none of its kind
VISIBLE = 1.0  # nats that an effect has to seem to gain to be fitted
MOST_FITS = 30  # after which no better set is looked for
STARTS = 3  # that one set is fitted from
SPARED = 1.1  # times the work that functions have without effects beside a disturbance, that they may have with some
PLAINLY = 5.0  # times what an effect has to bring, that one has to bring which was lost before
OWN = 0.1  # of what an effect brings beside nothing unknown, that it has to bring beside all of it


class BesideUnknownSearch:
    """The search for effects beside something unknown."""

    def __init__(
        self,
        case: BesideUnknown,
        assessor: Assessor,
        candidates: Sequence[str],
        always: Names,
        disturbance: Names | None = None,
    ) -> None:
        """`candidates` are effects that may be named; `always` is what every set has.

        `disturbance`, the case's or none, is given where functions do not do all of the unknown's work: it is in every
        set, too, and effects have to bring more.
        """
        self._case, self._cfg, self._left, self._run = case, assessor.cfg, assessor.left, assessor.run
        self._candidates, self._always = frozenset(candidates), always | (disturbance or frozenset())
        self._unknown, self._disturbed = frozenset(case.discrepancies), bool(disturbance)
        self._in_part = disturbance is not None
        self._refused: Names = frozenset()
        # The search's fits of sets without anything unknown: an unknown that has done an effect's work hides it.
        self._plain = {names & self._candidates: fit for names, fit, _ in assessor.begun if not names & self._unknown}
        self._fitted: dict[Names, Hypothesis] = {}
        self._starts: Counter[Names] = Counter()

    def without_stand_ins(self, found: Assessment, worth: Callable[[str], float]) -> Hypothesis | None:
        """What the unknown is where it does nearly all that one of the found effects brings; None where it does not.

        `worth`: nats that an effect brings where nothing is unknown. One that is there brings them in any case.
        """
        effects = found.names & self._candidates
        if not effects:
            return None
        whole = self._fit(effects, found.hypothesis)
        for name in sorted(effects):
            less, nats = self._without(whole, name)
            if nats < min(self._cfg.promising, OWN * worth(name)):
                return less
        return None

    def borne_out(self, begun: Iterable[tuple[Names, Hypothesis]], doubted: Names) -> Hypothesis:
        """`best` without what looks like a stand-in, or is doubted and brings too little for that; in no set then."""
        return self._refusing(self.best(begun), lambda best, name: self._stands_in(best, name, doubted))

    def _refusing(self, best: Hypothesis, refused: Callable[[Hypothesis, str], bool]) -> Hypothesis:
        """The best set without effects that are refused there; they are in no set from then on."""
        while names := frozenset(name for name in self._effects(best) if refused(best, name)):
            self._refused |= names
            best = self._climbed(self._fit(self._effects(best) - names, best), self._moved)
        return best

    def _stands_in(self, best: Hypothesis, name: str, doubted: Names) -> bool:
        if self._case.suspicious(best, name):
            return True
        return name in doubted and self._without(best, name)[1] < PLAINLY * self._cfg.promising

    def _without(self, whole: Hypothesis, name: str) -> tuple[Hypothesis, float]:
        """A fit without one of its effects, and the evidence that this brings, nats."""
        less = self._fit(self._effects(whole) - {name}, whole)
        return less, float(whole.extra[EVIDENCE]) - float(less.extra[EVIDENCE])

    def best(self, begun: Iterable[tuple[Names, Hypothesis]]) -> Hypothesis:
        """The hypothesis of most evidence, from the first of these sets and what is near them.

        Where functions do all of the unknown's work they have to come near; where they do a part, they must not.
        """
        first: dict[Names, Hypothesis] = {}
        for names, hypothesis in begun:
            first.setdefault(names & self._candidates, hypothesis)
        self._fits([each for each in first.items() if each[0] not in self._fitted][: BEGUN - len(self._fitted)])
        far = all(self._left(of) > FAR for of in self._fitted.values())
        if not self._disturbed and far != self._in_part:
            return max(self._fitted.values(), key=self._score)
        # The screen may not see an effect that shows in the company of another.
        self._climbed(max(self._fitted.values(), key=lambda of: of.extra[EVIDENCE]), self._less)
        best = self._climbed(max(self._fitted.values(), key=self._score), self._moved)
        return self._refusing(best, self._case.unbounded)

    def _climbed(self, best: Hypothesis, moves: Callable[[Hypothesis], Iterable[Hypothesis]]) -> Hypothesis:
        """The end of moves that each lead to a better set."""
        while True:
            better = max(moves(best), key=self._score, default=best)
            if self._score(better) <= self._score(best) or self._starts.total() > MOST_FITS:
                return max(better, best, key=self._score)
            best = better

    def _fits(self, begun: Sequence[tuple[Names, Hypothesis]]) -> list[Hypothesis]:
        """`_fit` of different sets from these starts, several at a time."""
        return self._run(self._fit, begun)

    def _fit(self, effects: Names, start: Hypothesis) -> Hypothesis:
        """The set's fit of most evidence so far, the one from this start among them."""
        if self._starts[effects] >= STARTS:
            return self._fitted[effects]
        names, starts = effects | self._always | self._unknown, [start]
        if effects not in self._fitted and effects in self._plain:
            starts.append(self._plain[effects])
        fits = [self._case.fit(names, range(self._case.segments), each) for each in starts]
        self._starts[effects] += len(fits)
        fits += [self._fitted[effects]] if effects in self._fitted else []
        self._fitted[effects] = max(fits, key=self._score)
        return self._fitted[effects]

    def _score(self, of: Hypothesis) -> float:
        nothing = self._fitted.get(frozenset(), of)
        if self._disturbed and of.extra[WORK] > SPARED * nothing.extra[WORK] + VISIBLE:
            return -math.inf  # an effect that is there spares functions their work: what gives them more only helps
        # Guesses that are off, and what is no function, are done by whatever may do it: beside them more is asked.
        doubtful = self._case.guessed or self._in_part
        each = self._cfg.promising if doubtful else self._cfg.evidence
        return float(of.extra[EVIDENCE]) - each * len(self._effects(of))

    def _effects(self, of: Hypothesis) -> Names:
        return self._candidates & frozenset(of.values)

    def _moved(self, best: Hypothesis) -> Iterable[Hypothesis]:
        """One effect more, less, or another."""
        yield from self._more(best, FOLLOWED)
        for name, less in zip(sorted(self._effects(best)), self._less(best), strict=True):
            yield less
            yield from self._more(less, FOLLOWED // 2, name)

    def _less(self, best: Hypothesis) -> Iterable[Hypothesis]:
        yield from self._fits([(self._effects(best) - {name}, best) for name in sorted(self._effects(best))])

    def _more(self, beside: Hypothesis, most: int, but: str = "") -> Iterable[Hypothesis]:
        effects = self._effects(beside)
        if len(effects) < self._cfg.most:
            starts = self._case.starts_beside(beside, sorted(self._candidates - self._refused - effects - {but}))
            promising = sorted(starts, key=lambda name: -starts[name][0])[:most]
            yield from self._fits([(effects | {n}, starts[n][1]) for n in promising if starts[n][0] > VISIBLE])
