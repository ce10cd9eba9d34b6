"""What tells hypotheses apart, by hand."""

import numpy as np
import pytest

from vision_s2r.fit.questions import Question, apart, most_telling, settled, shown, told_by, wished


def test_only_what_others_cannot_imitate_tells_apart():
    change = np.array([3.0, 4.0, 0.0])
    assert apart(change, np.zeros((0, 3))) == pytest.approx(12.5)  # nothing is free
    assert apart(change, np.array([[7.0, 0.0, 0.0]])) == pytest.approx(8.0)
    assert apart(change, np.array([[[3.0], [4.0], [0.0]]])) == pytest.approx(0.0, abs=1e-12)


def test_candidates_that_together_settle_most():
    questions = [
        Question("play", False, np.array([30.0, 0.0, 29.0])),
        Question("lag", True, np.array([0.0, 25.0, 0.0])),
    ]
    assert most_telling(questions, np.ones(3), 2) == [1, 0]  # a rival counts for as much as all that was not excited
    assert most_telling(questions, np.array([0.0, 1.0, 1.0]), 2) == [1, 2]
    assert shown([0], questions) == ["play"] and shown([1], questions) == []
    assert settled([0, 1], questions, frozenset()) == " It tells nominal values from lag (25 nats) and would show play."


def test_rivals_are_said_once_and_only_those_that_are_told_apart():
    rivals = [("lag", 25.0), ("gain", 1e-6), ("lag", 3.0), ("play", 40.0)]
    questions = [Question(name, True, np.array([nats])) for name, nats in rivals]
    assert settled([0], questions, frozenset()) == " It tells nominal values from lag (3 nats), from play (40 nats)."


def test_what_is_open_is_said_in_words():
    assert told_by(frozenset({"play", "lag"}), frozenset({"lag"})) == "play"
    assert told_by(frozenset(), frozenset({"lag", "play"})) == "without lag and without play"
    assert wished([]) == "" and wished(["steps of 3 N·m would show play"]) == "Steps of 3 N·m would show play."
