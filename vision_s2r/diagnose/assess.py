"""Sets of effects, fitted and scored on episodes or frames that took no part in the fit."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from vision_s2r import parallel
from vision_s2r.diagnose.config import SearchConfig
from vision_s2r.fit.case import NOMINAL, Case, Hypothesis, Names, Segments
from vision_s2r.fit.gap import rest
from vision_s2r.fit.selection import EVIDENCE
from vision_s2r.statistics import lower_bound

MAIN = 0.5  # of a rest
FEW = 12  # blocks
SURE = 0.975  # the lower end of an interval of 95 %
HOPELESS = 1.0  # rest of a set that was fitted to it all, beside one that leaves nothing
SEEN = 0.2  # of what there is over the floor
ALLOWED = 0.75  # of the allowance for effects unlike their definitions, that a name must take away

R = TypeVar("R")


@dataclass(frozen=True)
class Assessment:
    """A set of effects, fitted on all segments and, for the score, on all but the fold in hand."""

    names: Names
    hypothesis: Hypothesis  # fitted on all segments
    folds: tuple[Hypothesis, ...]  # fitted without the segments of each fold
    loglik: np.ndarray  # [blocks] nats, held out
    excess: np.ndarray  # [segments], held out

    @property
    def score(self) -> float:
        """Held-out log-likelihood, nats."""
        return float(self.loglik.sum())

    @property
    def evidence(self) -> float | None:
        """Nats, where something unknown beside the effects is integrated out."""
        return self.hypothesis.extra.get(EVIDENCE)

    @property
    def rest(self) -> float:
        """What is left of held-out segments."""
        return rest(self.excess)

    @property
    def is_sized(self) -> bool:
        """Whether each effect has parameters in every fit: an encoder without steps has none."""
        return all(all(each.values.values()) for each in (self.hypothesis, *self.folds))


@dataclass(frozen=True)
class Gain:
    """What one set has over another, on held-out data."""

    nats: float
    low: float  # its lower confidence bound
    relief: float  # fall of the mean excess
    share: float  # of the excess over the floor that there was


class Assessor:
    """Fits and scores sets of effects, each once, several at a time."""

    def __init__(self, case: Case, cfg: SearchConfig, jobs: int, seed: int) -> None:
        self.case, self.cfg, self.seed = case, cfg, seed
        self._jobs = jobs
        self._fitted: dict[Names, tuple[Hypothesis, float]] = {}
        self._assessed: dict[Names, Assessment] = {}
        self.folds = [
            tuple(range(k, case.segments, min(cfg.folds, case.segments))) for k in range(min(cfg.folds, case.segments))
        ]

    @property
    def assessed(self) -> Mapping[Names, Assessment]:
        """Every set assessed so far."""
        return self._assessed

    @property
    def begun(self) -> list[tuple[Names, Hypothesis, float]]:
        """Every set fitted so far, its likeliest fit, and in-sample log-likelihood, nats."""
        return [(names, *fitted) for names, fitted in self._fitted.items()]

    def fit(self, wanted: Iterable[tuple[Names, Hypothesis]]) -> dict[Names, float]:
        """In-sample log-likelihood (nats) of sets, each fitted to all segments from its starts; for ranking only.

        The likeliest of a set's fits counts: sets grown from different parents end in different optima. A set that was
        fitted before is fitted again from a start that is likelier than its fit, be it one of fewer names.
        """
        todo = list({(names, id(start)): (names, start) for names, start in wanted}.values())
        new = [each for each in todo if each[0] not in self._fitted or self._likelier(*each)]
        for (names, _), result in zip(new, self.run(self._fit, new), strict=True):
            if names not in self._fitted or result[1] > self._fitted[names][1]:
                self._fitted[names] = result
                self._assessed.pop(names, None)
        return {names: self._fitted[names][1] for names, _ in todo}

    def assess(self, wanted: Iterable[tuple[Names, Hypothesis]]) -> list[Assessment]:
        """Sets with their scores, in the order asked for."""
        wanted = list(wanted)
        self.fit(wanted)
        new = list(dict.fromkeys(names for names, _ in wanted if names not in self._assessed))
        # The first fold of a set finds the derivatives that its others share.
        found = self.run(self._hold_out, [(names, self.folds[0]) for names in new])
        found += self.run(self._hold_out, [(names, held) for held in self.folds[1:] for names in new])
        for k, names in enumerate(new):
            self._assessed[names] = self._assessment(names, found[k :: len(new)])
        return [self._assessed[names] for names, _ in wanted]

    def likeliest(self, wanted: Iterable[tuple[Names, Hypothesis]], count: int) -> list[Assessment]:
        """So many of these sets with their scores: those that are likeliest in the fit."""
        wanted = list(wanted)
        fits = self.fit(wanted)
        return self.assess(sorted(wanted, key=lambda each: -fits[each[0]])[:count])

    def rivals(self, wanted: Iterable[tuple[Names, Hypothesis]], found: Assessment) -> list[Assessment]:
        """Sets with their scores that may be as good as `found`: hopeless ones are not held out."""
        wanted = list(wanted)
        if self.adequate(found):
            self.fit(wanted)
            wanted = [each for each in wanted if self.left(self._fitted[each[0]][0]) <= HOPELESS]
        return self.assess(wanted)

    def left(self, hypothesis: Hypothesis) -> float:
        """The rest of a hypothesis in what it was fitted to."""
        return rest(self.case.excess(hypothesis, range(self.case.segments)))

    def one(self, names: Names, start: Hypothesis = NOMINAL) -> Assessment:
        """One set with its score."""
        return self.assess([(names, start)])[0]

    def gain(self, more: Assessment, less: Assessment) -> Gain:
        """What `more` has over `less`: evidence, where something unknown is integrated out of both.

        Where both leave more than noise, a likelihood of fixed sharpness is overconfident by that much: it is divided
        by the smaller excess, as in the quasi-likelihood criteria (Burnham and Anderson 2002, section 2.5).
        """
        relief = less.rest - more.rest
        share = relief / less.rest if less.rest > 0 else 0.0
        if more.evidence is not None and less.evidence is not None:
            nats = more.evidence - less.evidence
            return Gain(nats, nats, relief, share)
        dispersion = max(1.0, 1 + min(more.rest, less.rest)) if self.case.sharp else 1.0
        difference = (more.loglik - less.loglik) / dispersion
        # Few blocks are sure of nothing: of most of what is left less certainty is asked of them.
        few = len(difference) < FEW and share > MAIN
        level = min(SURE, self.cfg.confidence) if few else self.cfg.confidence
        return Gain(float(difference.sum()), lower_bound(difference, level, self.seed), relief, share)

    def worth(self, more: Assessment, less: Assessment) -> bool:
        """Whether the names that `more` has and `less` has not are significant, and relevant."""
        gain, count = self.gain(more, less), max(len(more.names) - len(less.names), 1)
        # What only makes up for effects that are a little unlike their definitions is no effect.
        if gain.relief <= ALLOWED * self.case.allowance:
            return False
        floor = self.adequate(less) or self.adequate(more)
        if floor and gain.nats > self.cfg.local * count and gain.relief > self.cfg.slightest:
            return True  # at the floor, where the likelihood is that of noise, an effect may show in few places
        significant = gain.nats > self.cfg.evidence * count and gain.low > 0
        return significant and gain.relief > self.cfg.relief and gain.share > self.cfg.share

    def better(self, more: Assessment, less: Assessment) -> bool:
        """Whether a flexible unknown brings `more`, where something is there in any case."""
        gain = self.gain(more, less)
        return gain.nats > self.cfg.evidence and gain.relief > self.cfg.relief and gain.share > self.cfg.share

    def most(self, more: Assessment, less: Assessment) -> bool:
        """Whether most of what `less` leaves is gone, be it in few places: held out, so that others showed it too."""
        gain = self.gain(more, less)
        return gain.nats > self.cfg.promising and gain.share > MAIN

    def surely_most(self, more: Assessment, less: Assessment) -> bool:
        """Whether most of what `less` leaves is gone, and surely so."""
        gain = self.gain(more, less)
        return self._sure(gain) and gain.share > MAIN

    def shows(self, more: Assessment, less: Assessment) -> bool:
        """Whether a flexible unknown shows where the floor is reached in the mean: in few places, but plainly."""
        return self.adequate(less) and self._sure(self.gain(more, less))

    def plain(self, more: Assessment, less: Assessment) -> bool:
        """Whether an effect shows plainly: surely, and as much of what there is over the floor without it, if any."""
        gain = self.gain(more, less)
        return self._sure(gain) and (self.adequate(less) or gain.share > SEEN)

    def _sure(self, gain: Gain) -> bool:
        return gain.nats > self.cfg.promising and gain.low > 0

    def adequate(self, assessment: Assessment) -> bool:
        """Whether nothing beyond noise is left."""
        return assessment.rest <= self.cfg.adequate

    def little(self, assessment: Assessment) -> bool:
        """Whether what is left is little beside the gap."""
        return assessment.rest <= self.cfg.tolerance * self.one(frozenset()).rest

    def _likelier(self, names: Names, start: Hypothesis) -> bool:
        fitted, loglik = self._fitted[names]
        if start is fitted:
            return False
        values = {name: value for name, value in start.values.items() if name in names}
        extra = {key: value for key, value in start.extra.items() if key not in self.case.discrepancies or key in names}
        return self.loglik(Hypothesis(values, extra)) > loglik + self.cfg.evidence

    def loglik(self, hypothesis: Hypothesis) -> float:
        """The log-likelihood of all segments, nats."""
        return float(sum(blocks.sum() for blocks in self.case.loglik(hypothesis, range(self.case.segments))))

    def _fit(self, names: Names, start: Hypothesis) -> tuple[Hypothesis, float]:
        hypothesis = self.case.fit(names, range(self.case.segments), start)
        return hypothesis, self.loglik(hypothesis)

    def _hold_out(self, names: Names, held: Segments) -> tuple[Hypothesis, list[np.ndarray], np.ndarray]:
        """The fit without a fold's segments, and of each of these log-likelihood [blocks] (nats) and excess."""
        case = self.case
        rest = [segment for segment in range(case.segments) if segment not in held]
        fitted = case.fit(names, rest, self._fitted[names][0])
        return fitted, case.loglik(fitted, held), case.excess(fitted, held)

    def _assessment(self, names: Names, folds: Sequence[tuple[Hypothesis, list[np.ndarray], np.ndarray]]) -> Assessment:
        loglik: dict[int, np.ndarray] = {}
        excess = np.empty(self.case.segments)
        for held, (_, blocks, beyond) in zip(self.folds, folds, strict=True):
            loglik |= dict(zip(held, blocks, strict=True))
            excess[list(held)] = beyond
        whole = np.concatenate([loglik[segment] for segment in range(self.case.segments)])
        return Assessment(names, self._fitted[names][0], tuple(fitted for fitted, _, _ in folds), whole, excess)

    def run(self, function: Callable[..., R], calls: Sequence[tuple[Any, ...]]) -> list[R]:
        """What a function returns for each of these calls, several of them at a time."""
        return list(parallel.run(function, calls, self._jobs, threads=True))
