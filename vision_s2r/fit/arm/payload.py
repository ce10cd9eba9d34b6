"""A payload, fitted over all joints together.

What a point mass puts on the joints is m·(a + b·r + r⊤·C·r), with a, b and C functions of the motion: known from ten
places of a mass of 1 kg, it is known for any.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import norm

from vision_s2r.arm.effect import PAYLOAD
from vision_s2r.fit.arm.problems import Motion, Problems, loads, with_loads
from vision_s2r.fit.joint.free_run import free_run
from vision_s2r.fit.joint.noise import memory
from vision_s2r.fit.joint.track import fast_noise
from vision_s2r.recording import ArmRecording

REACH = 0.1  # m, of the places that are tried
AXES = np.eye(3)
PLACES = np.array([np.zeros(3), *AXES, *-AXES, AXES[0] + AXES[1], AXES[1] + AXES[2], AXES[2] + AXES[0]]) * REACH
FARTHEST = 1.0  # m from the last body's origin, which is far
START, LEAST = 0.05, 1e-5  # kg
STRETCHES = 20  # that the intervals are made of
NAMES = ("mass", "x", "y", "z")


@dataclass(frozen=True)
class FoundPayload:
    """A payload, and what it explains of what the nominal arm leaves."""

    values: dict[str, float]
    ci: dict[str, tuple[float, float]]
    before: np.ndarray  # [J] mean square of each joint's residual, in units of its noise's variance
    after: np.ndarray  # [J]
    evidence: float  # nats

    @property
    def share(self) -> float:
        """The part of what is over the noise that it explains."""
        return float((self.before - self.after).sum() / max((self.before - 1).sum(), 1e-12))


class PayloadFit:
    """Payloads of an arm, beside drives that are as believed."""

    def __init__(self, recording: ArmRecording, moved: list[Motion]) -> None:
        self._recording, self._moved = recording, moved
        self._empty = loads(recording, moved, {})
        heavy = [loads(recording, moved, {PAYLOAD: dict(zip(NAMES, (1.0, *place), strict=True))}) for place in PLACES]
        inverse = np.linalg.inv(np.array([_monomials(place) for place in PLACES]))
        # [episode] [10, 2, N, J]: what each monomial of the place puts on the joints, and adds to their inertia.
        self._forms = [
            np.tensordot(inverse, np.array([each[k] for each in heavy]) - empty, 1)
            for k, empty in enumerate(self._empty)
        ]
        self._noise = np.array([max(fast_noise(j.position), 1e-9) for j in recording.joints.values()])

    @cached_property
    def before(self) -> np.ndarray:
        """Mean square [J] of what the nominal arm leaves of each joint, in units of its noise's variance."""
        return np.asarray(np.mean(self.residuals(None) ** 2, axis=1))

    def problems(self, values: dict[str, float] | None) -> Problems:
        """The joints under the loads of this payload, or of none."""
        found = self._empty
        if values is not None:
            place = np.array([values[name] for name in NAMES[1:]])
            weights = values["mass"] * _monomials(place)
            found = [a + np.tensordot(weights, form, 1) for a, form in zip(self._empty, self._forms, strict=True)]
        return with_loads(self._recording, self._moved, found)

    def residuals(self, values: dict[str, float] | None) -> np.ndarray:
        """Measured less simulated positions [J, samples] of joints that run free, in units of their noise."""
        joints = self.problems(values).joints.values()
        inside = np.isfinite(self._recording.any.position)
        rows = [(joint.position - free_run(joint, {})[..., 0])[inside] for joint in joints]
        return np.clip(np.nan_to_num(np.array(rows) / self._noise[:, None]), -1e6, 1e6)

    def fit(self) -> FoundPayload:
        """The payload that leaves least, by robust least squares over mass and first moments, which gravity shows."""

        def payload(point: np.ndarray) -> dict[str, float]:
            return dict(zip(NAMES, (float(point[0]), *(float(x) for x in point[1:] / point[0])), strict=True))

        def rest(point: np.ndarray) -> np.ndarray:
            values = payload(point)
            far = [values[name] / FARTHEST for name in NAMES[1:]]  # of what nothing shows, the nearest
            return np.concatenate([self.residuals(values).ravel(), far])

        size = float(np.sqrt(self.before.mean()))
        found = least_squares(
            rest, [START, 0.0, 0.0, 0.0], bounds=([LEAST, -np.inf, -np.inf, -np.inf], np.inf), loss="soft_l1",
            f_scale=max(size, 1.0), x_scale=[START, START * REACH, START * REACH, START * REACH], max_nfev=30,
        )  # fmt: skip
        values = payload(found.x)
        left = rest(found.x)[:-3].reshape(len(self._noise), -1)
        # Of the place, by that of the moments: d(p/m) = (dp − r·dm)/m.
        change = np.eye(4)
        change[1:, 0] = [values[name] for name in NAMES[1:]]
        change[1:, 1:] *= values["mass"]
        reach = _jackknife(found.jac[:-3] @ change, left)
        ci = {
            name: (value - float(r), value + float(r)) for (name, value), r in zip(values.items(), reach, strict=True)
        }
        before, after = self.before, np.mean(left**2, axis=1)
        effective = left.shape[1] / np.array([self._memory(row) for row in left])
        evidence = float(np.sum(0.5 * effective * np.log(np.maximum(before, 1.0) / np.maximum(after, 1.0))))
        return FoundPayload(values, ci, before, after, evidence)

    def _memory(self, residuals: np.ndarray) -> float:
        """How many samples of a joint's residuals [samples] count as one."""
        whole = np.zeros((*self._recording.any.position.shape, 1))
        whole[np.isfinite(self._recording.any.position), 0] = residuals
        return float(memory(whole, self._recording.any.lengths)[0])


def _monomials(place: np.ndarray) -> np.ndarray:
    x, y, z = place
    return np.array([1.0, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x])


def _jackknife(jacobian: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """How far 95 % intervals reach: a stretch of the log at a time left out, to first order."""
    joints, samples = residuals.shape
    rows = jacobian.reshape(joints, samples, -1)
    labels = np.arange(samples) * STRETCHES // samples
    whole = np.einsum("jni,jnk->ik", rows, rows)
    steps = []
    for stretch in range(STRETCHES):
        part, left = rows[:, labels == stretch], residuals[:, labels == stretch]
        steps.append(np.linalg.pinv(whole - np.einsum("jni,jnk->ik", part, part)) @ np.einsum("jni,jn->i", part, left))
    variance = (STRETCHES - 1) / STRETCHES * np.sum((np.array(steps) - np.mean(steps, axis=0)) ** 2, axis=0)
    return np.asarray(norm.ppf(0.975) * np.sqrt(variance))
