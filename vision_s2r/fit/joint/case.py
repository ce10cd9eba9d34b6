"""A log of a joint as a case of the diagnosis."""

import math
import threading
from collections.abc import Container, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, replace

import numpy as np

from vision_s2r.effects import Effect, Parameter
from vision_s2r.fit.case import NOMINAL, Experiment, Hypothesis, Intervals, Names, Samples, Segments, confusable
from vision_s2r.fit.joint import uncertainty
from vision_s2r.fit.joint.discrepancy import MEANINGS, OWN, OWN_BIAS, OWN_OFFSET, of_episodes
from vision_s2r.fit.joint.disturbance import DISTURBANCE
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.excitation import not_excited
from vision_s2r.fit.joint.experiments import experiment
from vision_s2r.fit.joint.first_look import WINSOR, FirstLook
from vision_s2r.fit.joint.fitter import Floor
from vision_s2r.fit.joint.free_run import free_run, gap_errors, gap_metric
from vision_s2r.fit.joint.gap import FreeRunGap
from vision_s2r.fit.joint.noise import fast_variance
from vision_s2r.fit.joint.quantization import QuantizationGrid, find_quantization_grid
from vision_s2r.fit.joint.regimes import scatter
from vision_s2r.fit.joint.smooth_unknown import ALL, VARIANCES, SmoothUnknown
from vision_s2r.fit.joint.stick_slip import stick_slip
from vision_s2r.fit.joint.track import HOLDS, fast_noise, make_track, with_load
from vision_s2r.fit.likelihood import GAUSSIAN, block_loglik
from vision_s2r.joint import DYNAMICS, REFITTED, SERVO, unit
from vision_s2r.recording import JointRecording, split

BLOCK = 50  # samples, at least, that count as one
LOUDER = 0.25  # of the noise's variance: a search that ends with less was misled by it
TOLERANCE = 0.003  # relative change of a nominal parameter that is the simulator's own
ONE_GAIN = "it is one with the proportional gain"
NEVER_OFF = "the drive is never off: it is one with viscous damping"
INSTANTS = "torques of their own instants, as of knocks, lost commands, or a contact that opens"
STILL = "its target never moves"
NO_SERVO = "no targets of a position servo are in the recording"
SCALED = ("gravity_torque", "inertia", "viscous_damping", "coulomb_friction")  # by a gain; what is known best first
LIMITED = 0.01  # of the samples of a servo whose law reaches its limit
ALONG = 0.6  # of what is left lies along an effect that is not of one size
# The same from instant to instant: of as few samples, share, relative spread. Both where residuals remember and where
# an observer forgets this share of what it was off by, so that each is of its own samples.
INSTANT, ALONG_INSTANTS, UNLIKE, FORGOTTEN = 4, 0.45, 0.25, (0.0, 0.25)
INCONSTANT = 0.3  # relative spread over segments that a true effect's steadiest parameter does not have


class JointCase:
    """Episodes of a joint beside the simulator of `vision_s2r.joint`.

    The search looks at the residual of a leaky observer in position and velocity, or, where the joint is a position
    servo, of a free run. The gap is that of the velocity in free run, a servo's that of the position. An episode is a
    segment; fewer than five are cut into stretches.
    """

    kind = "joint"
    unsteady = ""
    allowance = 0.0
    measured: Mapping[str, float] = {}
    sharp = False
    discrepancies: Mapping[str, str] = MEANINGS

    def __init__(
        self, recording: JointRecording, library: Mapping[str, Effect], near: Hypothesis = NOMINAL, jobs: int = 1
    ) -> None:
        """`near` is what a search has found already; the noise is read off what it leaves, where that is less.

        `jobs`: threads that look at effects; what they find does not depend on it.
        """
        self.recording, self.library, self._jobs = recording, library, jobs
        off = recording.supply is not None and bool((recording.supply <= 0).any())
        self._apart = _not_tried(recording, library, off)
        self.guessed = _guessed(recording, library)
        self.rough: Names = frozenset(name for name in library if JOINT_FITS[name].rough)
        self.motions = recording.motions
        self.metric, self.unit = gap_metric(recording)
        grid = find_quantization_grid(recording.position, recording.lengths)
        known = grid is not None and "encoder_quantization" in library
        self.certain: Mapping[str, float] = {"encoder_quantization": grid.evidence} if grid and known else {}
        self._grid: QuantizationGrid | None = grid if known else None
        track = make_track(recording, grid is not None and _is_derived(recording))
        self.refitted = frozenset({HOLDS} & library.keys()) if track.held else _refitted(recording, library, off)
        self.segments = track.count
        self.replaced: Mapping[str, float] = asdict(track.nominal)
        base, grids = self._with_own(self.refitted | frozenset(self.certain)), (self._grid, None if known else grid)
        self._still = dict.fromkeys(library.keys() - {HOLDS}, STILL) if track.held else {}
        self._begin(FirstLook(track, base, library, self._apart.keys() | self._still.keys(), grids, near, jobs))
        self.described = self._describe()
        # A law that leads the joint back makes of each torque more than an observer's correction undoes.
        self.disturbance: Names = frozenset() if track.servo else frozenset({DISTURBANCE})
        self._disturbed: SmoothUnknown | None = None
        self._lock = threading.Lock()
        self._scores: dict[object, uncertainty.BlockScores] = {}
        self._linear: dict[str, uncertainty.Linear] = {}  # of the hypothesis that was asked for last: they are large

    def _begin(self, look: FirstLook) -> None:
        """What a first look found, and what is made of it."""
        self.track, self._fitter, self.likely = look.track, look.fitter, look.likely
        self.noise, self.tolerance = look.noise, look.tolerance  # [channels] variances
        self._expected, self._unremarkable, self._temper = look.expected, look.unremarkable, look.temper
        self._floor = GAUSSIAN * look.expected
        self._smooth = SmoothUnknown(look.fitter, Floor(self._floor, look.temper))
        self._gap = FreeRunGap(look.fitter, look.noise, self._grid)
        self._labels, self._owners = uncertainty.blocks(look.track.segment, int(max(BLOCK, 5 / look.temper.min())))
        idle = [name for name in self.library if name not in look.promising | self._apart.keys()]
        unseen = not_excited(look.fitter, look.base, look.expected / look.temper, idle)
        self.not_excited: Mapping[str, str] = {**unseen, **self._still, **self._apart}

    def _with_own(self, names: Names) -> Names:
        """With what each recording has of its own, where there are several: a bias torque, a position offset."""
        if self.recording.source is None or not self.recording.source.any():
            return names
        return names | {own for name, own in OWN.items() if name in names}

    def quieter(self, found: Hypothesis) -> "JointCase | None":
        """The same recording with the noise that this hypothesis leaves, where that is far less than was thought.

        Where samples are few, motion that no first look explains is as fast as noise is. And effects that a first look
        takes for something unknown may be such as no integrator follows, whose errors were then allowed for.
        """
        residuals = self._fitter.residuals(found, range(self.segments))
        fast, squares = fast_variance(residuals, self.track.lengths), residuals[self.track.segment >= 0] ** 2
        louder = (fast < LOUDER * self.noise) | (squares.mean(axis=0) < LOUDER * self._expected)
        return JointCase(self.recording, self.library, found, self._jobs) if louder.any() else None

    def session(self) -> AbstractContextManager[None]:
        """Nothing is held."""
        return nullcontext()

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's unit in this recording."""
        return unit(parameter, self.recording.units)

    # -- fits and scores

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        """The most likely parameters of these effects and discrepancies on these segments; `start` is near, or None.

        All discrepancies at once are a Gaussian process: of a part of the segments, the fit of all is moved. A bias
        torque and a position offset are each recording's own where there are several.
        """
        names = self._with_own(names)
        if names >= ALL:
            begun, smooth = start or NOMINAL, self._smooth_beside(names)
            return smooth.fit(names, begun) if len(segments) == self.segments else smooth.part(begun, segments)
        return self._fitter.fit(names, list(segments), start)

    def loglik(self, hypothesis: Hypothesis, segments: Segments) -> list[np.ndarray]:
        """Log-likelihood [blocks] (nats) of each segment, tempered by how long residuals remember.

        Each block's scale is its own, as large as its residual: how far a simulator is off differs from motion to
        motion, and one that it misses altogether must not weigh a hundred times more for what it gets right elsewhere.
        """
        residuals = self._fitter.residuals(hypothesis, segments)
        sums = block_loglik(residuals, self._labels, len(self._owners), self._floor) @ self._temper
        return [sums[self._owners == k] for k in segments]

    def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared residual [segments] in units of what is no gap, single instants limited."""
        squares = self._fitter.residuals(hypothesis, segments) ** 2 / self._unremarkable
        share = self._temper / self._temper.sum()  # a channel counts by how much it has to say
        each, plain = np.minimum(squares, WINSOR) @ share, squares @ share
        # A gap that is large everywhere is as large as it is; only rare instants are limited.
        return np.array([self._limited(each, plain, self.track.segment == k) for k in segments])

    @staticmethod
    def _limited(each: np.ndarray, plain: np.ndarray, inside: np.ndarray) -> float:
        rare = float((plain[inside] > WINSOR).mean()) < 0.02
        return float((each if rare else plain)[inside].mean())

    def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared error [segments] of the gap's metric in free run, of the effects alone: a replay's.

        Discrepancy terms are no part of a simulator that somebody could use; what a recording has of its own is.
        """
        rows = self.rows(segments)
        episodes = sorted({episode for episode, _, _ in rows})
        some = split(self.recording, episodes)
        errors = gap_errors(some, _free_run(some, hypothesis))
        return np.array([float(np.nanmean(errors[episodes.index(e), first:end])) for e, first, end in rows])

    def rows(self, segments: Segments) -> list[tuple[int, int, int]]:
        """Of each segment the episode, its first row and the row behind its last, in the recording."""
        step = round(self.track.sample_time / self.recording.sample_time)
        found = []
        for k in segments:
            episodes, at = np.nonzero(self.track.segment == k)
            end = min(int(at[-1] + 1) * step, int(self.recording.lengths[episodes[0]]))
            found.append((int(episodes[0]), int(at[0]) * step, end))
        return found

    def floor(self, segments: Segments) -> np.ndarray:
        """That of the measurement's noise alone."""
        return np.full(len(segments), self._gap.noise_variance)

    def samples(self, hypothesis: Hypothesis) -> Samples:
        """The squared errors of the observer's velocity, sample by sample."""
        return self._gap.samples(hypothesis, uncertainty.blocks(self.track.segment, uncertainty.BLOCK)[0])

    def moved(self, hypothesis: Hypothesis, name: str) -> Samples | None:
        """How far an effect moves the velocity within one sample, along the axes of its definition."""
        if not JOINT_FITS[name].along:
            return None
        return self._gap.moved(hypothesis, name, uncertainty.blocks(self.track.segment, uncertainty.BLOCK)[0])

    # -- what to try

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats each of these names would gain."""
        if hypothesis.extra.keys() & {DISTURBANCE, *hypothesis.extra.get(VARIANCES, {})}:
            return {name: gain for name, (gain, _) in self.starts_beside(hypothesis, names).items()}
        return self._fitter.gains(hypothesis, list(names), range(self.segments))

    def starts_beside(self, hypothesis: Hypothesis, names: Sequence[str]) -> Mapping[str, tuple[float, Hypothesis]]:
        """About how many nats of evidence each effect would gain beside a Gaussian process, and where it starts."""
        return self._smooth_beside(hypothesis.extra).screen(hypothesis, names)

    def _smooth_beside(self, names: Container[str]) -> SmoothUnknown:
        """The processes, beside a disturbance if the names have it."""
        if DISTURBANCE not in names:
            return self._smooth
        with self._lock:
            if self._disturbed is None:
                self._disturbed = self._smooth.disturbed(self._with_own(self.refitted | frozenset(self.certain)))
        return self._disturbed

    def proposals(self) -> Sequence[Names]:
        """None: every effect is tried."""
        return []

    def simplify(self, names: Names) -> Sequence[Names]:
        """A gain (a torque constant, or a servo's) for several nominal parameters that are scaled together."""
        gain = "proportional_gain" if "torque_constant" in self._apart else "torque_constant"
        # What is believed to be 0 stays 0 under any gain: nothing is known that a gain could keep.
        scaled = [name for name in SCALED if name in names and getattr(self.track.nominal, name)]
        if gain not in self.library or len(scaled) < 2:
            return []
        # A gain scales them all: with it, one of them stays nominal and the others may differ.
        return [(names | self.refitted) - {name} | {gain} for name in scaled]

    def confusable(self, name: str) -> Names:
        """Effects that may pass for this one."""
        return confusable(name, JOINT_FITS.items())

    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the effect changes less than the simulator's own error does."""
        values = hypothesis.values.get(name)
        if values is None:
            return False
        if name in DYNAMICS:
            nominal = float(getattr(self.track.nominal, name))
            if nominal and abs(values["value"] / nominal - 1) < TOLERANCE:
                return True
        if name == "encoder_quantization":
            return False
        both = (hypothesis, hypothesis.without(name))
        one, other = (self._fitter.residuals(each, range(self.segments)) for each in both)
        squares = ((one - other)[self.track.segment >= 0] ** 2).mean(axis=0)
        return bool((squares / (4 * self.tolerance + 1e-3 * self._expected)).max() < 1)

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether parameters are at a bound, or differ between segments as a stand-in's do."""
        if name in ("encoder_quantization", *MEANINGS) or name not in hypothesis.values:
            return False
        scores = self.scores(hypothesis)
        if name not in DYNAMICS and uncertainty.at_bound(scores, name):
            return True
        return uncertainty.spread(scores, name) > INCONSTANT

    def unbounded(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether a limit may as well be beyond all that is tried.

        Of two limits one is enough: a drive whose torque has none, and whose speed has, is a wall in front of any speed
        that a controller holds. None of a servo, whose controller is in the simulator.
        """
        if self.recording.servo:
            return False
        limits = [each.name for each in self.library[name].parameters if each.neutral == math.inf]
        return bool(limits) and uncertainty.boundless(self.scores_elsewhere(hypothesis), name, limits)

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: what is explained is not asked again."""
        return False

    def wavers(self, hypothesis: Hypothesis, name: str) -> bool:
        """From window to window, and of some effects from instant to instant."""
        here, segment = self._linearized(hypothesis), self.track.segment
        share, apart = uncertainty.waver(here, name, segment)
        if share > ALONG and apart > INCONSTANT:
            return True
        if not JOINT_FITS[name].instants:
            return False
        views = [uncertainty.plainly(here, name, self.track, each) for each in FORGOTTEN]
        found = [uncertainty.waver(each, name, segment, INSTANT) for each in views]
        return all(share > ALONG_INSTANTS and apart > UNLIKE for share, apart in found)

    def may_vanish(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether what regimes of this motion ask for leaves room for an effect that vanishes in another."""
        if self.unbounded(hypothesis, name):
            return True
        ends = self.intervals_elsewhere(hypothesis)[name]
        none = {each.name: each.neutral for each in self.library[name].parameters if each.neutral is not None}
        return bool(none) and all(ends[key][0] <= value <= ends[key][1] for key, value in none.items())

    def intervals(self, hypothesis: Hypothesis) -> Intervals:
        """95 % of every parameter."""
        return self._intervals(hypothesis, self.scores(hypothesis)) if hypothesis.values else {}

    def intervals_elsewhere(self, hypothesis: Hypothesis) -> Intervals:
        """Of every parameter, of what another motion would say where the hypothesis lacks something."""
        return self._intervals(hypothesis, self.scores_elsewhere(hypothesis))

    def scores_elsewhere(self, hypothesis: Hypothesis) -> uncertainty.BlockScores:
        """`scores` that are as sure as another motion leaves them where the hypothesis lacks something."""
        key = "elsewhere", repr(hypothesis)
        if key not in self._scores:
            scores, axes = self.scores(hypothesis), self.samples(hypothesis).axes
            more = scatter(scores, self._linearized(hypothesis), axes, self.track.segment >= 0)
            with self._lock:
                self._scores[key] = replace(scores, elsewhere=more)
        return self._scores[key]

    def _intervals(self, hypothesis: Hypothesis, scores: uncertainty.BlockScores) -> Intervals:
        found = uncertainty.intervals(scores)
        if self._grid and "encoder_quantization" in hypothesis.values:
            found["encoder_quantization"] = self._grid.intervals(self.track.scales.span)
        return found

    def scores(self, hypothesis: Hypothesis) -> uncertainty.BlockScores:
        """Curvature and slope of the fit that this hypothesis is."""
        key = repr(hypothesis)
        if key not in self._scores:
            found = uncertainty.scores(self._fitter, hypothesis, self._linearized(hypothesis))
            with self._lock:
                self._scores[key] = found
        return self._scores[key]

    def _linearized(self, hypothesis: Hypothesis) -> uncertainty.Linear:
        key = repr(hypothesis)
        found = self._linear.get(key) or uncertainty.linear(self._fitter, hypothesis)
        self._linear = {key: found}
        return found

    def experiment(self, rivals: Sequence[Hypothesis], not_excited: Sequence[str]) -> Experiment:
        """The recording to make next, for the drive that it has: what a servo alone can show is asked of servos."""
        wanted = [name for name in not_excited if name not in self._apart]
        apart = self._apart.keys() | self._still.keys()
        others = sorted(self.library.keys() - apart - rivals[0].values.keys()) if rivals else []
        return experiment(self._fitter, rivals, wanted, others, self._expected / self._temper)

    def unshown(self, hypothesis: Hypothesis) -> dict[str, str]:
        """Effects of the hypothesis that the recording could not have shown beside its others, and why."""
        return not_excited(self._fitter, hypothesis, self._expected / self._temper, sorted(hypothesis.values))

    def symptoms(self, hypothesis: Hypothesis, final: Hypothesis = NOMINAL) -> list[str]:
        """What a joint does that no function of the search shows, in words: `final` is the search's end."""
        effects = sorted(hypothesis.values.keys() - self.refitted)
        unsteady = [
            f"{name.replace('_', ' ')} of another size from instant to instant"
            for name in effects
            if self.wavers(hypothesis, name)
        ]
        if not self.recording.servo:
            return unsteady + [INSTANTS] * (DISTURBANCE in final.extra)
        simulated = _free_run(self.recording, hypothesis)[..., 0]
        found = stick_slip(self.recording, simulated, self._grid.resolution if self._grid else 0.0)
        return unsteady + ([found.described(gap_metric(self.recording)[1])] if found else [])

    def _describe(self) -> str:
        if self.track.servo:
            return (
                "position, which is what a position servo is for, "
                "in a free run from each episode's first row to its end, on stretches that no fit has seen"
            )
        velocity = "velocity" if self.track.velocity is not None else "velocity, as positions give it,"
        return f"{velocity} in a free run from each episode's first row to its end, on stretches that no fit has seen"


def _free_run(recording: JointRecording, hypothesis: Hypothesis) -> np.ndarray:
    """A free run [E, T, 2], each recording of several with the bias torque and the position offset of its own."""
    source, values = recording.source, hypothesis.values
    if source is None:
        return free_run(recording, values)
    none = np.zeros(int(source.max()))
    loads = -of_episodes(source, hypothesis.extra.get(OWN_BIAS, none))
    like = recording.command if recording.load_inertia is None else recording.load_inertia
    recording = replace(recording, external=with_load(recording.external, like, loads[:, None]))
    zeros = of_episodes(source, hypothesis.extra.get(OWN_OFFSET, none))
    states = np.full((*recording.position.shape, 2), np.nan)
    for zero in np.unique(zeros):
        rows = np.flatnonzero(zeros == zero).tolist()
        some = split(recording, rows)
        shared = values.get("position_offset", {"value": recording.nominal.get("position_offset", 0.0)})["value"]
        moved = {**values, "position_offset": {"value": shared + zero}} if zero else values
        states[rows, : some.position.shape[1]] = free_run(some, moved)
    return states


def _not_tried(recording: JointRecording, library: Mapping[str, Effect], off: bool) -> dict[str, str]:
    """Effects of the library that this recording could not tell from others, and why; its drive is `off` at times."""
    apart = {} if _reaches_its_limit(recording) else {"torque_constant": ONE_GAIN}
    if not recording.servo:
        apart = dict.fromkeys(SERVO, NO_SERVO)
    apart |= {} if off else {"back_emf": NEVER_OFF}
    return {name: why for name, why in apart.items() if name in library}


def _refitted(recording: JointRecording, library: Mapping[str, Effect], off: bool) -> Names:
    """Nominal parameters that the recording tells apart; its drive is `off` at times.

    The damping that a model believes in is in part the motor's, which goes with its drive. Where that is never off,
    nothing but what is believed parts them.
    """
    parted = off or bool(recording.nominal.get("back_emf"))
    return frozenset(({*REFITTED} | ({"back_emf"} if parted else set())) & library.keys())


def _guessed(recording: JointRecording, library: Mapping[str, Effect]) -> Names:
    """A servo's torque is known to nobody, and its constants are copied from elsewhere; a weight was weighed."""
    weighed = {"gravity_torque"} if recording.nominal.get("gravity_torque") else set()
    return frozenset({*DYNAMICS} & library.keys() - weighed if recording.servo else ())


def _reaches_its_limit(recording: JointRecording) -> bool:
    """Whether a position servo asks for more than its drive gives, now and then: that tells its gains apart."""
    gain = recording.nominal.get("proportional_gain")
    if not recording.servo or gain is None:
        return False
    asked = np.abs(gain * (recording.command - recording.position))
    return bool((asked > recording.nominal["command_limit"]).mean() > LIMITED)


def _is_derived(recording: JointRecording) -> bool:
    """Whether the velocity is no more than the central difference of the positions."""
    if recording.velocity is None:
        return False
    inner, time = recording.velocity[:, 1:-1], recording.time
    central = (recording.position[:, 2:] - recording.position[:, :-2]) / (time[:, 2:] - time[:, :-2])
    difference = np.nanstd(inner - central)
    rounding = fast_noise(central)
    return bool(difference < 0.5 * max(rounding, 1e-12))
