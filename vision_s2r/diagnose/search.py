"""Which effects: sets grown, pruned and swapped by held-out likelihood, beside flexible unknowns."""

from dataclasses import dataclass

import numpy as np

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.diagnose.beside import BesideUnknownSearch
from vision_s2r.diagnose.exchange import NEARLY, fewer_names, instead_of_a_guess, swaps
from vision_s2r.fit.case import NOMINAL, BesideUnknown, Case, Hypothesis, Names

COINCIDENCE = 3  # so many effects at once may stand in for one unknown function
MOST = 2.0  # times what an unknown leaves: effects that leave no more do most of its work
TRIED = 4  # unknowns, or effects beside one, that are held out
MUCH = 0.33  # of the gap: effects that leave no more do much work
ROUGH = 0.25  # of what is left without an effect of roughly known form: what its form may be to blame for
ALIKE = 0.08  # of its size, by which a true effect may differ with a stand-in for something unknown and without


@dataclass(frozen=True)
class Found:
    """The end of a search."""

    final: Assessment  # effects and discrepancies that are needed; other nominal parameters as they came
    refitted: Assessment  # every nominal parameter refitted, no effect added
    nominal: Assessment  # the simulator as it came
    identified: Assessment  # … and what is certain
    effects: Names  # named ones
    unknown: Names  # discrepancies that were needed: something is there that no effect of the library is
    resembles: tuple[str, ...]  # these, what does most first, and those that would take off something of what is left
    adequate: bool  # nothing beyond noise is left

    @property
    def is_open(self) -> bool:
        """Whether something is left that nothing explains."""
        return bool(self.unknown) or not self.adequate


class Search:
    """The search over sets of effects of one recording."""

    def __init__(self, case: Case, assessor: Assessor) -> None:
        self._case, self._assessor, self._cfg = case, assessor, assessor.cfg
        self._integrating = case if isinstance(case, BesideUnknown) else None
        self._certain = frozenset(case.certain)
        self._base = case.refitted | self._certain | frozenset(case.measured)
        self._effects = frozenset(case.library) - self._base
        self._discrepancies = frozenset(case.discrepancies)
        self._candidates = [name for name in case.library if name not in self._base and name not in case.not_excited]
        self._screened: dict[Names, tuple[Hypothesis, dict[str, float]]] = {}

    def run(self) -> Found:
        """The smallest set that explains what can be explained."""
        found = self._searched()
        while unbounded := self._unbounded(found):
            self._rule_out(unbounded)
            found = self._searched()
        fewer = fewer_names(self._case, self._assessor, found.final, self._candidates)
        return self._found(fewer, fewer, self._assessor.one(self._base)) if fewer else found

    def _searched(self) -> Found:
        base = self._assessor.one(self._base)
        integrating = self._integrating
        named = self._effects_alone(base, COINCIDENCE if integrating else self._cfg.most)
        named = instead_of_a_guess(self._case, self._assessor, named, self._candidates)
        if integrating and not (self._assessor.adequate(named) or self._slight(named)):
            best = self._beside_unknown(integrating, named, base)
            if beside := self._integrated(best, NEARLY):
                return self._found(beside, beside, base)
            named = self._if_known(best, self._effects_alone(base, self._cfg.most))
        final, resembles = named, Names()
        if self._assessor.adequate(named):
            final = self._restore(named)
        lost = not self._assessor.adequate(final)  # names that explain all, and are not worth it
        if lost or not self._explained(named) or len(final.names) >= COINCIDENCE:
            named, resembles = self._challenge(named, base)
            final = self._restore(named)
        if contradicted := self._contradicted(final):
            self._rule_out(contradicted)
            kept = self._assessor.one(final.names - contradicted - self._discrepancies, final.hypothesis)
            named, resembles = self._challenge(kept, base)
            final = self._restore(named)
        if integrating and (beside := self._instead_of_stand_ins(integrating, final)):
            return self._found(beside, beside, base)
        return self._found(final, named, base, resembles)

    def _unbounded(self, found: Found) -> Names:
        """Limits that may as well be none, where something is left: they do the work of another."""
        case = self._integrating
        if not (case and found.is_open):
            return Names()
        named = found.effects & frozenset(self._candidates)
        return Names(name for name in named if case.unbounded(found.final.hypothesis, name))

    def _rule_out(self, names: Names) -> None:
        self._candidates = [name for name in self._candidates if name not in names]
        self._screened.clear()

    def resumed(self, found: Assessment, hardly: bool) -> Found | None:
        """The end of a search that comes upon this set, which leaves nothing, if it is no coincidence of effects.

        Or which leaves next to nothing of the gap, and something beyond the noise (`hardly`).
        """
        if found.names & self._discrepancies:
            return None
        base = self._assessor.one(self._base)
        if not self._assessor.adequate(found):
            return self._found(found, found, base) if hardly else None
        final = self._restore(found)
        alone = self._assessor.adequate(final) and len(final.names - self._certain) < COINCIDENCE
        return self._found(final, final, base) if alone else None

    @property
    def disturbances(self) -> list[Names]:
        """What may be beside functions that do a part of the unknown's work: nothing, or torques of single instants."""
        case = self._integrating
        return [Names(), case.disturbance] if case and case.disturbance else []

    def beside_more(self, found: Found, disturbance: Names, doubted: Names) -> Found | None:
        """Effects that show beside such an unknown, where there are any; plainly, if they are `doubted`."""
        case = self._integrating
        assert case is not None
        search = BesideUnknownSearch(case, self._assessor, self._candidates, self._base, disturbance)
        best = search.borne_out([(self._base, NOMINAL), (found.final.names, found.final.hypothesis)], doubted)
        if not best.values.keys() - self._base:
            return None
        beside = self._assessor.one(frozenset(best.values) | self._base | self._discrepancies | disturbance, best)
        return self._found(beside, beside, self._assessor.one(self._base))

    def plain(self, most: int) -> list[Found]:
        """So many of the likeliest sets that were tried beside nothing unknown, as ends of a search."""
        base, possible = self._assessor.one(self._base), self._base | frozenset(self._candidates)
        tried = [each for each in self._assessor.assessed.values() if each.names <= possible and each.is_sized]
        named = [each for each in tried if each.names - self._base]
        best = sorted(named, key=lambda each: -each.score)[:most]
        return [self._found(each, each, base) for each in best]

    def _found(self, final: Assessment, named: Assessment, base: Assessment, resembles: Names = frozenset()) -> Found:
        """`resembles`: discrepancies beside those that the final set fits; of its names some may come to nothing."""
        assess = self._assessor
        resembles |= self._discrepancies & final.hypothesis.extra.keys()
        unknown = final.names - frozenset(self._case.library)
        adequate = assess.adequate(final) or (not unknown and self._slight(final))
        # Beside something unknown, a nominal parameter that seems to differ, or a gain for some, may be doing its work.
        doubtful = frozenset() if adequate and not unknown else self._case.refitted | final.names - named.names
        effects = final.names - unknown - {name for name in doubtful if self._case.library[name].source == "dynamics"}
        refitted, nominal = assess.one(self._case.refitted), assess.one(frozenset())
        ordered = self._by_work(resembles, final.hypothesis)
        return Found(final, refitted, nominal, base, effects, unknown, ordered, adequate)

    def _by_work(self, discrepancies: Names, found: Hypothesis) -> tuple[str, ...]:
        """By what is left where one of them is not there, the others as they were fitted; then what was not fitted."""

        def without(name: str) -> Hypothesis:
            return Hypothesis(found.values, {other: much for other, much in found.extra.items() if other != name})

        left = {name: self._assessor.left(without(name)) for name in discrepancies & found.extra.keys()}
        return tuple(sorted(discrepancies, key=lambda name: (-left.get(name, 0.0), name)))

    def _beside_unknown(self, case: BesideUnknown, named: Assessment, base: Assessment) -> Hypothesis:
        """The effects that are there whatever the unknown may be, with all of it integrated out."""
        likely = sorted(self._assessor.begun, key=lambda each: -each[2])
        begun = [(each.names, each.hypothesis) for each in (base, named)] + [each[:2] for each in likely]
        return BesideUnknownSearch(case, self._assessor, self._candidates, self._base).best(begun)

    def _if_known(self, best: Hypothesis, named: Assessment) -> Assessment:
        """The effects found beside the unknown where nothing of it is left, if they say more than the named ones."""
        if self._discrepancies & best.extra.keys():
            return named
        found = self._assessor.one(frozenset(best.values) | self._base, Hypothesis(best.values))
        return found if self._assessor.worth(found, named) else named

    def _instead_of_stand_ins(self, case: BesideUnknown, final: Assessment) -> Assessment | None:
        """Something unknown in place of an effect that does no more than it, though with the effect nothing is left."""
        assess = self._assessor
        if final.names & self._discrepancies or not assess.adequate(final):
            return None
        search = BesideUnknownSearch(case, assess, self._candidates, self._base)

        def worth(name: str) -> float:
            return assess.gain(final, assess.one(final.names - {name}, final.hypothesis)).nats

        less = search.without_stand_ins(final, worth)
        return self._integrated(less, self._cfg.adequate) if less else None

    def _integrated(self, found: Hypothesis, rest: float) -> Assessment | None:
        """The assessment of effects beside all of the unknown, where there is any, and it leaves no more than this."""
        if not self._discrepancies & found.extra.keys() or self._assessor.left(found) > rest:
            return None
        return self._assessor.one(frozenset(found.values) | self._base | self._discrepancies, found)

    def _effects_alone(self, base: Assessment, most: int) -> Assessment:
        """The set of so many effects at most that is worth its names, beside nothing unknown.

        An effect in place of its rival may show others that this hid: such a set is grown on.
        """
        grown = self._grow(base, most)
        found = self._swap(grown)
        if found is not grown:
            found = self._swap(self._grow(found, most))
        return self._shed(found, self._effects)

    def _grow(self, base: Assessment, most: int) -> Assessment:
        """Forward, a beam of sets at a time; one size may bring nothing, since some effects only show in pairs."""
        best, beam, patience = base, [base], 1
        for size in range(len(base.names - self._base) + 1, most + 1):
            if size > 1 and self._assessor.adequate(best) and not self._promising(best):
                break
            children = self._settled(size, best) or self._children(beam, size)
            if not children:
                break
            beam = children[: self._cfg.beam]
            if self._assessor.worth(beam[0], best):
                best, patience = beam[0], 1
            elif patience and (self._cfg.hidden or not self._assessor.adequate(best)):
                patience -= 1
            else:
                break
        return best

    def _settled(self, size: int, best: Assessment) -> list[Assessment]:
        """Proposed sets of this size that leave nothing, the best first; then no rivals are grown."""
        if self._cfg.hidden:
            return []
        found = self._assessor.assess([(names, NOMINAL) for names in self._proposed(size)])
        enough = [each for each in found if self._assessor.adequate(each) and self._assessor.worth(each, best)]
        return sorted(enough, key=lambda each: -each.score)

    def _proposed(self, size: int) -> list[Names]:
        return [self._base | names for names in self._case.proposals() if len(names - self._base) == size]

    def _promising(self, found: Assessment) -> list[str]:
        """Effects that may still gain something."""
        return [name for name, gain in self._gains(found).items() if gain > self._cfg.promising]

    def _gains(self, found: Assessment) -> dict[str, float]:
        """About what each of the other candidates would gain beside a set."""
        known = self._screened.get(found.names)
        if known is None or known[0] is not found.hypothesis:
            free = [name for name in self._candidates if name not in found.names]
            known = self._screened[found.names] = found.hypothesis, self._case.screen(found.hypothesis, free)
        return known[1]

    def _children(self, beam: list[Assessment], size: int) -> list[Assessment]:
        """Sets one larger than those of the beam, and proposed ones of that size; the best first.

        What several parents lead to starts from the likeliest of them, and from others that are about as likely.
        """
        grown = []
        for place, parent in enumerate(beam, start=1):
            gains = self._gains(parent)
            promising = sorted(gains, key=lambda name: -gains[name])[: self._cfg.breadth // place]
            grown += [(parent, name) for name in promising]
        likely = self._assessor.fit((parent.names, parent.hypothesis) for parent in beam)
        grown.sort(key=lambda each: -likely[each[0].names])
        wanted = [(names, NOMINAL) for names in self._proposed(size)]
        likeliest = {names: np.inf for names, _ in wanted}
        for parent, name in grown:
            names = parent.names | {name}
            if likely[parent.names] >= likeliest.setdefault(names, likely[parent.names]) - self._cfg.promising:
                wanted.append((names, parent.hypothesis))
        scores = self._assessor.fit(wanted)
        starts = dict(reversed(wanted))
        if not self._cfg.hidden and self._assessor.adequate(beam[0]):  # held out, less is gained than in the fit
            least = likely[beam[0].names] + self._cfg.evidence
            scores = {names: score for names, score in scores.items() if score > least}
        best = sorted(scores, key=lambda names: -scores[names])[: self._cfg.contenders]
        return sorted(self._assessor.assess([(names, starts[names]) for names in best]), key=lambda a: -a.score)

    def _swap(self, found: Assessment) -> Assessment:
        """With an effect exchanged for its rival, where that is the likelier of the two, or as good and simpler."""
        return self._simplest([found, *self._swapped(found)])

    def _simplest(self, rivals: list[Assessment]) -> Assessment:
        """The likeliest, or one of fewer parameters unless the likelier is worth its others."""
        best = max(rivals, key=lambda assessment: assessment.score)
        simpler = [each for each in rivals if self._parameters(each) < self._parameters(best)]
        enough = [each for each in simpler if not self._assessor.worth(best, each)]
        return max(enough, key=lambda assessment: assessment.score, default=best)

    def _swapped(self, found: Assessment) -> list[Assessment]:
        """The set with an effect exchanged for one that may pass for it, in every way that may be as good."""
        wanted = swaps(self._case, found, found.names - self._base, self._candidates)
        return self._assessor.rivals(wanted, found)

    def _parameters(self, found: Assessment) -> int:
        return sum(len(self._case.library[name].parameters) for name in found.names & frozenset(self._case.library))

    def _shed(self, found: Assessment, doubtful: Names) -> Assessment:
        """Without those of the doubtful names that are not worth their name beside the others.

        The one that the fit misses least is held out; where that is worth its name, so are the others. Nor are several
        shed that are worth their names together.
        """
        whole = found
        while removable := sorted(found.names & doubtful):
            slight = [name for name in removable if self._case.negligible(found.hypothesis, name)]
            scores = self._assessor.fit((found.names - {name}, found.hypothesis) for name in (slight or removable))
            least = self._assessor.one(max(scores, key=lambda names: scores[names]))
            if not slight and (self._assessor.worth(found, least) or self._assessor.worth(whole, least)):
                break
            found = least
        return found

    def _challenge(self, named: Assessment, base: Assessment) -> tuple[Assessment, Names]:
        """The named set against flexible unknowns: beside it, or instead of it, where something is left.

        Where nothing is left, one unknown function may still be the simpler story than a coincidence of effects. Also
        returns the unknowns that take something off.
        """
        rival, grown = self._rival(base)
        # An unknown beside which some of the named effects show, and no others, takes the place of the rest of them.
        part = grown.names & self._effects < named.names & self._effects
        strong = self._strong(named, grown if part else rival, base)
        told = named if strong else self._likelier_story(named, rival, base)
        better = self._rivals_story(told)
        if strong and not better:
            # Beside something flexible enough to do their work, their parameters would be anybody's guess.
            found, whole = named, self._extended(named, Names())
        else:
            found = whole = self._extended(better or told, self._effects)
        hints = whole.names
        explained = self._assessor.adequate(found) or self._slight(found)
        if found.names & self._discrepancies or not explained:
            found = self._unmask(found, whole)
        return found, hints & self._discrepancies

    def _likelier_story(self, named: Assessment, rival: Assessment, base: Assessment) -> Assessment:
        """The named effects, or the unknown instead of them; with those whose work it cannot do, if they may stand."""
        if not self._simpler(rival, named, base):
            return named
        if not self._cfg.beside:
            return rival
        both = self._shed(self._assessor.one(named.names | rival.names, named.hypothesis), self._effects)
        # Stand-ins may miss each other's work where all of them together do none that the unknown leaves.
        told = both if self._assessor.worth(both, rival) and self._more_than_knots(both, rival) else rival
        own = self._shed(self._beside(named), self._effects)  # an unknown may show beside them alone
        bare = self._assessor.one(own.names - self._effects, own.hypothesis)
        surely = self._assessor.worth(own, bare) and self._more_than_knots(own, bare)
        return own if surely and self._assessor.gain(own, told).nats > self._cfg.evidence else told

    def _rivals_story(self, told: Assessment) -> Assessment | None:
        """With rivals of its effects, beside the unknown that suits them, where that is the likelier story.

        Beside no unknown the wrong one of two may come nearer to what both together do.
        """
        unknown = told.names & self._discrepancies
        if not self._cfg.beside or (not unknown and self._explained(told)):
            return None
        bare = self._assessor.one(told.names - unknown, told.hypothesis)
        named = bare.names & self._effects
        wanted = swaps(self._case, bare, named, self._candidates)
        doubled = (name for name in sorted(named) if self._case.confusable(name) & named)
        wanted += [(bare.names - {name}, bare.hypothesis) for name in doubled]
        if not wanted:
            return None
        told = told if unknown else self._beside(told)
        stories = [self._beside(each) for each in self._assessor.assess(wanted)]
        simpler = [each for each in stories if self._parameters(each) < self._parameters(told)]
        better = [each for each in stories if self._assessor.gain(each, told).nats > self._cfg.evidence]
        better += [each for each in simpler if not self._assessor.worth(told, each)]
        if not better:
            return None
        best = max(better, key=lambda each: each.score)
        new = best.names & self._effects - named
        return None if any(self._case.suspicious(best.hypothesis, name) for name in new) else best

    def _rival(self, base: Assessment) -> tuple[Assessment, Assessment]:
        """The likeliest unknown, with the effects that show beside it where nothing is left then, and with them."""
        rival = grown = self._beside(base)
        while known := self._known_beside(grown):
            grown = known
        return grown if self._assessor.adequate(grown) else rival, grown

    def _beside(self, found: Assessment) -> Assessment:
        """With the likeliest flexible unknown that it has not; as it is where it has them all."""
        tried = self._with_one(found, sorted(self._discrepancies - found.names))
        return max(tried, key=lambda assessment: assessment.score, default=found)

    def _with_one(self, found: Assessment, names: list[str]) -> list[Assessment]:
        """With each of the most promising of these names."""
        gains = self._case.screen(found.hypothesis, names)
        promising = sorted(names, key=lambda name: -gains[name])[:TRIED]
        return self._assessor.assess([(found.names | {name}, found.hypothesis) for name in promising])

    def _known_beside(self, found: Assessment) -> Assessment | None:
        """With an effect beside the unknowns that were found, where one is worth its name there and is no stand-in."""
        if not (self._cfg.known and found.names & self._discrepancies):
            return None
        if len(found.names & self._effects) >= self._cfg.most:
            return None
        tried = self._with_one(found, [name for name in self._candidates if name not in found.names])
        more = self._simplest(tried) if tried else found
        added = more.names - found.names
        worth = self._assessor.worth(more, found) or self._assessor.most(more, found)
        if not (added and worth) or any(self._case.suspicious(more.hypothesis, name) for name in added):
            return None
        return more if self._more_than_knots(more, found) else None

    def _more_than_knots(self, more: Assessment, less: Assessment) -> bool:
        """Whether names do more than what an unknown's knots are too coarse for, of which little is left everywhere."""
        gain = self._assessor.gain(more, less)
        if not self._assessor.adequate(less):
            return gain.nats > 0
        return gain.nats > self._cfg.promising and (gain.relief > self._cfg.relief or not self._cfg.beside)

    def _strong(self, named: Assessment, rival: Assessment, base: Assessment) -> bool:
        """Whether effects that leave something do most of an unknown's work, and much work, and so keep their names.

        Not against an unknown, and effects beside it, that leave nothing and are fewer.
        """
        if self._assessor.adequate(named) or (self._assessor.adequate(rival) and len(rival.names) < len(named.names)):
            return False
        return named.rest <= MOST * max(rival.rest, self._cfg.adequate) and named.rest <= MUCH * base.rest

    def _simpler(self, rival: Assessment, named: Assessment, base: Assessment) -> bool:
        """Whether the unknown, and what shows beside it, is a better story than the named effects.

        It has to be likelier; where these leave something, less so for every effect, beyond one, that they have more.
        """
        count = len(named.names & self._effects) - len(rival.names & self._effects)
        margin = self._cfg.evidence * (1 if self._assessor.adequate(named) else 2 - count)
        return self._assessor.gain(rival, named).nats > margin and self._assessor.better(rival, base)

    def _extended(self, found: Assessment, doubtful: Names) -> Assessment:
        """With the unknowns that are needed where something is left, without doubtful names whose work they do.

        An unknown has only what effects leave: what is known is looked for beside it before another is added, and keeps
        its name where nothing is left in the end. Else it may do the work of what the unknown's form lacks.
        To a coincidence of unknowns none is added: nothing is sure beside it, and each costs as much as all before.
        """
        before = found.names & self._effects
        while len(found.names & self._discrepancies) < COINCIDENCE and not self._explained(found):
            if known := self._known_beside(found):
                found = known
                continue
            more = self._beside(found)
            if not self._brought(more, found):
                break
            found = self._instead_of_an_unknown(self._shed(more, doubtful))
            bare = self._assessor.one(found.names - self._discrepancies, found.hypothesis)
            if not self._brought(found, bare):  # the unknown only showed the way to a better fit
                return bare
        added = found.names & self._effects - before
        if not added or self._assessor.adequate(found):
            return found
        without = self._assessor.one(found.names - added, found.hypothesis)
        kept = self._assessor.most(found, without) and (self._cfg.beside or self._assessor.little(found))
        return found if kept else without

    def _brought(self, more: Assessment, less: Assessment) -> bool:
        """Whether a flexible unknown brings `more`, where the floor is reached also in few places, but plainly."""
        shows = self._cfg.unknowns and self._assessor.shows(more, less)
        return shows or self._assessor.better(more, less)

    def _instead_of_an_unknown(self, found: Assessment) -> Assessment:
        """With an effect in the place of an unknown that only did its work while another was not there yet.

        Where all of them leave nothing, unless the unknown is likelier by as much as a name has to bring.
        """
        unknown = sorted(found.names & self._discrepancies)
        if not (self._cfg.beside and len(unknown) > 1 and self._assessor.adequate(found)):
            return found
        less = self._assessor.assess([(found.names - {name}, found.hypothesis) for name in unknown])
        named = max(filter(None, map(self._known_beside, less)), key=lambda each: each.score, default=found)
        return named if named.score > found.score - self._cfg.evidence else found

    def _explained(self, found: Assessment) -> bool:
        """Whether nothing beyond noise is left, nor anything unknown that shows in too few places to lift the mean."""
        adequate = self._assessor.adequate(found)
        if not (adequate and self._cfg.unknowns):
            return adequate
        gains = self._case.screen(found.hypothesis, sorted(self._discrepancies - found.names))
        return max(gains.values(), default=0.0) < self._cfg.promising

    def _slight(self, found: Assessment) -> bool:
        """Whether what is left is little beside the gap, and beside what a named effect of roughly known form does."""
        if not self._assessor.little(found):
            return False
        rough = sorted(found.names & self._case.rough)
        without = self._assessor.assess([(found.names - {name}, found.hypothesis) for name in rough])
        return any(found.rest <= ROUGH * less.rest for less in without)

    def _unmask(self, found: Assessment, extended: Assessment) -> Assessment:
        """Where something unknown is left, an effect that looks like a stand-in for it loses its name.

        `extended`: the set beside unknowns that take something off.
        """
        whole = found = self._freed(found, extended)
        while True:
            masks = [name for name in sorted(found.names & self._effects) if self._stands_in(name, found, whole)]
            if not masks:
                return found
            without = self._assessor.assess([(found.names - {name}, found.hypothesis) for name in masks])
            found = max(without, key=lambda less: less.score)
            if self._cfg.beside and found.names & self._effects:  # what it did is left to an unknown, not to the others
                more = self._beside(found)
                found = self._shed(more, self._effects) if self._assessor.most(more, found) else found

    def _freed(self, found: Assessment, extended: Assessment) -> Assessment:
        """With unknowns beside effects that look like stand-ins: those that keep their worth, if none does then."""
        if not self._cfg.beside:
            return found
        masks = {name for name in found.names & self._effects if self._case.suspicious(found.hypothesis, name)}
        if not masks:
            return found
        for more in (self._beside(found), extended):
            if more.rest > MUCH * found.rest or not self._assessor.better(more, found):
                continue
            more = self._shed(more, self._effects)
            kept = more.names & self._effects
            if kept and not any(self._case.suspicious(more.hypothesis, name) for name in kept):
                return more
        return found

    def _stands_in(self, name: str, found: Assessment, whole: Assessment) -> bool:
        """Whether an effect looks like a stand-in in `found`, from which others that did are gone already.

        What they did is missing there, and shows as if it were wrong with an effect that the `whole` bears out: where
        that is as large with them as without, it stands.
        """
        if not self._case.suspicious(found.hypothesis, name):
            return False
        if found is whole or not self._cfg.beside or self._case.suspicious(whole.hypothesis, name):
            return True
        return not self._alike(name, whole.hypothesis, found.hypothesis)

    def _alike(self, name: str, one: Hypothesis, other: Hypothesis) -> bool:
        """Whether an effect is of the same size in two hypotheses."""
        sizes = [(p.name, p.neutral) for p in self._case.library[name].parameters if p.neutral is not None]
        away = np.array([one.values[name][key] - neutral for key, neutral in sizes])
        moved = np.array([other.values[name][key] - one.values[name][key] for key, _ in sizes])
        return float(np.linalg.norm(moved)) <= ALIKE * float(np.linalg.norm(away))

    def _contradicted(self, found: Assessment) -> Names:
        """Effects that parts of the recording contradict though what is left in all of it is no more than noise."""
        if not self._assessor.adequate(found):
            return Names()
        named = sorted(found.names & self._effects)
        return Names(name for name in named if self._case.contradicted(found.hypothesis, name))

    def _restore(self, found: Assessment) -> Assessment:
        """Nominal parameters back to their nominal values, apart from those that have to differ.

        Where several have to, one effect more or another, or a torque constant, may say the same with fewer names.
        Where something is left they are not named in any case, and have the values that the data ask for.
        """
        unknown = bool(found.names & self._discrepancies)
        if not unknown and not self._assessor.adequate(found):
            return self._shed(found, self._effects)
        found = self._shed(found, self._case.refitted)
        if not unknown:
            found = self._shed(found, self._effects | self._case.refitted)
        named = self._assessor.adequate(found) and not unknown
        if len(found.names & self._case.refitted) < 2 or not named:
            return found
        whole = found.names | self._case.refitted
        free = [name for name in self._candidates if name not in whole]
        gains = self._case.screen(self._assessor.one(whole, found.hypothesis).hypothesis, free)
        promising = sorted(free, key=lambda name: -gains[name])[: self._cfg.contenders]
        others = [whole | {name} for name in promising] + list(self._case.simplify(found.names))
        others += [each.names | self._case.refitted for each in self._swapped(found)]
        for names in others:
            simpler = self._shed(self._assessor.one(names, found.hypothesis), self._case.refitted)
            if len(simpler.names) < len(found.names) and not self._assessor.worth(found, simpler):
                found = simpler
        return self._shed(found, self._effects | self._case.refitted)
