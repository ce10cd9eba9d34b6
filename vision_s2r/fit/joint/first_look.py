"""A first look at a joint's log: its noise, what it remembers, and what the simulator's own error is.

The noise is read off what is left once the largest effects are taken off, plausible or not.
"""

import math
from collections.abc import Collection

import numpy as np
from scipy.signal import lfilter

from vision_s2r.fit.case import NOMINAL, Hypothesis, Names
from vision_s2r.fit.joint.fitter import Floor, JointFitter, names_of
from vision_s2r.fit.joint.noise import fast_variance, inflation, memory, resolved
from vision_s2r.fit.joint.observer import Observer
from vision_s2r.fit.joint.quantization import QuantizationGrid
from vision_s2r.fit.joint.track import HOLDS, JointTrack, fast_noise, led_by
from vision_s2r.fit.likelihood import GAUSSIAN

STEP, SERVO_STEP = 0.004, 0.002  # s, of the integrator, at most
MANY_STEPS, NEGLIGIBLE = 20_000, 0.01  # a log of more is worth longer ones, of an error of this part of the noise
FINER = 4  # times the steps, for the integrator's own error
WINSOR = 25.0  # squared residuals beyond, in units of the noise, count as this: instants, such as impacts
LOUD = 1e-4  # of the noise's variance that no fit goes below while the noise is unknown
LAYERS = 4  # effects that are taken off, at most, before the noise is read off what is left
QUIET = 1.15  # times the noise's own mean square: nothing more is taken off a residual that is smaller
PROMISING, CLEAR = 10.0, 100.0  # nats that an effect seems to gain where there is something left, or seemingly not
SKEW = 0.02  # of a sample time: to no more than this are positions and velocities known to be of the same instant
HALVINGS, STANDS = 6, 1e-6  # of a friction that holds; rad or m, that what stands still may move
DIFFERENT = 30  # samples at most, that say something different of a simulator which lacks something


class FirstLook:
    """What a search needs to know of a log before it begins."""

    track: JointTrack  # its velocities, where none were recorded, read off positions
    fitter: JointFitter  # with the noise as it is
    base: Hypothesis  # nominal parameters refitted, and what is certain
    likely: Hypothesis  # … and the largest effects
    promising: set[str]  # effects that seem to gain something, plausible or not
    noise: np.ndarray  # [channels] variance of the measurement
    tolerance: np.ndarray  # [channels] mean square error of the integrator
    expected: np.ndarray  # [channels] of the squared residual, where the machine is right
    unremarkable: np.ndarray  # [channels] of one that is no gap
    temper: np.ndarray  # [channels] effective samples a sample

    def __init__(
        self,
        track: JointTrack,
        names: Names,
        library: Collection[str],
        apart: Collection[str],
        grids: tuple[QuantizationGrid | None, QuantizationGrid | None],
        near: Hypothesis,
        jobs: int,
    ) -> None:
        """`names` are of the base, `apart` effects of the library that are not tried.

        `grids`: the encoder's, if its quantization is an effect of the library, and if it is none. `near` is what a
        search has found already; the noise is read off what it leaves, where that is less.
        """
        self.track, self._names, self._library, self._apart = track, names, frozenset(library), frozenset(apart)
        (self._grid, unknown_grid), self._near, self._jobs = grids, near, jobs
        self._segments = range(track.count)
        self.promising = set()
        self._look(unknown_grid)

    def _look(self, unknown_grid: QuantizationGrid | None) -> None:
        best, noise = self._taken_off()
        self.likely, self.noise = best, self._measured(noise, unknown_grid)
        inflated = self.noise * inflation(self.fitter, best, self.noise)
        self.tolerance = self._tolerance(best)
        self.expected = inflated + self.tolerance
        self.unremarkable = self.expected + self._skewed()
        residuals = self.fitter.residuals(best, self._segments)
        self.temper = 1 / memory(residuals, self.track.lengths)
        self.fitter = self._make_fitter(self._repeats(residuals), self.base)

    def _taken_off(self) -> tuple[Hypothesis, np.ndarray]:
        """The likeliest hypothesis of a few effects, and the noise's variance [channels] as what it leaves shows it."""
        longest = SERVO_STEP if self.track.servo else STEP
        self._substeps = max(1, math.ceil(self.track.inputs.sample_time / longest - 1e-9))
        self.fitter = self._make_fitter()
        self.base = self._fit_base()
        if self._substeps * self.track.inputs.lengths.sum() > MANY_STEPS:
            self._coarsen(self.base)
        if self.track.velocity is not None or self.track.servo:
            return self._quietest()
        self._lead(self.base)
        self.base = self._fit_base()
        best = self._quietest()[0]
        self._lead(best)
        self.base = self._fit_base()
        best = self.fitter.fit(names_of(best), self._segments, best)
        return best, fast_variance(self.fitter.residuals(best, self._segments), self.track.lengths)

    def _measured(self, noise: np.ndarray, unknown_grid: QuantizationGrid | None) -> np.ndarray:
        """The noise's variance [channels] with what an encoder's steps say of it."""
        # A joint that hardly moves shows no noise.
        noise = np.where(noise > 0, noise, resolved(self.fitter.observer.seen) ** 2 / 12)
        if self._grid is not None:  # slow motion hides how much rounding moves
            noise[0] = max(noise[0], self._grid.resolution**2 / 12 + self._grid.noise**2)
        if unknown_grid is not None:  # its steps are no noise
            rounding = unknown_grid.resolution**2 / 12
            noise[0] = max(noise[0] - rounding, unknown_grid.noise**2, 1e-3 * rounding)
        return noise

    def _fit_base(self) -> Hypothesis:
        """The simulator with every nominal parameter refitted, and what is certain; no other effect."""
        start = self._holding() if self.track.held else NOMINAL
        return self.fitter.fit(self._names, list(self._segments), start)

    def _holding(self) -> Hypothesis:
        """About the least dry friction that holds a joint which stands still, where any does.

        Less lets it slip, more shows in nothing: no descent goes over that bend.
        """
        low, high = self.track.nominal.coulomb_friction, self.track.holding
        least, now = (self._missed(Hypothesis({HOLDS: {"value": each}})) for each in (high, low))
        if now <= least + STANDS:
            return NOMINAL
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if self._missed(Hypothesis({HOLDS: {"value": middle}})) <= least + STANDS:
                high = middle
            else:
                low = middle
        return Hypothesis({HOLDS: {"value": high}})

    def _missed(self, hypothesis: Hypothesis) -> float:
        """The largest residual of a position."""
        return float(np.abs(self.fitter.residuals(hypothesis, self._segments)[..., 0]).max())

    def _make_fitter(self, repeats: float = 1.0, first: Hypothesis | None = None) -> JointFitter:
        track = self.track
        observer = Observer(track, self._substeps, fast_noise(track.position))
        rough = np.array([fast_noise(track.position), fast_noise(track.observed[..., 1])])[: observer.channels] ** 2
        # What is shown in steps is often met to the digit at rest: no sample is surer than its rounding.
        steps = resolved(observer.seen)
        if self._grid:
            steps[0] = max(steps[0], self._grid.resolution)
        loose = Floor(np.maximum(LOUD * rough, GAUSSIAN * steps**2 / 12), np.ones(observer.channels))
        return JointFitter(
            track, observer, loose, self._grid.values if self._grid else None, repeats, first, self._jobs
        )

    def _coarsen(self, base: Hypothesis) -> None:
        """Take the longest steps of the integrator whose error is nothing beside the noise."""
        fine = self.fitter.residuals(base, self._segments)
        noise, finest = fast_variance(fine, self.track.lengths), self._substeps
        for self._substeps in range(1, finest + 1):
            self.fitter = self._make_fitter()
            coarse = self.fitter.residuals(base, self._segments)
            if (np.mean((coarse - fine) ** 2, axis=(0, 1)) < NEGLIGIBLE * noise).all():
                break

    def _lead(self, hypothesis: Hypothesis) -> None:
        """Lead the observer by velocities that this hypothesis helps to read off positions."""
        space = self.fitter.space(names_of(hypothesis))
        self.track = led_by(self.track, self.fitter.observer.led(space, space.start(hypothesis)))
        self.fitter = self._make_fitter()

    def _quietest(self) -> tuple[Hypothesis, np.ndarray]:
        """The noise's variance [channels], read off what the base leaves once the largest effects are taken off."""
        segments, lengths = self._segments, self.track.lengths
        best, residuals = self.base, self.fitter.residuals(self.base, segments)
        noise = fast_variance(residuals, lengths)
        if self._near is not NOMINAL:
            best = self.fitter.fit(names_of(self._near), segments, self._near)
            residuals = self.fitter.residuals(best, segments)
            noise = np.minimum(noise, fast_variance(residuals, lengths))
        for _ in range(LAYERS):
            apart = {"torque_constant", "proportional_gain", "encoder_quantization", *self._apart}
            free = sorted(self._library - names_of(best) - apart)
            gains = self.fitter.gains(best, free, segments)
            self.promising |= {name for name in free if gains[name] > PROMISING}
            name = max(free, key=lambda each: gains[each], default=None)
            if name is None or gains[name] < (CLEAR if self._quiet(best, residuals, noise) else PROMISING):
                break
            best = self.fitter.fit(names_of(best) | {name}, segments, best)
            residuals = self.fitter.residuals(best, segments)
            noise = np.minimum(noise, fast_variance(residuals, lengths))
        return best, noise

    def _quiet(self, hypothesis: Hypothesis, residuals: np.ndarray, noise: np.ndarray) -> bool:
        """Whether these residuals are about as large as noise makes them."""
        squares = np.minimum(residuals[self.track.segment >= 0] ** 2, WINSOR * noise).mean(axis=0)
        return bool((squares < QUIET * noise * inflation(self.fitter, hypothesis, noise)).all())

    def _repeats(self, residuals: np.ndarray) -> float:
        """Samples that say what one says of a simulator that leaves these residuals [E, T, channels].

        Noise is new after a while. The error of a simulator that lacks something comes again wherever the motion does:
        a hundred steps of one height say what one of them says (Miller and Dunson 2019 raise the likelihood to a power
        likewise).
        """
        squares = np.minimum(residuals[self.track.segment >= 0] ** 2 / self.expected, WINSOR)
        lacking = 1 - 1 / max(float(squares.mean()), 1.0)
        return 1 / float(self.temper.max()) + lacking * len(squares) / DIFFERENT

    def _skewed(self) -> np.ndarray:
        """Mean square residual [channels] of positions that are SKEW late.

        The step of a first-order integrator does that too, by half of itself.
        """
        track = self.track
        velocity = np.nan_to_num(track.observed[..., 1])
        followed = lfilter([0.0, track.leak], [1.0, track.leak - 1.0], velocity, axis=1)  # the observer makes up for it
        late = SKEW * track.sample_time * (velocity - np.where(track.led, followed, 0.0))
        return np.array([np.mean(late[track.segment >= 0] ** 2), 0.0])[: self.fitter.observer.channels]

    def _tolerance(self, hypothesis: Hypothesis) -> np.ndarray:
        coarse, fitter = self.fitter.residuals(hypothesis, self._segments), self.fitter
        fine = JointFitter(
            self.track,
            Observer(self.track, fitter.observer.substeps * FINER, fitter.observer.noise),
            fitter.floor,
            fitter.grid,
        ).residuals(hypothesis, self._segments)
        squares = np.sort((fine - coarse).reshape(-1, coarse.shape[-1]) ** 2, axis=0)
        return squares[: int(0.99 * len(squares))].mean(axis=0)
