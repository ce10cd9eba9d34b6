"""The search for effects beside something unknown, on evidence that is given."""

from types import SimpleNamespace

import pytest

from vision_s2r.diagnose.beside import BesideUnknownSearch
from vision_s2r.diagnose.config import SearchConfig
from vision_s2r.fit.case import NOMINAL, Hypothesis
from vision_s2r.fit.selection import EVIDENCE


class Evident:
    """A case in which a limit brings 13 nats and friction 30, whatever the unknown is."""

    discrepancies, segments = {"unknown": None}, 1

    def __init__(self, guessed=(), limitless=()):
        self.guessed, self.limitless = frozenset(guessed), limitless

    def fit(self, names, segments, start):
        nats = 13.0 * ("limit" in names) + 30.0 * ("friction" in names)
        return Hypothesis({name: {} for name in names - {"unknown"}}, {EVIDENCE: nats, "unknown": 1.0})

    def starts_beside(self, beside, names):
        return dict.fromkeys(names, (13.0, beside))

    def unbounded(self, hypothesis, name):
        return name in self.limitless


def found(case):
    in_turn = lambda function, calls: [function(*call) for call in calls]  # noqa: E731
    assessor = SimpleNamespace(cfg=SearchConfig(), left=lambda found: 0.0, begun=[], run=in_turn)
    search = BesideUnknownSearch(case, assessor, ["friction", "limit"], frozenset())
    return search.best([(frozenset(), NOMINAL)]).values.keys()


@pytest.mark.parametrize(("guessed", "expected"), [((), {"friction", "limit"}), (("damping",), {"friction"})])
def test_beside_guesses_more_is_asked_of_a_name(guessed, expected):
    assert found(Evident(guessed)) == expected


def test_a_limit_that_may_as_well_be_none_is_in_no_set():
    assert found(Evident(limitless=("limit",))) == {"friction"}
