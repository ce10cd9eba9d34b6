"""The recording to make next: commands that rivals would answer differently, or that excite what was not excited.

Candidates are simulated under the hypothesis, under its rivals, and with each effect in question at a plausible size.
What counts is the difference that the hypothesis' own parameters could not imitate, in nats (to first order; the design
of experiments by discrimination, Hunter and Reiner 1965). Chosen one after the other are those that settle most of the
questions, of those that stay in the range that the joint had.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision_s2r.fit.case import Experiment, Hypothesis, Names
from vision_s2r.fit.joint.discrepancy import MEANINGS
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.fitter import JointFitter, names_of
from vision_s2r.fit.joint.space import JointSpace
from vision_s2r.fit.questions import Question, apart, most_telling, settled, shown, told_by, wished
from vision_s2r.joint import DYNAMICS, simulate

SECONDS = 8.0  # of an episode
EPISODES = 3
SHARES = (0.1, 0.3, 1.0)  # of the largest command of the recording
ROOM, FASTER = 1.25, 4.0  # times the range and the largest speed of the recording: as far as an experiment goes
ABOUT_ZERO = 0.01  # of the largest command: a centre of less is none


@dataclass(frozen=True)
class Design:
    """The experiments that a drive can make."""

    unit: str  # of a command
    quantity: str  # target, current, torque or force
    effort: str
    length: str  # unit of a position
    start: float  # position
    centre: float
    peak: float  # the largest command about the centre
    sample_time: float

    @property
    def words(self) -> dict[str, str | float]:
        """For the sentences of `excited_by`."""
        servo = self.quantity == "target"
        unit = f"{self.unit} about {self.centre:.3g} {self.unit}" if self.centre else self.unit
        return {
            "unit": unit,
            "quantity": self.quantity,
            "effort": self.effort,
            "peak": self.peak if servo else 1.5 * self.peak,
            "slow": 0.2,
            "rate": 2.0,
            "fast": 0.2 / self.sample_time,
        }

    def candidates(self) -> dict[str, np.ndarray]:
        """Commands [samples] by what they are called."""
        t = np.arange(round(SECONDS / self.sample_time)) * self.sample_time
        top = 0.1 / self.sample_time
        noise = np.random.default_rng(0)
        held = noise.uniform(-1, 1, len(t))[(t / 0.25).astype(int)]
        chirp = np.sin(2 * np.pi * (0.2 * t + (top - 0.2) * t**2 / (2 * SECONDS)))
        unit = self.words["unit"]
        found: dict[str, np.ndarray] = {}
        for share in SHARES:
            a = share * self.peak
            found |= {
                f"steps of ±{a:.3g} {unit} every second": a * np.sign(np.sin(np.pi * t + 1e-9)),
                f"a sine of {a:.3g} {unit} at 0.25 Hz": a * np.sin(0.5 * np.pi * t),
                f"a sine of {a:.3g} {unit} at 2 Hz": a * np.sin(4 * np.pi * t),
                f"a chirp of {a:.3g} {unit} from 0.2 to {top:.3g} Hz": a * chirp,
                f"random steps of {a:.3g} {unit}, a new one every sample": a * noise.uniform(-1, 1, len(t)),
                f"random steps of {a:.3g} {unit}, a new one every 0.25 s": a * held,
                f"a constant {a:.3g} {unit}, then as much backward": a * np.where(t < SECONDS / 2, 1.0, -1.0),
            }
        return {name: command + self.centre for name, command in found.items()}


def experiment(
    fitter: JointFitter,
    rivals: Sequence[Hypothesis],
    not_excited: Sequence[str],
    others: Sequence[str],
    variance: np.ndarray,
) -> Experiment:
    """What to record next, in a sentence or two, and the commands to run.

    `rivals`: the hypothesis first. `variance` [channels]: of the residual, an effective sample. Where nothing is to be
    told apart and nothing was not excited, or no command settles it, what shows most of the `others`; empty without
    them.
    """
    design = _design(fitter)
    base = rivals[0] if rivals else Hypothesis()
    asked = [name for name in not_excited if JOINT_FITS[name].excited_by]
    candidates = design.candidates()
    commands = np.array(list(candidates.values()))
    questions, chosen, speeds = list[Question](), list[int](), np.zeros(0)
    if len(rivals) > 1 or asked:
        questions, speeds = _questions(fitter, design, commands, base, rivals[1:], asked, variance)
        chosen = most_telling(questions, np.isfinite(speeds), EPISODES)
    told, settles = set(shown(chosen, questions)), bool(chosen)
    if not chosen and others:
        harder, speeds = _questions(fitter, design, commands, base, [], others, variance)
        chosen = most_telling(harder, np.isfinite(speeds), EPISODES)
    wishes = [f"{JOINT_FITS[name].excited_by.format(**design.words)} would show {name}" for name in asked]
    text = wished([wish for wish, name in zip(wishes, asked, strict=True) if name not in told])
    if not chosen:
        return Experiment(text)
    own = frozenset(MEANINGS.get(name, name) for name in names_of(base) - frozenset(DYNAMICS))
    fast = f"{speeds[chosen].max():.2g} {design.length}/s (until now {fitter.track.scales.peak_speed:.2g})"
    record = _told([list(candidates)[k] for k in chosen], fast) + (settled(chosen, questions, own) if settles else "")
    return Experiment(f"{record} {text}".rstrip(), _columns(commands[chosen], design), open=settles)


def _design(fitter: JointFitter) -> Design:
    track = fitter.track
    low, high = float(track.command.min()), float(track.command.max())
    centre, peak = (0.5 * (low + high), 0.5 * (high - low)) if track.servo else (0.0, max(-low, high))
    centre = centre if abs(centre) > ABOUT_ZERO * peak else 0.0
    linear = track.units == "linear"
    effort, length = ("force", "m") if linear else ("torque", "rad")
    if track.servo:
        quantity, unit = "target", length
    elif track.nominal.torque_constant != 1:
        quantity, unit = "current", "A"
    else:
        quantity, unit = effort, "N" if linear else "N·m"
    start = centre if track.servo else float(np.median(track.first[:, 0]))
    return Design(unit, quantity, effort, length, start, centre, peak or 1.0, track.sample_time)


def _questions(
    fitter: JointFitter,
    design: Design,
    commands: np.ndarray,  # [C, T] of the candidates
    base: Hypothesis,
    rivals: Sequence[Hypothesis],
    names: Sequence[str],
    variance: np.ndarray,
) -> tuple[list[Question], np.ndarray]:
    """What is open, and of each candidate [C] its peak speed; inf where it leaves the range of the recording."""
    track, channel = fitter.track, 0 if fitter.track.velocity is None else 1
    first = np.tile([design.start, 0.0], (len(commands), 1))

    def run(space: JointSpace, points: np.ndarray) -> np.ndarray:
        return simulate(
            space.machines(points),
            commands,
            first,
            design.sample_time,
            substeps=fitter.observer.substeps,
            tables=space.tables,
            threads=1,
        )

    nominal = {name for name in DYNAMICS if getattr(track.nominal, name) is not None}
    space = fitter.space(names_of(base) | nominal)
    points, steps = space.differences(space.start(base))
    states = run(space, points)
    plain, slopes = states[0], (states[1:, ..., channel] - states[0, ..., channel]) / steps[:, None, None]

    def question(other: Hypothesis, name: str, free: Names, rival: bool) -> Question:
        theirs = fitter.space(names_of(other))
        change = run(theirs, theirs.start(other)[None])[0, ..., channel] - plain[..., channel]
        basis = slopes[[owner in free for owner in space.owner]]
        return Question(name, rival, _nats(change, basis, weight))

    weight = 1 / variance[channel]
    row = space.row(points[0])
    questions = []
    for rival in rivals:
        questions.append(question(rival, told_by(names_of(rival), names_of(base)), names_of(base), True))
    for name in names:
        fit = JOINT_FITS[name]
        size = fit.plausible(track, row) if fit.plausible else None
        if size is not None:
            there = Hypothesis({**base.values, name: size}, base.extra)
            questions.append(question(there, name, (names_of(base) | nominal) - {name}, False))
    return questions, _speeds(fitter, plain)


def _nats(change: np.ndarray, basis: np.ndarray, weight: float) -> np.ndarray:
    """Of each candidate [C]: of a change [C, T], what the slopes [D, C, T] cannot imitate."""
    return np.array([weight * apart(each, basis[:, c]) for c, each in enumerate(np.nan_to_num(change))])


def _speeds(fitter: JointFitter, states: np.ndarray) -> np.ndarray:
    """The peak speed [C] of states [C, T, 2], inf of those that leave the range of the recording."""
    scales, position = fitter.track.scales, fitter.track.position
    middle = 0.5 * float(np.nanmax(position) + np.nanmin(position))
    far = np.abs(states[..., 0] - middle).max(axis=1)
    fast = np.abs(states[..., 1]).max(axis=1)
    inside = (far <= ROOM * 0.5 * scales.span) & (fast <= FASTER * scales.peak_speed)
    return np.where(inside, fast, np.inf)


def _told(names: Sequence[str], fast: str) -> str:
    """What to record."""
    return f"Record {', then '.join(names)}, {SECONDS:g} s each, up to {fast}: next_recording.csv holds the commands."


def _columns(commands: np.ndarray, design: Design) -> dict[str, np.ndarray]:
    """The table of an experiment, from its commands [episodes, samples]."""
    count, samples = commands.shape
    return {
        "episode": np.repeat(np.arange(count), samples).astype(float),
        "t": np.tile(np.arange(samples) * design.sample_time, count),
        design.quantity: commands.ravel(),
    }
