"""Names exchanged for others: effects that may pass for each other, and guesses that do an effect's work.

A nominal value that is a guess, as a position servo's is, is refitted beside every set. A damping then does most of a
gain's work, so that the gain hardly shows beside it, and others are found for what is left of it.
"""

from collections.abc import Collection

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.fit.case import Case, Hypothesis, Names

SINGLES = 3  # sets of one name more that are held out, the likeliest in the fit
NEARLY = 0.5  # of the noise's variance: what leaves no more, in what it was fitted to, does the work


def swaps(case: Case, found: Assessment, names: Names, candidates: Collection[str]) -> list[tuple[Names, Hypothesis]]:
    """The set with one of these names exchanged for one that may pass for it, in every way; and where fits start."""
    return [
        (found.names - {name} | {rival}, found.hypothesis)
        for name in sorted(names)
        for rival in sorted(case.confusable(name) & frozenset(candidates) - found.names)
    ]


def instead_of_a_guess(case: Case, assessor: Assessor, named: Assessment, candidates: Collection[str]) -> Assessment:
    """With an effect in the place of a guess that may pass for it, where nothing is left then and something was."""
    guessed = named.names & case.guessed
    if not guessed or assessor.adequate(named):
        return named
    tried = assessor.likeliest(swaps(case, named, guessed, candidates), assessor.cfg.contenders)
    return max([named, *filter(assessor.adequate, tried)], key=lambda each: each.score)


def fewer_names(case: Case, assessor: Assessor, final: Assessment, candidates: Collection[str]) -> Assessment | None:
    """One name or two in the place of more, beside every other value as it was guessed, if as good a story."""
    certain = frozenset(case.certain)
    count = len(final.names - certain)
    if not case.guessed or count < 2:
        return None
    fewer = [_with_one(case, assessor, assessor.one(certain), candidates)]
    if count > 2:
        fewer.append(_with_one(case, assessor, fewer[0], candidates))
    enough = (each for each in fewer if each.rest <= NEARLY and not assessor.worth(final, each))
    return next(enough, None)


def _with_one(case: Case, assessor: Assessor, found: Assessment, candidates: Collection[str]) -> Assessment:
    """With the effect or guess that is likeliest beside it.

    By the fits, not by the screen: a gain may be hidden by an optimum that is far from where it begins.
    """
    free = {*candidates, *case.refitted} - case.not_excited.keys() - found.names
    tried = assessor.likeliest([(found.names | {name}, found.hypothesis) for name in sorted(free)], SINGLES)
    return max(tried, key=lambda each: each.score, default=found)
