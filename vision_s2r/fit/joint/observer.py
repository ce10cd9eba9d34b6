"""The residual that the search looks at: of an observer, which leaks a little of the measured state into itself.

A free run drifts, and a restart at every sample shows noise; a leaky observer keeps one smooth landscape. Its residual
is the error of predictions about thirty samples deep. A position servo needs none: its own law leads it back.
"""

from collections.abc import Sequence

import numpy as np

from vision_s2r.fit.joint.space import Space
from vision_s2r.fit.joint.track import Track


class Observer:
    """Runs points of spaces over episodes of a track."""

    def __init__(self, track: Track, substeps: int, noise: float) -> None:
        self.track, self.substeps, self.noise = track, substeps, noise
        self.channels = 1 if track.velocity is None else 2

    def residuals(self, space: Space, points: np.ndarray, episodes: Sequence[int]) -> np.ndarray:
        """Measured less predicted [C, E, T, channels] of points [C, D]; beyond an episode's end 0."""
        out = np.empty((len(points), len(episodes), self.track.position.shape[1], self.channels))
        for members, states, measured in self._runs(space, points, episodes, leak=self.track.leak):
            out[members] = (measured - states)[..., : self.channels]
        return np.nan_to_num(out, copy=False, nan=0.0, posinf=1e150, neginf=-1e150)

    def slopes(self, space: Space, point: np.ndarray, episodes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Residuals [E, T, channels] of a point [D], and their change with each coordinate [D, E, T, channels]."""
        points, steps = space.differences(point)
        residuals = self.residuals(space, points, episodes)
        return residuals[0], (residuals[1:] - residuals[0]) / steps[:, None, None, None]

    def led(self, space: Space, point: np.ndarray) -> np.ndarray:
        """States [E, T, 2] that the observer predicts for all episodes."""
        ((_, states, _),) = self._runs(space, point[None], range(len(self.track.lengths)), leak=self.track.leak)
        return states[0]

    def free(self, space: Space, point: np.ndarray, episodes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """A free run: simulated states [E, T, 2] and measured ones, as this hypothesis understands the sensor."""
        ((_, states, measured),) = self._runs(space, point[None], episodes, leak=0.0)
        return states[0], measured

    def _runs(self, space: Space, points: np.ndarray, episodes: Sequence[int], leak: float):  # type: ignore[no-untyped-def]
        track, index = self.track, np.asarray(episodes)
        machines = space.machines(points)
        for members, command, measured in self._inputs(space, points, index):
            first = track.first[index]
            if measured is not None:
                first = np.where(first == track.observed[index, 0], measured[:, 0], first)
            else:
                measured = track.observed[index]
            led = {"observed": measured, "leak": leak} if leak else {}
            states = track.inputs.run(machines[members], first, self.substeps, space.tables, index, command, **led)
            yield members, states, measured

    def _inputs(self, space: Space, points: np.ndarray, index: np.ndarray):  # type: ignore[no-untyped-def]
        """Points that share command and measured states: (members, command, measured or None)."""
        track = self.track
        changing = [discrepancy for discrepancy in space.discrepancies if discrepancy.command or discrepancy.measured]
        if not changing:
            yield slice(None), None, None
            return
        parts = np.concatenate([space.part(points, discrepancy) for discrepancy in changing], axis=1)
        unique, group = np.unique(parts, axis=0, return_inverse=True)
        for k in range(len(unique)):
            members = np.flatnonzero(group.ravel() == k)
            command, measured = track.inputs.command[index], None
            for discrepancy in changing:
                coefficients = space.part(points[members[:1]], discrepancy)[0]
                if discrepancy.command:
                    command = discrepancy.command(command, coefficients)
                if discrepancy.measured:
                    measured = discrepancy.measured(
                        track.observed[index] if measured is None else measured, coefficients
                    )
            yield members, command, measured
