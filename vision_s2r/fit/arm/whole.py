"""An effect of the whole arm, fitted over all joints together, beside drives that are as believed.

What such an effect puts on the joints is linear in functions of its parameters: known at a few values, it is known for
any, and joints under these loads are quick to simulate. Loads are partly measured, though: free runs of the whole arm,
which know nothing but commands, then take the last step and say how sure it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import norm

from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.arm.problems import Motion, Problems, loads, with_loads
from vision_s2r.fit.case import Values
from vision_s2r.fit.joint.free_run import free_run
from vision_s2r.fit.joint.noise import memory
from vision_s2r.fit.joint.track import fast_noise
from vision_s2r.fit.joint.uncertainty import CLOCK
from vision_s2r.recording import ArmRecording

STRETCHES = 20  # that the intervals are made of
STRIDE = 0.1  # of a number's scale, that slopes of free runs are taken over


class WholeForm(Protocol):
    """How an effect of the whole arm is fitted: by a point, of K numbers."""

    name: str
    known: Sequence[dict[str, float]]  # values at which its loads are computed
    start: Sequence[float]  # [K]
    scale: Sequence[float]  # [K] of the numbers
    low: Sequence[float]  # [K] bounds; above there is none

    def values(self, point: np.ndarray) -> dict[str, float]:
        """The parameters at a point."""
        ...

    def weights(self, values: dict[str, float]) -> np.ndarray:
        """By which the loads at the known values, less those without the effect, add up to those of `values`."""
        ...

    def far(self, values: dict[str, float]) -> Sequence[float]:
        """Of what nothing shows, the nearest: residuals in units of noise."""
        ...

    def change(self, values: dict[str, float]) -> np.ndarray:
        """Derivatives [K, K] of the parameters, in their order, by the point."""
        ...


@dataclass(frozen=True)
class RoughWhole:
    """A first estimate of an effect of the whole arm."""

    point: np.ndarray  # [K]
    values: Values
    share: float  # the part of what is over the noise that it explains
    left: float  # mean square that it leaves, in units of the noise's variance


@dataclass(frozen=True)
class FoundWhole:
    """An effect of the whole arm."""

    name: str
    parameters: dict[str, float]
    ci: dict[str, tuple[float, float]]
    evidence: float  # nats

    @property
    def values(self) -> Values:
        """By name, as all effects are."""
        return {self.name: self.parameters}


class WholeFit:
    """Values of one effect of the whole arm, along a motion."""

    def __init__(self, recording: ArmRecording, moved: list[Motion], form: WholeForm) -> None:
        self._recording, self._moved, self._form = recording, moved, form
        self._empty = loads(recording, moved, {})
        self._noise = np.array([max(fast_noise(j.position), 1e-9) for j in recording.joints.values()])

    @cached_property
    def _parts(self) -> list[np.ndarray]:
        """[episode] [known, 2, N, J]: what the effect at its known values puts on the joints, and adds to inertia."""
        known = [loads(self._recording, self._moved, {self._form.name: values}) for values in self._form.known]
        return [np.array([each[k] for each in known]) - empty for k, empty in enumerate(self._empty)]

    @cached_property
    def before(self) -> np.ndarray:
        """Mean square [J] of what the nominal arm leaves of each joint, in units of its noise's variance."""
        return np.asarray(np.mean(self._residuals(None) ** 2, axis=1))

    def _problems(self, values: dict[str, float] | None) -> Problems:
        """The joints under the loads of an arm with these values, or without the effect."""
        found = self._empty
        if values is not None:
            weights = self._form.weights(values)
            found = [a + np.tensordot(weights, parts, 1) for a, parts in zip(self._empty, self._parts, strict=True)]
        return with_loads(self._recording, self._moved, found)

    def _residuals(self, values: dict[str, float] | None) -> np.ndarray:
        """Measured less simulated positions [J, samples] of joints that run free, in units of their noise."""
        joints = self._problems(values).joints.values()
        inside = np.isfinite(self._recording.any.position)
        rows = [(joint.position - free_run(joint, {})[..., 0])[inside] for joint in joints]
        return np.clip(np.nan_to_num(np.array(rows) / self._noise[:, None]), -1e6, 1e6)

    def fit(self) -> RoughWhole:
        """The values that leave least, by robust least squares."""
        form = self._form

        def rest(point: np.ndarray) -> np.ndarray:
            values = form.values(point)
            return np.concatenate([self._residuals(values).ravel(), form.far(values)])

        size = float(np.sqrt(self.before.mean()))
        found = least_squares(
            rest, form.start, bounds=(form.low, np.inf), loss="soft_l1", f_scale=max(size, 1.0), x_scale=form.scale,
            max_nfev=30,
        )  # fmt: skip
        values = form.values(found.x)
        after = np.mean(self._residuals(values) ** 2, axis=1)
        share = float((self.before - after).sum() / max((self.before - 1).sum(), 1e-12))
        return RoughWhole(found.x, {form.name: values}, share, float(after.mean()))


def sharpened(runs: FreeRuns, form: WholeForm, rough: RoughWhole) -> FoundWhole:
    """An estimate after a step of Gauss and Newton in the whole arm's free run, with its intervals."""
    recording = runs.recording
    inside = np.isfinite(recording.any.position)
    noise = np.array([max(fast_noise(j.position), 1e-9) for j in recording.joints.values()])

    def residuals(values: Values) -> np.ndarray:
        """[J, samples], in units of noise."""
        rest = (recording.position - runs.states(values)[..., 0])[inside]
        return np.clip(np.nan_to_num(rest / noise).T, -1e6, 1e6)

    def far(point: np.ndarray) -> np.ndarray:
        return np.array(form.far(form.values(point)))

    here, point = residuals(rough.values), rough.point
    slopes, pulls = [], []
    for k, stride in enumerate(STRIDE * np.array(form.scale)):
        there = point + stride * np.eye(len(point))[k]
        slopes.append((residuals({form.name: form.values(there)}) - here) / stride)
        pulls.append((far(there) - far(point)) / stride)
    rows, pull = np.stack(slopes, axis=-1), np.stack(pulls, axis=-1)
    held = pull.T @ pull  # information of what holds back where nothing shows
    step = np.linalg.solve(
        np.einsum("jni,jnk->ik", rows, rows) + held, np.einsum("jni,jn->i", rows, here) + pull.T @ far(point)
    )
    point = np.maximum(point - step, form.low)
    left = residuals({form.name: form.values(point)})
    parameters = form.values(point)
    before, after = np.mean(residuals({}) ** 2, axis=1), np.mean(left**2, axis=1)
    change = form.change(parameters)
    late = (
        CLOCK * (np.gradient(recording.position, axis=1) / np.gradient(recording.any.time, axis=1)[..., None])[inside]
    )
    bias = change @ np.linalg.solve(
        np.einsum("jni,jnk->ik", rows, rows) + held, np.einsum("jni,nj->i", rows, late / noise)
    )
    reach = norm.ppf(0.975) * _spread(rows, left, held, change) + np.abs(bias)
    ci = {name: (x - float(r), x + float(r)) for (name, x), r in zip(parameters.items(), reach, strict=True)}
    effective = left.shape[1] / np.array([_memory(recording, row, inside) for row in left])
    gone = np.log(np.maximum(before, 1.0) / np.maximum(after, 1.0))
    evidence = float(np.sum(0.5 * effective * gone))
    return FoundWhole(form.name, parameters, ci, evidence)


def _memory(recording: ArmRecording, residuals: np.ndarray, inside: np.ndarray) -> float:
    """How many samples of a joint's residuals [samples] count as one."""
    whole = np.zeros((*recording.any.position.shape, 1))
    whole[inside, 0] = residuals
    return float(memory(whole, recording.any.lengths)[0])


def _spread(rows: np.ndarray, residuals: np.ndarray, held: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Standard deviations [K] of parameters, by slopes [J, samples, K] and residuals [J, samples].

    A stretch of the log at a time is left out, to first order; what holds back where nothing shows is as uncertain as
    it says.
    """
    labels = np.arange(residuals.shape[1]) * STRETCHES // residuals.shape[1]
    whole = np.einsum("jni,jnk->ik", rows, rows) + held
    steps = []
    for stretch in range(STRETCHES):
        part, left = rows[:, labels == stretch], residuals[:, labels == stretch]
        rest = whole - np.einsum("jni,jnk->ik", part, part)
        steps.append(np.linalg.solve(rest, np.einsum("jni,jn->i", part, left)))
    apart = np.array(steps) - np.mean(steps, axis=0)
    inverse = np.linalg.inv(whole)
    variance = (STRETCHES - 1) / STRETCHES * apart.T @ apart + inverse @ held @ inverse
    return np.asarray(np.sqrt(np.diagonal(change @ variance @ change.T)))
