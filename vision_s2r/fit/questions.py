"""What a recording leaves open, and which experiments settle most of it: the same for every kind of recording."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision_s2r.fit.case import Names
from vision_s2r.fit.least_squares import solved

DECISIVE = 20.0  # nats that settle a question
TOLD = 1.0  # nats, below which two rivals are said to be told apart by nothing
WISHES = 4  # that are said
LEAST = 0.05  # of a question, about, that one more experiment should settle


@dataclass(frozen=True)
class Question:
    """What an experiment is to settle, and how far each candidate does [C], nats."""

    name: str  # of an effect that was not excited, or of a rival
    rival: bool
    nats: np.ndarray


def apart(change: np.ndarray, slopes: np.ndarray) -> float:
    """Nats by which a change of predictions [N] shows: what the slopes [D, N] of other parameters cannot imitate.

    Both in units of the noise; to first order, in the slopes.
    """
    basis = np.nan_to_num(slopes).reshape(len(slopes), change.size).T
    basis = basis / np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
    rest = change - basis @ solved(basis, change, 1e-9)
    return 0.5 * float(rest @ rest)


def most_telling(questions: Sequence[Question], allowed: np.ndarray, most: int) -> list[int]:
    """Up to `most` of the candidates, of those `allowed` [C], that together settle most, the most telling first."""
    chosen: list[int] = []
    if not questions:
        return chosen
    nats = np.array([question.nats for question in questions]) * allowed  # [Q, C]
    worth = np.array([len(questions) if question.rival else 1.0 for question in questions])

    for _ in range(most):
        total = nats[:, chosen].sum(axis=1, keepdims=True)
        gains = worth @ (np.log1p((total + nats) / DECISIVE) - np.log1p(total / DECISIVE))
        gains[chosen] = 0.0
        if gains.max() < LEAST:
            break
        chosen.append(int(np.argmax(gains)))
    return chosen


def shown(chosen: Sequence[int], questions: Sequence[Question]) -> list[str]:
    """The effects that were not excited and that these candidates would show."""
    return [q.name for q in questions if not q.rival and q.nats[list(chosen)].sum() >= DECISIVE]


def told_by(rival: Names, base: Names) -> str:
    """What tells a rival's names from the hypothesis': those that it adds, or those that it lacks."""
    return " and ".join(sorted(rival - base) or [f"without {each}" for each in sorted(base)])


def settled(chosen: Sequence[int], questions: Sequence[Question], base: Names) -> str:
    """What the candidates would settle, in a sentence that begins with a blank; none for nothing.

    `base`: what the hypothesis has, that rivals are told from.
    """
    told: dict[str, float] = {}  # by rival; of several of one name, what is told at least
    for question in questions:
        if question.rival:
            told[question.name] = min(float(question.nats[list(chosen)].sum()), told.get(question.name, np.inf))
    own = ", ".join(sorted(base)) or "nominal values"
    rivals = [f"{name} ({nats:.2g} nats)" for name, nats in told.items() if nats >= TOLD]
    parts = [f"tells {own} from {', from '.join(rivals)}"] if rivals else []
    names = shown(chosen, questions)
    parts += [f"would show {', '.join(names)}"] if names else []
    return f" It {' and '.join(parts)}." if parts else ""


def wished(wishes: Sequence[str]) -> str:
    """The first of what a user had better record, as one sentence; empty for none."""
    text = "; ".join(wishes[:WISHES])
    return f"{text[0].upper()}{text[1:]}." if text else ""
