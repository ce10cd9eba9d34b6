"""Effects of the whole arm, fitted over all joints together, beside drives that are as believed.

What such an effect puts on the joints is linear in functions of its parameters: known at a few values, it is known for
any, and joints under these loads are quick to simulate. Loads are partly measured, though: free runs of the whole arm,
which know nothing but commands, then take the last step and say how sure it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import least_squares
from scipy.stats import norm

from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.arm.problems import Motion, Problems, loads, with_loads
from vision_s2r.fit.case import Values
from vision_s2r.fit.joint.free_run import free_run
from vision_s2r.fit.joint.noise import memory
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
    """A first estimate of one effect of the whole arm, or of several."""

    forms: tuple[WholeForm, ...]
    points: tuple[np.ndarray, ...]  # [K] of each
    share: float  # the part of what is over the noise that they explain
    left: float  # mean square that they leave, in units of the noise's variance

    @property
    def values(self) -> Values:
        """By name, as all effects are."""
        return {form.name: form.values(point) for form, point in zip(self.forms, self.points, strict=True)}

    @property
    def names(self) -> frozenset[str]:
        """Of the effects."""
        return frozenset(form.name for form in self.forms)

    @property
    def size(self) -> int:
        """How many numbers they are."""
        return sum(len(point) for point in self.points)


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
    """Values of one effect of the whole arm, along a motion, beside others that are known."""

    def __init__(self, runs: FreeRuns, moved: list[Motion], form: WholeForm, beside: Values) -> None:
        self._recording, self._moved, self._form, self._beside = runs.recording, moved, form, beside
        self._empty = loads(runs.recording, moved, beside)
        self._noise = runs.noise

    @cached_property
    def _parts(self) -> list[np.ndarray]:
        """[episode] [known, 2, N, J]: what the effect at its known values puts on the joints, and adds to inertia."""
        sets = [{**self._beside, self._form.name: values} for values in self._form.known]
        known = [loads(self._recording, self._moved, each) for each in sets]
        return [np.array([each[k] for each in known]) - empty for k, empty in enumerate(self._empty)]

    @cached_property
    def before(self) -> np.ndarray:
        """Mean square [J] of what the arm without the effect leaves of each joint, in units of its noise's variance."""
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

    def fit(self, start: np.ndarray | None = None) -> RoughWhole:
        """The values that leave least, by robust least squares, from a point [K] or the form's own."""
        form = self._form

        def rest(point: np.ndarray) -> np.ndarray:
            values = form.values(point)
            return np.concatenate([self._residuals(values).ravel(), form.far(values)])

        size = float(np.sqrt(self.before.mean()))
        begin, bounds, outlier = form.start if start is None else start, (form.low, np.inf), max(size, 1.0)
        found = least_squares(
            rest, begin, bounds=bounds, loss="soft_l1", f_scale=outlier, x_scale=form.scale, max_nfev=30
        )
        after = float(np.mean(self._residuals(form.values(found.x)) ** 2))
        return RoughWhole((form,), (found.x,), explained(float(self.before.mean()), after), after)

    def slopes(self, point: np.ndarray | None = None) -> np.ndarray:
        """How the numbers of the effect, about a point [K] or small ones, change the residuals [J·samples, K] in units
        of noise.
        """
        form, start = self._form, np.array(self._form.start if point is None else point)
        here, strides = self._residuals(form.values(start)), STRIDE * np.diag(form.scale)
        there = [(self._residuals(form.values(start + stride)) - here) / stride.sum() for stride in strides]
        return np.stack([each.ravel() for each in there], axis=1)

    def without(self) -> np.ndarray:
        """Residuals [J·samples] of the arm without the effect, in units of noise."""
        return self._residuals(None).ravel()


def explained(before: float, after: float) -> float:
    """The part of what is over the noise that is gone, of mean squares in units of its variance."""
    return (before - after) / max(before - 1, 1e-12)


def sharpened(runs: FreeRuns, rough: RoughWhole) -> tuple[FoundWhole, ...]:
    """Estimates after as many steps of Gauss and Newton in the whole arm's free run as there are effects."""
    recording, every = runs.recording, _Numbers(rough.forms)
    inside = np.isfinite(recording.any.position)
    noise = runs.noise

    def residuals(values: Values) -> np.ndarray:
        """[J, samples], in units of noise."""
        rest = (recording.position - runs.states(values)[..., 0])[inside]
        return np.clip(np.nan_to_num(rest / noise).T, -1e6, 1e6)

    point = np.concatenate(rough.points)
    for _ in rough.forms:
        here, slopes, pulls = residuals(every.values(point)), [], []
        for k, stride in enumerate(STRIDE * every.scale):
            there = point + stride * np.eye(len(point))[k]
            slopes.append((residuals(every.values(there)) - here) / stride)
            pulls.append((every.far(there) - every.far(point)) / stride)
        rows, pull = np.stack(slopes, axis=-1), np.stack(pulls, axis=-1)
        held = pull.T @ pull  # information of what holds back where nothing shows
        whole = np.einsum("jni,jnk->ik", rows, rows) + held
        step = np.linalg.solve(whole, np.einsum("jni,jn->i", rows, here) + pull.T @ every.far(point))
        point = np.maximum(point - step, every.low)
    values = every.values(point)
    left, change = residuals(values), every.change(values)
    late = (
        CLOCK * (np.gradient(recording.position, axis=1) / np.gradient(recording.any.time, axis=1)[..., None])[inside]
    )
    bias = change @ np.linalg.solve(whole, np.einsum("jni,nj->i", rows, late / noise))
    reach = iter(norm.ppf(0.975) * _spread(rows, left, held, change) + np.abs(bias))
    effective = left.shape[1] / np.array([_memory(recording, row, inside) for row in left])
    found = []
    for name, parameters in values.items():
        ci = {key: (x - r, x + r) for (key, x), r in zip(parameters.items(), map(float, reach), strict=False)}
        others = {key: each for key, each in values.items() if key != name}
        gone = np.log(np.maximum(_squares(residuals(others)), 1.0) / np.maximum(_squares(left), 1.0))
        found.append(FoundWhole(name, dict(parameters), ci, float(np.sum(0.5 * effective * gone))))
    return tuple(found)


class _Numbers:
    """Those of several forms, one behind the other."""

    def __init__(self, forms: Sequence[WholeForm]) -> None:
        self._forms = forms
        self._ends = np.cumsum([len(form.start) for form in forms])[:-1]
        self.scale, self.low = (np.concatenate([getattr(form, key) for form in forms]) for key in ("scale", "low"))

    def values(self, point: np.ndarray) -> dict[str, dict[str, float]]:
        """By name."""
        parts = np.split(point, self._ends)
        return {form.name: form.values(part) for form, part in zip(self._forms, parts, strict=True)}

    def far(self, point: np.ndarray) -> np.ndarray:
        values = self.values(point)
        return np.array([each for form in self._forms for each in form.far(values[form.name])])

    def change(self, values: dict[str, dict[str, float]]) -> np.ndarray:
        """Derivatives of all parameters by all numbers."""
        return block_diag(*(form.change(values[form.name]) for form in self._forms))


def _squares(residuals: np.ndarray) -> np.ndarray:
    """Mean squares [J] of residuals [J, samples]."""
    return np.asarray(np.mean(residuals**2, axis=1))


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
