"""Whole flights, slides and rolls: long stretches without an impact, which a small steady force shows in.

A window of a tenth of a second knows an acceleration through its first velocity, which is read off seven poses. A whole
flight, of all of its poses, knows it many times better: as its duration to the power of minus five halves. Nothing is
chaotic there, so that what is not known of its first state, whatever it is, can be left out to first order.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from vision_s2r.fit.contact.states import HALF, changes, touching
from vision_s2r.fit.contact.windows import LEAST, SPAN, ContactTrack, Starts, Windows, moves

ORDERS = 6  # of the polynomials, from a straight line on, that differences are seen as: a level is nobody's
FLICKER = 5  # samples, in which a point's touch is that of most
LONGEST = 0.4  # s: what goes on for longer is more than one, so that time and place can be told apart


@dataclass(frozen=True, kw_only=True)
class Stretches(Starts):
    """S stretches of N samples at most, each begun at the first state that poses to either side tell."""

    count: np.ndarray  # [S] int64 samples, the first included
    basis: np.ndarray  # [S, ORDERS, N] orthonormal polynomials over the samples of each, 0 beyond


def stretches_of(track: ContactTrack) -> Stretches:
    """The stretches of a track in which the same points touch, up to where the body comes to rest."""
    least = max(LEAST, round(SPAN / track.sample_time))
    most = max(least, round(LONGEST / track.sample_time))
    rows = []
    for e in range(len(track.lengths)):
        for first, count in _calm(track, e):
            span = slice(first, first + count)
            moving = np.flatnonzero(moves(track, track.states.state[e, span]) & track.states.calm[e, span])
            count = min(count, int(moving.max(initial=-least)) + HALF)
            pieces = -(-count // most)
            rows += [
                (e, first + k * (count // pieces), count // pieces) for k in range(pieces if count >= least else 0)
            ]
    return _stretches(track, rows)


def _stretches(track: ContactTrack, rows: list[tuple[int, int, int]]) -> Stretches:
    """Of episodes, first samples and counts."""
    of, at, count = np.array(rows, dtype=np.int64).reshape(-1, 3).T
    longest = int(count.max(initial=1))
    basis = np.stack([_polynomials(int(n), longest) for n in count] or [np.zeros((ORDERS, longest))])[: len(of)]
    return Stretches.at(track, of, at, np.arange(longest), count=count, basis=basis)


def none_of(track: ContactTrack) -> Stretches:
    """No stretch of a track."""
    return _stretches(track, [])


def outside(windows: Windows, stretches: Stretches) -> Windows:
    """The windows that lie in no stretch, which tells all that they would."""
    end = windows.sample + windows.steps[-1]
    within = np.zeros(len(windows.sample), dtype=bool)
    for e, first, count in zip(stretches.episode, stretches.sample, stretches.count, strict=True):
        within |= (windows.episode == e) & (windows.sample >= first - HALF) & (end < first + count)
    return windows.some(np.flatnonzero(~within))


def _calm(track: ContactTrack, e: int) -> list[tuple[int, int]]:
    """First sample and count of each stretch of an episode."""
    samples = int(track.lengths[e])
    touch = touching(track.shape, track.position[e, :samples], track.attitude[e, :samples], track.states.noise)
    touch = median_filter(touch.astype(np.uint8), size=(FLICKER, 1), mode="nearest")
    changed = changes(touch)
    whole = np.where(track.states.calm[e, :samples], changed, -1)
    out, k = [], 0
    while k < samples:
        end = k
        while end < samples and whole[end] == whole[k]:
            end += 1
        if whole[k] >= 0:
            last = min(end + HALF, samples)  # the last of these has calm poses behind it, too
            last = min(last, k + int(np.argmin(np.append(changed[k:last] == whole[k], False))))
            out.append((k, last - k))
        k = max(end, k + 1)
    return out


def _polynomials(count: int, longest: int) -> np.ndarray:
    """[ORDERS, longest] from a straight line on, of the first `count` samples."""
    powers = np.vander(np.linspace(-1, 1, count), ORDERS + 1, increasing=True)
    out = np.zeros((ORDERS, longest))
    out[:, :count] = np.linalg.qr(powers)[0][:, 1:].T
    return out
