"""The residual that the search looks at: of an observer, which leaks a little of the measured state into itself.

A free run drifts, and a restart at every sample shows noise; a leaky observer keeps one smooth landscape. Its residual
is the error of predictions about thirty samples deep. A position servo needs none while its drive is on: its own law
leads it back. A load that swings while the drive is off has only the observer.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vision_s2r.fit.joint.discrepancy import Discrepancy
from vision_s2r.fit.joint.space import INDEX, JointSpace
from vision_s2r.fit.joint.track import JointTrack
from vision_s2r.fit.maximum_likelihood import Residuals

WORTH = 16  # torques at least, whose tangents take no longer than differences
NUDGE = 1e-6  # of a state, that slopes of what a sensor shows are taken over
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


class Observer(Residuals[JointSpace]):
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

    def slopes(
        self, space: JointSpace, point: np.ndarray, here: np.ndarray, episodes: Sequence[int], stride: float = 1.0
    ) -> np.ndarray:
        """As of all residuals; of many torques by the tangents of one run."""
        if not self._has_tangents(space, point):
            return super().slopes(space, point, here, episodes, stride)
        out = np.empty((space.size, *here.shape))
        torques, of_torques = self.tangents(space, point, episodes)
        others = np.setdiff1d(np.arange(space.size), torques)
        out[torques] = of_torques
        out[others] = self.by_differences(space, point, here, episodes, stride, others)
        return out

    def tangents(self, space: JointSpace, point: np.ndarray, episodes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """`slopes` [K, E, T, channels] of those coordinates [K] that are torques, in little more than a run's time.

        Of a servo that neither play nor a spring divides; without those that run away.
        """
        index, machine = np.asarray(episodes), space.machines(point[None])[0]
        ((_, given),) = self._inputs(space, point[None], index)
        which, drive, load = self._torques(space, point, index, given)
        moved = self._moved(space, machine, index, given, drive, load)
        if given.sensor:
            states = self._simulated(space, machine[None], index, given)[0]
            for shown, coefficients in given.sensor:
                states, moved = _as_shown(shown, coefficients, states, moved)
        slopes = np.where(np.isnan(self.seen[index]), 0.0, -np.moveaxis(moved[:, :, : self.channels], -1, 0))
        # Of a motion that is chaotic, as of a drive that excites itself, tangents grow for ever, and tell nothing.
        moved_by_a_step = np.abs(slopes[..., 0]).max(axis=(1, 2)) * space.step[which]
        told = moved_by_a_step < self.track.scales.span
        return which[told], slopes[told]

    def _has_tangents(self, space: JointSpace, point: np.ndarray) -> bool:
        """Whether tangents are of such a joint, and of so many torques that they are sooner found than differences."""
        torques = sum(each.size for each in space.discrepancies if each.axis or each.gain or each.load)
        if torques < WORTH or not self.track.servo:
            return False
        row = space.row(point)
        return row["backlash.width"] == 0 and row["compliance.stiffness"] == np.inf

    def _torques(
        self, space: JointSpace, point: np.ndarray, index: np.ndarray, given: _Inputs
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates [K] that are torques: heights of tables, factors of the drive's torque, and loads.

        And what a unit of each adds to the drive's factor [E, G, T] and to the torque on the load [E, F, T].
        """
        scale, owner = self.track.inputs.scale, np.array(space.owner)
        factor = np.ones(given.measured.shape[:2]) if scale is None else scale[index, :: self.track.inputs.every]
        factor = factor if given.gain is None else factor * given.gain
        which = [np.flatnonzero(owner == each.name) for each in space.discrepancies if each.axis]
        found: dict[str, list[np.ndarray]] = {"gain": [], "load": []}
        for of, rows in found.items():
            for each in space.discrepancies:
                if (acting := getattr(each, of)) is None:
                    continue
                which.append(np.flatnonzero(owner == each.name))
                here = space.part(point[None], each)[0]
                now = acting(here)[index]
                of_all = factor / now if of == "gain" else np.ones(factor.shape)
                rows += [(acting(here + unit)[index] - now) * of_all for unit in np.eye(each.size)]
        drive, load = (np.stack([np.zeros(factor.shape), *rows], axis=1)[:, 1:] for rows in found.values())
        return np.concatenate(which), drive, load

    def _moved(
        self,
        space: JointSpace,
        machine: np.ndarray,
        index: np.ndarray,
        given: _Inputs,
        drive: np.ndarray,
        load: np.ndarray,
    ) -> np.ndarray:
        """How states [E, T, 2, K] change with torques."""
        if given.zero is not None:
            moved = np.empty((*given.measured.shape, len(machine) - len(INDEX) + drive.shape[1] + load.shape[1]))
            for rows, other, some, alike in _by_zero(given.zero, machine, index, given):
                moved[rows] = self._moved(space, other, some, alike, drive[rows], load[rows])
            return moved
        scales = self.track.scales
        sizes = scales.span, scales.peak_speed, scales.peak_torque
        return self.track.inputs.tangents(
            machine,
            self._first(index, given),
            self.substeps,
            space.tables,
            index,
            sizes,
            drive,
            load,
            self._led(index, given),
        )

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
            for rows, moved, some, alike in _by_zero(given.zero, machines, index, given):
                states[:, rows] = self._simulated(space, moved, some, alike)
            return states
        ran = machines, self._first(index, given), self.substeps, space.tables, index
        return track.inputs.run(*ran, **self._led(index, given))

    def _first(self, index: np.ndarray, given: _Inputs) -> np.ndarray:
        """States [E, 2] that episodes begin in: where one begins at rest, its velocity is no measurement."""
        first = self.track.first[index]
        return np.where(first == self.track.observed[index, 0], given.measured[:, 0], first)

    def _led(self, index: np.ndarray, given: _Inputs) -> dict[str, Any]:
        """What goes into episodes, and leads them."""
        track = self.track
        led = np.where(track.led[index][..., None], given.measured, np.nan) if track.leak else None
        return {
            "command": given.command, "observed": led, "leak": track.leak, "load": given.load, "gain": given.gain
        }  # fmt: skip

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


def _by_zero(
    zero: np.ndarray, machines: np.ndarray, index: np.ndarray, given: _Inputs
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, _Inputs]]:
    """Which rows [E] have one zero of the encoder; machines [..., P] with it, the episodes, and what goes into them."""
    for more in np.unique(zero):
        rows, moved = zero == more, machines.copy()
        moved[..., INDEX["position_offset"]] += more
        yield rows, moved, index[rows], given.of(rows)


def _as_shown(
    shown: Callable[[np.ndarray, np.ndarray], np.ndarray],
    coefficients: np.ndarray,
    states: np.ndarray,
    moved: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """States [E, T, 2] and their changes [E, T, 2, K] as a sensor shows them."""
    now, bent = shown(states, coefficients), np.zeros((*states.shape, 2))
    for k, nudge in enumerate(NUDGE * np.eye(2)):
        bent[..., k] = (shown(states + nudge, coefficients) - now) / NUDGE
    with np.errstate(over="ignore", invalid="ignore"):  # what runs away tells nothing
        return now, bent @ moved
