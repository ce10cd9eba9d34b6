"""Maximum likelihood of a set of effects' parameters: Gauss-Newton, from coarse pictures to fine ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from vision_s2r.fit.camera.coordinates import chart, pack, unpack
from vision_s2r.fit.camera.effect import charted
from vision_s2r.fit.camera.prediction import Pictures, Stages
from vision_s2r.fit.case import Values

FREEDOM = 6.0  # of Student's distribution, which forgives single pixels


@dataclass(frozen=True)
class Target:
    """What a fit compares with: pairs, the variance [N, 1 or C, H, W] that residuals have, and which pixels count."""

    pictures: Pictures
    variance: Tensor
    counted: Tensor  # [N, 1, H, W] bool

    def residual(
        self, values: Values, segments: Sequence[int], stages: Stages | None = None, keep: bool = False
    ) -> Tensor:
        """Real less predicted [B, C, H, W]."""
        return self.pictures.real[list(segments)] - self.pictures.predict(values, segments, stages, keep).mean

    def loss(self, values: Values, segments: Sequence[int], stages: Stages | None = None) -> float:
        """Mean over pixels of minus the log-likelihood, but for constants; nats."""
        return self._mean_loss(self.residual(values, segments, stages), segments)

    def before(self, values: Values, name: str, segments: Sequence[int]) -> Stages:
        """The stages of a pass without one effect, so that settings of it need not repeat what comes before it."""
        stages: Stages = {}
        self.pictures.front(
            {each: value for each, value in values.items() if each != name}, segments, stages, keep=True
        )
        return stages

    def _mean_loss(self, residual: Tensor, segments: Sequence[int]) -> float:
        chosen, counted = list(segments), self.counted[list(segments)]
        losses = (FREEDOM + 1) / 2 * torch.log1p(residual.square() / (FREEDOM * self.variance[chosen]))
        total = (losses * counted).sum(dtype=torch.float64)
        return float(total) / max(float(counted.sum()) * residual.shape[1], 1.0)


@dataclass(frozen=True)
class Normal:
    """Normal equations of a linearized fit, in steps of the coordinates."""

    matrix: np.ndarray  # [P, P]
    vector: np.ndarray  # [P]


def columns(
    target: Target, values: Values, names: Sequence[str], segments: Sequence[int], stages: Stages
) -> tuple[Tensor, np.ndarray]:
    """Change of the predicted mean [P, B, C, H, W] with each coordinate, a step of it; and the steps [P].

    JPEG, which has no slope, is left out. `stages` holds the pass at `values`.
    """
    pictures = target.pictures
    plain = {name: value for name, value in values.items() if name != "jpeg_compression"}
    base = pictures.predict(plain, segments, stages).mean
    point = pack(plain, names)
    steps = np.array([step for name in names for step in chart(name).steps(target.pictures.optics)])
    slopes = []
    for k, step in enumerate(steps):
        moved = point.copy()
        moved[k] += step
        slopes.append(pictures.predict(plain | unpack(moved, names), segments, stages).mean - base)
    return torch.stack(slopes) if slopes else base.new_zeros((0, *base.shape)), steps


def normal(target: Target, slopes: Tensor, residual: Tensor, segments: Sequence[int]) -> Normal:
    """The equations whose solution is the step to the most likely point, residuals weighed by Student's weights."""
    chosen = list(segments)
    variance = target.variance[chosen]
    weight = target.counted[chosen] * (FREEDOM + 1) / (FREEDOM * variance + residual.square())
    flat = slopes.reshape(len(slopes), -1)
    weighed = flat * weight.reshape(1, -1)
    matrix = (weighed @ flat.T).double().numpy()
    vector = (weighed @ residual.reshape(-1)).double().numpy()
    return Normal(matrix, vector)


def gauss_newton(
    target: Target,
    values: Values,
    names: Sequence[str],
    segments: Sequence[int],
    iterations: int,
    tolerance: float = 0.02,
) -> tuple[Values, float]:
    """`values` with those of `names` moved to the most likely point nearby, and its mean loss.

    Steps are damped (Levenberg, Marquardt) and at most their charts' limits long; the end is an iteration that moves
    every coordinate by less than `tolerance` of its step.
    """
    names = charted(names)
    stages: Stages = {}
    residual = target.residual(values, segments, stages, keep=True)
    loss = target._mean_loss(residual, segments)
    if not names:
        return values, loss
    limits = np.array([limit for name in names for limit in chart(name).limits])
    damping = 1e-4
    for _ in range(iterations):
        slopes, steps = columns(target, values, names, segments, stages)
        equations = normal(target, slopes, residual, segments)
        for _ in range(4):
            move = solve(equations, damping).clip(-limits, limits)
            trial = dict(values) | unpack(pack(values, names) + move * steps, names)
            trial_stages: Stages = {}
            trial_residual = target.residual(trial, segments, trial_stages, keep=True)
            trial_loss = target._mean_loss(trial_residual, segments)
            if trial_loss < loss:
                break
            damping = max(damping * 20, 1e-2)
        else:
            return values, loss
        gained = loss - trial_loss
        values, residual, loss, stages = trial, trial_residual, trial_loss, trial_stages
        damping = max(damping / 10, 1e-5)
        if np.abs(move).max() < tolerance or gained < 2e-6:
            break
    return values, loss


def solve(equations: Normal, damping: float) -> np.ndarray:
    """The damped step [P]."""
    diagonal = np.diag(equations.matrix)
    floor = 1e-6 * max(diagonal.max(initial=0.0), 1e-12)
    damped = equations.matrix + np.diag(damping * diagonal + floor)
    return np.linalg.solve(damped, equations.vector)


def best_start(
    target: Target, values: Values, name: str, segments: Sequence[int], candidates: Sequence[Mapping[str, float]]
) -> Values:
    """`values` with that of the effect's candidates which is likeliest."""
    stages = target.before(values, name, segments)
    losses = [target.loss(dict(values) | {name: candidate}, segments, stages) for candidate in candidates]
    return dict(values) | {name: dict(candidates[int(np.argmin(losses))])}


def search_factor(target: Target, values: Values, segments: Sequence[int]) -> tuple[Values, float]:
    """The likeliest low_resolution near that of `values`: its effect goes by whole cells, so they are counted out."""
    width = target.pictures.optics.width

    def at(cells: int) -> Values:
        return dict(values) | {"low_resolution": {"factor": width / cells}}

    start = round(width / values["low_resolution"]["factor"])
    # One frame finds the place, since the pattern of cells repeats in no other number of them; all of them settle it.
    scan = range(max(round(start * 0.7), width // 16 + 1), min(round(start * 1.4), width - 1) + 1)
    one = list(segments)[:1]
    stages = target.before(values, "low_resolution", one)
    best = min(scan, key=lambda cells: target.loss(at(cells), one, stages), default=start)
    stages = target.before(values, "low_resolution", segments)
    near = [cells for cells in (best - 1, best, best + 1) if max(width / 16, 2) <= cells < width]
    losses = {cells: target.loss(at(cells), segments, stages) for cells in near}
    best = min(losses, key=lambda cells: losses[cells])
    return at(best), losses[best]
