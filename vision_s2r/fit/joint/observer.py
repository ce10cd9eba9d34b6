"""The residual that the search looks at: of an observer, which leaks a little of the measured state into itself.

A free run drifts, and a restart at every sample shows noise; a leaky observer keeps one smooth landscape. Its residual
is the error of predictions about thirty samples deep. A position servo needs none while its drive is on: its own law
leads it back. A load that swings while the drive is off has only the observer.
"""

from collections.abc import Sequence

import numpy as np

from vision_s2r.fit.joint.space import INDEX, JointSpace
from vision_s2r.fit.joint.track import JointTrack

FAR = 1e100  # of a residual where a simulation runs away: its square is still a number


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

    def _runs(self, space: JointSpace, points: np.ndarray, episodes: Sequence[int]):  # type: ignore[no-untyped-def]
        """States as the sensor shows them, of points that share command and measured states."""
        index = np.asarray(episodes)
        machines = space.machines(points)
        for members, command, measured, sensor, load, zero in self._inputs(space, points, index):
            states = self._simulated(space, machines[members], index, command, measured, load, zero)
            for shown, coefficients in sensor:
                states = shown(states, coefficients)
            yield members, states

    def _simulated(
        self,
        space: JointSpace,
        machines: np.ndarray,
        index: np.ndarray,
        command: np.ndarray,
        measured: np.ndarray,
        load: np.ndarray | None,
        zero: np.ndarray | None,
    ) -> np.ndarray:
        """States [C, E, T, 2]; episodes whose encoder has another zero are run by themselves."""
        track = self.track
        if zero is not None:
            states = np.empty((len(machines), *measured.shape))
            for more in np.unique(zero):
                rows, moved = zero == more, machines.copy()
                moved[:, INDEX["position_offset"]] += more
                loaded = None if load is None else load[rows]
                states[:, rows] = self._simulated(
                    space, moved, index[rows], command[rows], measured[rows], loaded, None
                )
            return states
        first = track.first[index]
        # Where an episode begins at rest, its velocity is no measurement.
        first = np.where(first == track.observed[index, 0], measured[:, 0], first)
        led = np.where(track.led[index][..., None], measured, np.nan) if track.leak else None
        return track.inputs.run(machines, first, self.substeps, space.tables, index, command, led, track.leak, load)

    def _inputs(self, space: JointSpace, points: np.ndarray, index: np.ndarray):  # type: ignore[no-untyped-def]
        """Points that share all of (members, command, measured, sensor, load, zero)."""
        track = self.track
        changing = [each for each in space.discrepancies if each.command or each.measured or each.load or each.zero]
        if not changing:
            yield slice(None), track.inputs.command[index], track.observed[index], [], None, None
            return
        parts = np.concatenate([space.part(points, discrepancy) for discrepancy in changing], axis=1)
        unique, group = np.unique(parts, axis=0, return_inverse=True)
        for k in range(len(unique)):
            members = np.flatnonzero(group.ravel() == k)
            command, measured, sensor = track.inputs.command[index], track.observed[index], []
            load = zero = None
            for discrepancy in changing:
                coefficients = space.part(points[members[:1]], discrepancy)[0]
                if discrepancy.command:
                    command = discrepancy.command(command, coefficients)
                if discrepancy.load:
                    load = discrepancy.load(coefficients)[index]
                if discrepancy.zero:
                    zero = discrepancy.zero(coefficients)[index]
                if discrepancy.measured:
                    measured = discrepancy.measured(measured, coefficients)
                    sensor.append((discrepancy.shown, coefficients))
                    if track.servo:  # its targets are what the sensor is to show
                        command = discrepancy.measured(np.stack([command, command], axis=-1), coefficients)[..., 0]
            yield members, command, measured, sensor, load, zero
