"""How sure parameters are: the sandwich of a fit whose residuals depend on their neighbours, block by block.

Curvature on the outside, the scatter of the blocks' scores inside (Huber, Fifth Berkeley Symposium, 1967); blocks are
longer than the observer remembers.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from vision_s2r.fit.case import Hypothesis, Intervals
from vision_s2r.fit.joint.disturbance import DISTURBANCE, beside
from vision_s2r.fit.joint.fitter import JointFitter, names_of
from vision_s2r.fit.joint.observer import Observer
from vision_s2r.fit.joint.smooth_unknown import VARIANCES, prior
from vision_s2r.fit.joint.space import INDEX, JointSpace
from vision_s2r.fit.joint.track import JointTrack
from vision_s2r.fit.likelihood import NU, influence
from vision_s2r.fit.selection import SCALE

BLOCK = 100  # samples
WINDOW = 20  # samples, in which the size of an effect is looked at by itself
FINER = 4  # times the integrator's steps, for what its step size does to parameters
# Both calibrated on simulated machines, so that 95 % of the intervals hold the truth: what the sandwich misses of the
# residual's memory, and what another integrator makes of the same parameter, relative to it.
WIDER, INTEGRATOR = 1.4, 5e-4
CLOCK = 5e-5  # s, that the instants at which a servo's loop reads its target and its encoder are not known to
AT_BOUND = 0.01  # of the range
FURTHEST = 10.0  # times what this recording tells: how far off another is; farther off nothing is of first order


@dataclass(frozen=True)
class BlockScores:
    """A fit's curvature and slope, in pieces."""

    space: JointSpace
    point: np.ndarray  # [D]
    curvature: np.ndarray  # [B, D, D] of each block
    slope: np.ndarray  # [B, D]
    segment: np.ndarray  # [B]
    biases: np.ndarray  # [S, D] that the integrator's step size, and a servo's clock, cause, to first order
    smooth: np.ndarray  # [D, D] precision of the prior of something unknown that is smooth
    elsewhere: np.ndarray | float = 0.0  # variance [D] that other motions add, where something is left

    @property
    def stiffness(self) -> np.ndarray:
        """The prior's curvature [D, D]."""
        return np.diag(self.space.stiffness(self.point, self.space.believed(self.point))) + self.smooth

    @property
    def told(self) -> float:
        """How many coordinates the recording tells, rather than the prior of something unknown."""
        return self.space.size - float(np.trace(self.inverse @ self.smooth))

    @cached_property
    def inverse(self) -> np.ndarray:
        """Of the curvature of all blocks and the prior."""
        whole = self.curvature.sum(axis=0) + self.stiffness
        scale = np.sqrt(np.diag(whole))
        scale[scale < 1e-150] = 1.0  # what nothing shows, such as a knot that no sample is near
        return np.linalg.pinv(whole / scale / scale[:, None], rcond=1e-12, hermitian=True) / scale / scale[:, None]


@dataclass(frozen=True)
class Linear:
    """A fit to first order, sample by sample."""

    space: JointSpace
    point: np.ndarray  # [D]
    now: np.ndarray  # [E, T, channels] residuals
    jacobian: np.ndarray  # [D, E, T, channels]
    scale: np.ndarray  # [channels] variances
    push: np.ndarray  # [E, T, channels] weight of each residual

    def slope(self, inside: np.ndarray) -> np.ndarray:
        """Of the samples inside [E, T] (bool), [D]."""
        return -np.einsum("dsk,sk->d", self.jacobian[:, inside], self._pull[inside])

    def curvature(self, inside: np.ndarray) -> np.ndarray:
        """Of the samples inside [E, T] (bool), [D, D]."""
        part = self.jacobian[:, inside]
        return np.asarray(np.einsum("dsk,fsk,sk->df", part, part, self._bend[inside]))

    @cached_property
    def _pull(self) -> np.ndarray:
        return self.push * self.now

    @cached_property
    def _bend(self) -> np.ndarray:
        squared, soft = self.now**2, NU * self.scale
        return np.asarray(np.maximum(self.push * (soft - squared) / (soft + squared), 0.0))


def linear(fitter: JointFitter, hypothesis: Hypothesis) -> Linear:
    """Of a hypothesis, on all segments."""
    track = fitter.track
    space = fitter.space(names_of(hypothesis))
    point = space.start(hypothesis)
    data = fitter.data(range(track.count))
    gain = hypothesis.extra.get(DISTURBANCE, 0.0)
    now, jacobian = (beside(gain, each, track) for each in fitter.observer.linearized(space, point, data.episodes))
    scale = np.maximum(np.asarray(hypothesis.extra[SCALE]), data.floor)
    return Linear(space, point, now, jacobian, scale, influence(now, scale) * data.weight[..., None])


def scores(fitter: JointFitter, hypothesis: Hypothesis, here: Linear) -> BlockScores:
    """Of a hypothesis, on all segments; `here` is what is `linear` of it."""
    track, observer = fitter.track, fitter.observer
    space, point, scale = here.space, here.point, here.scale
    labels, segment = blocks(track.segment, BLOCK)
    inside = [labels == b for b in range(len(segment))]
    pieces = np.array([here.curvature(each) for each in inside]), np.array([here.slope(each) for each in inside])
    episodes, gain = fitter.data(range(track.count)).episodes, hypothesis.extra.get(DISTURBANCE, 0.0)
    fine = Observer(track, observer.substeps * FINER, observer.noise)
    shift = beside(gain, fine.residuals(space, point[None], episodes)[0], track) - here.now
    shifts = [np.clip(shift, -np.sqrt(scale), np.sqrt(scale))]
    if track.servo:
        shifts.append(CLOCK * observer.rates(episodes))
    known = VARIANCES in hypothesis.extra
    smooth = prior(hypothesis.extra[VARIANCES], space) if known else np.zeros((space.size, space.size))
    partial = BlockScores(space, point, *pieces, segment, np.zeros((0, space.size)), smooth)
    biases = np.einsum("detk,setk->sd", here.jacobian, here.push * np.array(shifts)) @ partial.inverse
    return replace(partial, biases=biases)


def blocks(segment: np.ndarray, length: int) -> tuple[np.ndarray, np.ndarray]:
    """Label [E, T] of each sample's block (-1 beyond the end), and each one's segment [B]; `length` samples or more."""
    labels = np.full(segment.shape, -1)
    owners: list[int] = []
    for u in range(segment.max() + 1):
        episode, sample = np.nonzero(segment == u)
        count = max(1, len(sample) // length)
        labels[episode, sample] = len(owners) + np.arange(len(sample)) * count // len(sample)
        owners += [u] * count
    return labels, np.array(owners)


def intervals(of: BlockScores, level: float = 0.95) -> Intervals:
    """Interval of every parameter."""
    space = of.space
    row = space.machines(of.point[None])[0]
    out: Intervals = {name: {} for name in space.effects}
    for c, reach in zip(space.coordinates, _sandwich(of, level)[1], strict=False):
        value = float(row[c.column])
        if c.log:
            reach = min(reach, 20.0)
            out[c.effect][c.parameter] = (value * float(np.exp(-reach)), value * float(np.exp(reach)))
        else:
            out[c.effect][c.parameter] = (value - reach, value + reach)
    return out


def reach(of: BlockScores) -> np.ndarray:
    """How far [D] 95 % intervals reach to either side of the point, discrepancies' too."""
    return _sandwich(of, 0.95)[1]


def covariance(of: BlockScores) -> np.ndarray:
    """Of the parameters of `of.space.coordinates` [K, K] in their own units, of a normal distribution.

    Its standard deviations are those of the 95 % `intervals`; to first order where a coordinate is a logarithm.
    """
    count = len(of.space.coordinates)
    plain, reaches = (each[:count] for each in _sandwich(of, 0.95))
    row = of.space.machines(of.point[None])[0]
    size = np.array([row[c.column] if c.log else 1.0 for c in of.space.coordinates])
    deviation = np.sqrt(np.diag(plain[:, :count]))
    scale = size * reaches / norm.ppf(0.975) / np.maximum(deviation, 1e-300)
    return plain[:, :count] * scale * scale[:, None]


def information(of: BlockScores) -> np.ndarray:
    """What the recording alone, without priors, says of `of.space.coordinates` [K, K]: inverse to a covariance."""
    count = len(of.space.coordinates)
    back = np.linalg.inv(_to_machine(of.space))
    whole = back.T @ of.curvature.sum(axis=0) @ back
    beside = whole[:count, count:]  # what discrepancies might have caused instead is not known
    return whole[:count, :count] - beside @ np.linalg.pinv(whole[count:, count:], hermitian=True) @ beside.T


def at_bound(of: BlockScores, name: str) -> bool:
    """Whether a parameter of this name sits at an end of its range at which it vanishes from sight."""
    space = of.space
    for k, owner in enumerate(space.owner):
        if owner != name:
            continue
        margin = AT_BOUND * (space.high[k] - space.low[k])
        low = of.point[k] < space.low[k] + margin and space.coordinates[k].log
        if low or of.point[k] > space.high[k] - margin:
            return True
    return False


def boundless(of: BlockScores, name: str, limits: Collection[str]) -> bool:
    """Whether one of a name's `limits` may as well lie beyond all that is tried: its interval reaches out of there."""
    space, reaches = of.space, reach(of)
    own = (k for k, c in enumerate(space.coordinates) if space.owner[k] == name and c.parameter in limits)
    return any(of.point[k] + reaches[k] >= space.high[k] for k in own)


def _sandwich(of: BlockScores, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Covariance [D, D] of coded parameters, and how far [D] their intervals reach to either side."""
    space, to_machine = of.space, _to_machine(of.space)
    outside = to_machine @ of.inverse
    # What is believed is as uncertain as the prior says.
    plain = clustered(of, of.slope) + outside @ (space.repeats * of.stiffness) @ outside.T
    quantile = float(student.ppf(0.5 + level / 2, max(len(of.segment) - of.told, 2)))
    reach = WIDER * np.sqrt(np.maximum(np.diag(plain), 0.0)) * quantile
    reach = np.minimum(np.hypot(reach, norm.ppf(0.5 + level / 2) * np.sqrt(of.elsewhere)), FURTHEST * reach)
    reach += np.abs(of.biases @ to_machine.T).sum(axis=0)
    row = space.machines(of.point[None])[0]
    for k, c in enumerate(space.coordinates):
        reach[k] += INTEGRATOR * (1.0 if c.log else abs(row[c.column]))
    return plain, reach


def clustered(of: BlockScores, slopes: np.ndarray) -> np.ndarray:
    """Covariance [D, D] of coded parameters, from the slopes [C, D] of clusters of samples."""
    outside = _to_machine(of.space) @ of.inverse
    count = len(slopes)
    return np.asarray(outside @ (slopes.T @ slopes * count / max(count - 1, 1)) @ outside.T)


def _to_machine(space: JointSpace) -> np.ndarray:
    """[D, D] from coordinates to coded parameters: some are measured from others."""
    matrix = np.eye(space.size)
    columns = {c.column: k for k, c in enumerate(space.coordinates)}
    for k, c in enumerate(space.coordinates):
        if c.above is not None and INDEX[c.above] in columns:
            matrix[k, columns[INDEX[c.above]]] = 1.0
    return matrix


def plainly(here: Linear, name: str, track: JointTrack, forgotten: float) -> Linear:
    """What is left, and what a name makes of it, where large residuals count like others: lost commands are large.

    At each sample an observer forgets this share of what it was off by, beside what it forgets anyway.
    """
    own = [k for k, owner in enumerate(here.space.owner) if owner == name]
    jacobian, inside = np.zeros_like(here.jacobian), track.segment >= 0
    now, jacobian[own] = (beside(forgotten, each, track) for each in (here.now, here.jacobian[own]))
    usual = np.median(now[inside] ** 2, axis=0)
    return replace(here, now=now, jacobian=jacobian, push=inside[..., None] / np.maximum(usual, 1e-300))


def waver(here: Linear, name: str, segment: np.ndarray, window: int = WINDOW) -> tuple[float, float]:
    """Of what is left, the share that lies along a name, window by window; and how far its sizes there lie apart.

    Relative to itself; both of its steadiest parameter, 0 of a name without any. `segment` [E, T] is negative beyond
    the end, `window` is in samples.
    """
    own = [k for k, owner in enumerate(here.space.owner) if owner == name]
    if not own:
        return 0.0, 0.0
    labels, windows = blocks(segment, window)
    within = labels[labels >= 0]

    def of_windows(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.bincount(within, (here.push * a * b).sum(axis=-1)[labels >= 0], len(windows))

    left, sizes, found = float(of_windows(here.now, here.now).sum()), here.space.sizes(here.point), []
    for k in own:
        slope = here.jacobian[k]
        info, step = of_windows(slope, slope), of_windows(slope, here.now)
        size = np.divide(step, info, out=np.zeros_like(step), where=info > 0)
        whole = max(float(info.sum()), 1e-300)
        apart = np.sqrt(float(info @ (size - float(step.sum()) / whole) ** 2) / whole)
        found.append((float(apart) / max(float(sizes[k]), 1e-300), float(size @ step) / max(left, 1e-300)))
    apart, share = min(found)
    return share, apart


def spread(of: BlockScores, name: str) -> float:
    """How much a parameter of this name differs between segments, relative to itself; of its steadiest parameter.

    Each segment's estimate is a step of the fit from the common point, the other names held; what chance alone would
    make of it is taken off.
    """
    own = [k for k, owner in enumerate(of.space.owner) if owner == name]
    if not own:
        return 0.0
    steps, infos = [], []
    for segment in np.unique(of.segment):
        block = of.segment == segment
        curvature = of.curvature[block].sum(axis=0)[np.ix_(own, own)]
        slope = of.slope[block].sum(axis=0)[own]
        info = np.diag(curvature)
        steps.append(slope / np.maximum(info, 1e-300))
        infos.append(info)
    step, info = np.array(steps), np.array(infos)
    weight = info / np.maximum(info.sum(axis=0), 1e-300)
    mean = (weight * step).sum(axis=0)
    variance = (weight * ((step - mean) ** 2 - 1 / np.maximum(info, 1e-300))).sum(axis=0)
    size = np.concatenate([of.space.sizes(of.point), np.full(99, np.inf)])
    return float(np.min(np.sqrt(np.maximum(variance, 0.0)) / np.maximum(size[own], 1e-300)))
