"""Which parameters a recording can identify, and why not the others."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vision_s2r.fit.case import NOMINAL, Hypothesis, Names
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.excitation import DETECTABLE
from vision_s2r.fit.joint.uncertainty import at_bound, information
from vision_s2r.identify.estimate import title
from vision_s2r.joint import DYNAMICS
from vision_s2r.report import words

# A parameter is tied to others where its variance is so many times what it would be were they known. Derivatives are
# differences: what the equations cannot tell apart comes out beyond this, what a recording hardly can well below.
TIED = 1e5
FLAT = 1e-12  # of the largest curvature, below which there is none
# The first of these that is tied gives way: what a drawing tells, then what is zero in most joints.
YIELDING = ("inertia", "bias_torque", "gravity_torque", "coulomb_friction", "viscous_damping")
SCALED = ("inertia", "coulomb_friction", "viscous_damping")  # with a torque constant


@dataclass(frozen=True)
class Reason:
    """Why an effect cannot be identified, or should not be trusted."""

    why: str
    curable: bool = True  # whether another recording might show it


@dataclass(frozen=True)
class Identifiable:
    """What a recording can identify of what it was asked for."""

    fitted: Hypothesis  # the effects that it can, at their likeliest on all segments
    left: Mapping[str, Reason]  # those that it cannot


def identifiable(case: JointCase, wanted: Names, asked: Names) -> Identifiable:
    """Fit `wanted`, leaving out one effect at a time until what is left can be told apart and shows.

    `asked` are those that were named by the user: no tie is resolved at their cost.
    """
    left: dict[str, Reason] = {}
    if "encoder_quantization" in wanted - case.certain.keys():
        left["encoder_quantization"] = Reason("positions lie on no grid")
    if "torque_constant" in wanted >= set(SCALED):
        name = next((name for name in SCALED if name not in asked), SCALED[0])
        left[name] = Reason("a torque constant scales everything: one of the others has to be known", curable=False)
    names = wanted - left.keys()
    while names:
        fitted = case.fit(names, range(case.segments), NOMINAL)
        not_excited = {name: Reason(why) for name, why in case.unshown(fitted).items()}
        judged = names - {"torque_constant", "encoder_quantization"}
        if judged and judged <= not_excited.keys():  # then ties are only those of noise
            return Identifiable(NOMINAL, left | not_excited)
        found = _tied(case, fitted, asked) or _unshown(case, fitted, not_excited, asked)
        if found is None:
            return Identifiable(fitted, left)
        name, reason = found
        left[name] = reason
        names -= {name}
    return Identifiable(NOMINAL, left)


def doubts(case: JointCase, fitted: Hypothesis) -> dict[str, Reason]:
    """Effects that were identified, but should not be trusted."""
    scores = case.scores(fitted)
    found = _ties(case, fitted)
    for name in sorted(fitted.values.keys() - set(DYNAMICS)):
        if at_bound(scores, name):
            found[name] = Reason("at the end of its range: it may be absent, or without limit here")
    return found


def _tied(case: JointCase, fitted: Hypothesis, asked: Names) -> tuple[str, Reason] | None:
    """The nominal parameter that gives way in a tie, and what it is tied to."""
    ties = _ties(case, fitted)
    return next(((name, ties[name]) for name in YIELDING if name in ties and name not in asked), None)


def _unshown(
    case: JointCase, fitted: Hypothesis, not_excited: Mapping[str, Reason], asked: Names
) -> tuple[str, Reason] | None:
    """One of the not_excited effects: nominal parameters that nobody asked for first, then what brings nothing."""
    for name in YIELDING:
        if name in not_excited and name not in asked:
            return name, not_excited[name]
    segments = range(case.segments)
    for name in sorted(not_excited):
        without = case.fit(frozenset(fitted.values) - {name}, segments, fitted)
        with_it, alone = (sum(blocks.sum() for blocks in case.loglik(each, segments)) for each in (fitted, without))
        if with_it - alone < DETECTABLE:
            return name, not_excited[name]
    return None


def _ties(case: JointCase, fitted: Hypothesis) -> dict[str, Reason]:
    """Effects with a parameter that is much less sure for not knowing the others, and which of these it is."""
    scores = case.scores(fitted)
    known = information(scores)
    size = np.sqrt(np.diag(known))
    size[size == 0] = np.inf  # moves nothing: tied to nothing either
    alike = known / size / size[:, None] + np.diag(np.isinf(size).astype(float))
    flatness, directions = np.linalg.eigh(alike)
    spread = directions / np.maximum(flatness, FLAT) @ directions.T  # covariance, with variance 1 were the others known
    inflation = np.diag(spread)
    correlation = spread / np.sqrt(np.outer(inflation, inflation)) - np.eye(len(spread))
    ties: dict[str, Reason] = {}
    for k, c in enumerate(scores.space.coordinates):
        if inflation[k] >= TIED:
            partner = int(np.argmax(np.abs(correlation[k])))
            other = scores.space.coordinates[partner]
            why = f"tied to {title((other.effect, other.parameter))} (correlation {correlation[k, partner]:+.3f})"
            ties[c.effect] = Reason(words.signed(why), curable=other.effect != "asymmetric_friction")
    return ties
