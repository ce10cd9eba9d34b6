"""The residual that the search looks at: of an observer, which leaks a little of the measured state into itself.

A free run drifts, and a restart at every sample shows noise; a leaky observer keeps one smooth landscape. Its residual
is the error of predictions about thirty samples deep. A position servo needs none while its drive is on: its own law
leads it back. A load that swings while the drive is off has only the observer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision_s2r.fit.joint.discrepancy import Discrepancy
from vision_s2r.fit.joint.space import INDEX, JointSpace
from vision_s2r.fit.joint.track import JointTrack

FAR = 1e100  # of a residual where a simulation runs away: its square is still a number


@dataclass(frozen=True)
class _Inputs:
    """What goes into E episodes, and how the sensor shows what comes out."""

    command: np.ndarray  # [E, N]
    measured: np.ndarray  # [E, T, 2], true states as far as they are measured
    sensor: tuple[tuple[Callable[[np.ndarray, np.ndarray], np.ndarray] | None, np.ndarray], ...] = ()
    load: np.ndarray | None = None  # [E, 1] or [E, T]
    zero: np.ndarray | None = None  # [E]
    gain: np.ndarray | None = None  # [E, T]

    def of(self, rows: np.ndarray) -> "_Inputs":
        """Of these episodes, all of one zero."""
        load, gain = (None if each is None else each[rows] for each in (self.load, self.gain))
        return _Inputs(self.command[rows], self.measured[rows], self.sensor, load, None, gain)


class Observer:
    """Runs points of spaces over episodes of a track."""

    def __init__(self, track: JointTrack, substeps: int, noise: float) -> None:
        self.track, self.substeps, self.noise = track, substeps, noise
        self.channels = 1 if track.velocity is None else 2

    @property
    def seen(self) -> np.ndarray:
        """What is predicted [E, T, channels]; NaN beyond an episode's end."""
        return self.track.observed[..., : self.channels]

    def rates(self, episodes: Sequence[int]) -> np.ndarray:
        """How fast what is predicted changes [E, T, channels]; beyond an episode's end 0."""
        index = list(episodes)
        rates = np.gradient(self.seen[index], axis=1) / np.gradient(self.track.time[index], axis=1)[..., None]
        return np.nan_to_num(rates)

    def residuals(self, space: JointSpace, points: np.ndarray, episodes: Sequence[int]) -> np.ndarray:
        """Measured less predicted [C, E, T, channels] of points [C, D]; beyond an episode's end 0."""
        measured = self.seen[list(episodes)]
        out = np.empty((len(points), *measured.shape))
        for members, states in self._runs(space, points, episodes):
            out[members] = measured - states[..., : self.channels]
        if not np.isfinite(out.sum()):  # a simulation that runs away is far off, and none goes on beyond the end
            out[np.isnan(out)] = FAR
            out[:, np.isnan(measured)] = 0.0
        return np.clip(out, -FAR, FAR, out=out)

    def slopes(self, space: JointSpace, point: np.ndarray, episodes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Residuals [E, T, channels] of a point [D], and their change with each coordinate [D, E, T, channels]."""
        points, steps = space.differences(point)
        residuals = self.residuals(space, points, episodes)
        return residuals[0], (residuals[1:] - residuals[0]) / steps[:, None, None, None]

    def led(self, space: JointSpace, point: np.ndarray) -> np.ndarray:
        """States [E, T, 2] that the observer predicts for all episodes."""
        ((_, states),) = self._runs(space, point[None], range(len(self.track.lengths)))
        return states[0]

    def ahead(self, space: JointSpace, point: np.ndarray) -> np.ndarray:
        """States [E, T, 2] a sample after the measured ones: what is wrong there is of that sample alone."""
        ahead = replace(self.track)
        vars(ahead).update(led=np.ones(ahead.position.shape, dtype=bool), leak=1.0)
        return Observer(ahead, self.substeps, self.noise).led(space, point)

    def _runs(self, space: JointSpace, points: np.ndarray, episodes: Sequence[int]):  # type: ignore[no-untyped-def]
        """States as the sensor shows them, of points that share what goes in and comes out."""
        index = np.asarray(episodes)
        machines = space.machines(points)
        for members, inputs in self._inputs(space, points, index):
            states = self._simulated(space, machines[members], index, inputs)
            for shown, coefficients in inputs.sensor:
                states = shown(states, coefficients)
            yield members, states

    def _simulated(self, space: JointSpace, machines: np.ndarray, index: np.ndarray, given: _Inputs) -> np.ndarray:
        """States [C, E, T, 2]; episodes whose encoder has another zero are run by themselves."""
        track = self.track
        if given.zero is not None:
            states = np.empty((len(machines), *given.measured.shape))
            for more in np.unique(given.zero):
                rows, moved = given.zero == more, machines.copy()
                moved[:, INDEX["position_offset"]] += more
                states[:, rows] = self._simulated(space, moved, index[rows], given.of(rows))
            return states
        first = track.first[index]
        # Where an episode begins at rest, its velocity is no measurement.
        first = np.where(first == track.observed[index, 0], given.measured[:, 0], first)
        led = np.where(track.led[index][..., None], given.measured, np.nan) if track.leak else None
        ran = machines, first, self.substeps, space.tables, index, given.command, led, track.leak, given.load
        return track.inputs.run(*ran, given.gain)

    def _inputs(self, space: JointSpace, points: np.ndarray, index: np.ndarray):  # type: ignore[no-untyped-def]
        """Points that share all of what goes in and comes out, and that."""
        command, measured = self.track.inputs.command[index], self.track.observed[index]
        changing = [each for each in space.discrepancies if each.changes]
        if not changing:
            yield slice(None), _Inputs(command, measured)
            return
        parts = np.concatenate([space.part(points, discrepancy) for discrepancy in changing], axis=1)
        unique, group = np.unique(parts, axis=0, return_inverse=True)
        for k in range(len(unique)):
            members = np.flatnonzero(group.ravel() == k)
            given = _Inputs(command, measured)
            for discrepancy in changing:
                coefficients = space.part(points[members[:1]], discrepancy)[0]
                if coefficients.any():
                    given = self._changed(given, discrepancy, coefficients, index)
            yield members, given

    def _changed(self, given: _Inputs, by: Discrepancy, coefficients: np.ndarray, index: np.ndarray) -> _Inputs:
        """What goes in and comes out, with a discrepancy more."""
        if by.command:
            given = replace(given, command=by.command(given.command, coefficients))
        if by.gain:
            gain = by.gain(coefficients)[index]
            if self.track.servo:  # whose command is no torque
                given = replace(given, gain=gain if given.gain is None else given.gain * gain)
            else:
                given = replace(given, command=given.command * gain)
        if by.load:
            load = by.load(coefficients)[index]
            given = replace(given, load=load if given.load is None else given.load + load)
        if by.zero:
            given = replace(given, zero=by.zero(coefficients)[index])
        if by.measured:
            measured = by.measured(given.measured, coefficients)
            given = replace(given, measured=measured, sensor=(*given.sensor, (by.shown, coefficients)))
            if self.track.servo:  # its targets are what the sensor is to show
                targets = np.stack([given.command, given.command], axis=-1)
                given = replace(given, command=by.measured(targets, coefficients)[..., 0])
        return given
