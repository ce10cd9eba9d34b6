"""The tosses to make next: throws that rivals would answer differently, or that excite what was not excited.

Candidates are a few throws of one kind each, no harder than those of the recording. They are simulated, measured with
its noise, and looked at as a recording is: in windows that each begin at a measured state, so that what is known of
those is part of what a throw is worth (Hunter and Reiner 1965, as for joints).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.contact import COEFFICIENTS, pack, simulate
from vision_s2r.fit.case import Experiment, Hypothesis
from vision_s2r.fit.contact.discrepancy import terms_of
from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactScales
from vision_s2r.fit.contact.fitter import ContactFitter, names_of
from vision_s2r.fit.contact.predictor import plain
from vision_s2r.fit.contact.stretches import stretches_of
from vision_s2r.fit.contact.windows import ContactTrack, make_track, windows_of
from vision_s2r.fit.questions import Question, most_telling, settled, shown, told_by, wished
from vision_s2r.recording import ContactRecording
from vision_s2r.recording.contact import LEAST_EPISODE, POSE, VELOCITIES

THROWS = 4  # of a kind
KINDS = 3  # at most, in one recording
SHARES = (0.4, 1.0)  # of the hardest throw of the recording
SECONDS = 1.0  # of a throw
SUBSTEPS = 8
LOW = 0.02  # of the body's depth: a body this high is put down rather than dropped


@dataclass(frozen=True)
class _Reach:
    """How hard the body was thrown: as far as an experiment goes."""

    height: float  # m, of its lowest point
    speed: float  # m/s
    spin: float  # rad/s
    lying: np.ndarray  # [N, 4] attitudes in which it came to rest


def experiment(
    track: ContactTrack,
    rivals: Sequence[Hypothesis],
    not_excited: Sequence[str],
    others: Sequence[str],
    temper: float,
) -> Experiment:
    """What to toss next, in a sentence or two, and how each throw is released, one row a throw.

    `rivals`: the hypothesis first. `temper`: what a window counts, beside those that it overlaps. Where nothing is to
    be told apart and nothing was not excited, or no throw settles it, what shows most of the `others`; empty without
    them.
    """
    base = (rivals[0] if rivals else Hypothesis()).only(CONTACT_FITS)
    asked = list(not_excited)
    if len(rivals) < 2 and not asked and not others:
        return Experiment("")
    candidates = _candidates(track)
    fitters = [_fitter(track, base, first, temper) for first in candidates.values()]
    names, questions = names_of(base), list[Question]()
    for rival in (each.only(CONTACT_FITS) for each in rivals[1:]):
        nats = np.array([fitter.apart(base, rival, names) for fitter in fitters])
        questions.append(Question(told_by(names_of(rival), names), True, nats))
    questions += [_whether(name, base, fitters) for name in asked]
    chosen = most_telling(questions, np.ones(len(fitters)), KINDS)
    told, settles = shown(chosen, questions), bool(chosen)
    if not chosen:
        chosen = most_telling([_whether(name, base, fitters) for name in others], np.ones(len(fitters)), KINDS)
    wishes = wished([f"{CONTACT_FITS[name].excited_by} would show {name}" for name in asked if name not in told])
    if not chosen:
        return Experiment(wishes)
    text = _told([list(candidates)[k] for k in chosen]) + (settled(chosen, questions, names) if settles else "")
    first = np.concatenate([list(candidates.values())[k] for k in chosen])
    return Experiment(f"{text} {wishes}".rstrip(), _columns(first), open=settles)


def _whether(name: str, base: Hypothesis, fitters: Sequence[ContactFitter]) -> Question:
    """Whether there is an effect, at a plausible size, beside the base."""
    size = Hypothesis({**base.values, name: CONTACT_FITS[name].plausible(fitters[0].scales)})
    free = (names_of(base) | frozenset(COEFFICIENTS)) - {name}
    return Question(name, False, np.array([fitter.apart(base, size, free) for fitter in fitters]))


def _candidates(track: ContactTrack) -> dict[str, np.ndarray]:
    """States [THROWS, 13] at release, by what they are called."""
    reach, rng = _reach(track), np.random.default_rng(0)
    lying = reach.lying[rng.permutation(len(reach.lying))[np.arange(THROWS) % len(reach.lying)]]
    tumbling = Rotation.random(THROWS, random_state=0).as_quat()
    ways = 2 * math.pi * (np.arange(THROWS) + 0.3) / THROWS  # of the compass
    along = np.stack([np.cos(ways), np.sin(ways), np.zeros(THROWS)], axis=1)
    across = np.stack([-np.sin(ways), np.cos(ways), np.zeros(THROWS)], axis=1)  # the axis of rolling along
    about, up = Rotation.random(THROWS, random_state=1).apply([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])
    sign = (-1.0) ** np.arange(THROWS)[:, None]
    ground, still = LOW * track.shape.depth, np.zeros((THROWS, 3))
    found: dict[str, np.ndarray] = {}
    for share in SHARES:
        high, fast, turns = share * reach.height, share * reach.speed, share * reach.spin
        slow = min(fast, turns * track.shape.reach)  # of a roll that does not slip
        throws = {
            f"slides at {fast:.2g} m/s": (lying, ground, fast * along, still),
            f"spins on the spot at {turns:.2g} rad/s": (lying, ground, still, turns * sign * up),
            f"tumbles along the support at {slow:.2g} m/s": (
                *(lying, ground, slow * along),
                slow / track.shape.reach * across,
            ),
            f"drops from {high:.2g} m, lying": (lying, high, still, still),
            f"drops from {high:.2g} m, turned at random": (tumbling, high, still, still),
            f"throws from {high:.2g} m at {fast:.2g} m/s that spin at {turns:.2g} rad/s": (
                *(tumbling, high, fast * along),
                turns * about,
            ),
        }
        found |= {name: _released(track, *throw) for name, throw in throws.items()}
    return found


def _reach(track: ContactTrack) -> _Reach:
    """From what was thrown; a drop's height where it only fell, and a roll's spin where it did not turn."""
    state, shape = track.states.state, track.shape
    height = max(float(np.nanmax(track.lowest)), shape.depth)
    speed = np.nanquantile(np.linalg.norm(state[..., 7:10], axis=-1), 0.99)
    fast = max(float(speed), math.sqrt(2 * track.nominal.gravity * height))
    spin = np.nanquantile(np.linalg.norm(state[..., 10:], axis=-1), 0.99)
    last = track.attitude[np.arange(len(track.lengths)), track.lengths - 1]
    return _Reach(height, fast, max(float(spin), fast / shape.reach), last)


def _released(
    track: ContactTrack, attitude: np.ndarray, height: float, velocity: np.ndarray, spin: np.ndarray
) -> np.ndarray:
    """States [THROWS, 13] with the lowest point at a height over the support's middle."""
    position = np.zeros((len(attitude), 3))
    position[:, 2] = height - track.shape.lowest(position, attitude)
    return np.concatenate([position, attitude, velocity, spin], axis=1)


def _fitter(track: ContactTrack, base: Hypothesis, first: np.ndarray, temper: float) -> ContactFitter:
    """What a recording of these throws would show."""
    samples = max(LEAST_EPISODE, round(SECONDS / track.sample_time))
    rows, dt = pack(track.nominal, base.values)[None], track.sample_time
    states = simulate(rows, track.shape, first, samples, dt, substeps=SUBSTEPS, threads=1)[0]
    recorded = make_track(_measured(track, states))
    scales = ContactScales(track.nominal, track.shape, dt)
    predictor = plain(recorded, windows_of(recorded), stretches_of(recorded))
    return ContactFitter.under(base, predictor, scales, terms_of(recorded), temper)


def _measured(track: ContactTrack, states: np.ndarray) -> ContactRecording:
    """Poses of states [E, T, 13] with the noise of the track's."""
    rng, (place, angle) = np.random.default_rng(2), track.states.noise
    count = states.shape[:2]
    turn = Rotation.from_rotvec(rng.normal(0, angle, (*count, 3)).reshape(-1, 3))
    attitude = (turn * Rotation.from_quat(states[..., 3:7].reshape(-1, 4))).as_quat().reshape(*count, 4)
    position = states[..., :3] + rng.normal(0, place, (*count, 3))
    lengths, nominal = np.full(count[0], count[1]), vars(track.nominal)
    return ContactRecording(
        dict(nominal), track.shape, track.sample_time, position, attitude, None, lengths, tuple(range(count[0]))
    )


def _told(names: Sequence[str]) -> str:
    """What to record."""
    throws = ", then ".join(f"{THROWS} {name}" for name in names)
    return f"Record {throws}, {SECONDS:g} s each: next_recording.csv holds how each is released."


def _columns(first: np.ndarray) -> dict[str, np.ndarray]:
    """The table of an experiment, from its states [throws, 13] at release: that of a recording, a row a throw."""
    columns = dict(zip((*POSE, *VELOCITIES), first.T, strict=True))
    return {"episode": np.arange(len(first)).astype(float), "t": np.zeros(len(first)), **columns}
