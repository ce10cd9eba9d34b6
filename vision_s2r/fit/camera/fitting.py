"""Maximum likelihood of a set of effects' parameters: Gauss-Newton, from coarse pictures to fine ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from vision_s2r.fit.camera.coordinates import chart, pack, unpack
from vision_s2r.fit.camera.effect import charted
from vision_s2r.fit.camera.light import STEADY, Lit
from vision_s2r.fit.camera.prediction import Pictures, Stages, chosen, without_encoder
from vision_s2r.fit.camera.student import FREEDOM, forgiving
from vision_s2r.fit.case import Values
from vision_s2r.fit.gauss_newton import Damping, descend
from vision_s2r.fit.least_squares import solved

# An iteration that moves no coordinate by 0.02 of its step, or gains 2e-6 nats a pixel, is the last.
_RULE = Damping(first=1e-4, raised=20, least=1e-2, times=4, lowered=10, bounds=(1e-5, np.inf), gain=2e-6, move=0.02)
_FLOOR = 1e-6  # of the largest curvature: that which every coordinate has
_SHORT = 0.5  # steps of every coordinate, within which slopes are nearly what they were


@dataclass(frozen=True)
class Target:
    """What a fit compares with: pairs, the variance [N, 1 or C, H, W] that residuals have, and which pixels count."""

    pictures: Pictures
    variance: Tensor
    counted: Tensor  # [N, 1, H, W] bool

    def compare(
        self, values: Values, segments: Sequence[int], stages: Stages | None = None, keep: bool = False
    ) -> tuple[Tensor, Lit | None]:
        """Real less predicted [B, C, H, W], and the light that the frames have of their own, if it is not steady."""
        pictures = self.pictures
        real = chosen(pictures.real, segments)
        if pictures.light == STEADY:
            return real - pictures.predict(values, segments, stages, keep).mean, None
        mean = pictures.predict(without_encoder(values), segments, stages, keep).mean
        weight = chosen(self.counted, segments) / chosen(self.variance, segments)
        lit = pictures.light.on(mean, real, weight, pictures.encoding)
        return real - pictures.through_encoder(lit.mean, values), lit

    def residual(
        self, values: Values, segments: Sequence[int], stages: Stages | None = None, keep: bool = False
    ) -> Tensor:
        """Real less predicted [B, C, H, W]."""
        return self.compare(values, segments, stages, keep)[0]

    def loss(self, values: Values, segments: Sequence[int], stages: Stages | None = None) -> float:
        """Mean over pixels of minus the log-likelihood, but for constants; nats."""
        return self.mean_loss(self.residual(values, segments, stages), segments)

    def before(self, values: Values, name: str, segments: Sequence[int]) -> Stages:
        """The stages of a pass without one effect, so that settings of it need not repeat what comes before it."""
        stages: Stages = {}
        self.pictures.front(
            {each: value for each, value in values.items() if each != name}, segments, stages, keep=True
        )
        return stages

    def mean_loss(self, residual: Tensor, segments: Sequence[int]) -> float:
        """That of residuals [B, C, H, W]."""
        counted, variance = chosen(self.counted, segments), chosen(self.variance, segments)
        losses = torch.log1p(residual.square().div_(variance).div_(FREEDOM)).mul_(counted)
        total = (FREEDOM + 1) / 2 * float(losses.sum(dtype=torch.float64))
        return total / max(float(counted.sum()) * residual.shape[1], 1.0)


@dataclass(frozen=True)
class Normal:
    """Normal equations of a linearized fit, in steps of the coordinates."""

    matrix: np.ndarray  # [P, P]
    vector: np.ndarray  # [P]


def columns(
    target: Target, values: Values, names: Sequence[str], segments: Sequence[int], stages: Stages, lit: Lit | None
) -> tuple[Tensor, np.ndarray]:
    """Change of the predicted mean [P, B, C, H, W] with each coordinate, a step of it; and the steps [P].

    JPEG, which has no slope, is left out. `stages` holds the pass at `values`, `lit` the light of its frames.
    """
    pictures = target.pictures
    plain = without_encoder(values)
    base = pictures.predict(plain, segments, stages).mean
    point = pack(plain, names)
    steps = np.array([step for name in names for step in chart(name).steps(target.pictures.optics)])
    slopes = []
    for k in range(len(steps)):
        moved, way = _within_bounds(point, k, steps[k], names)
        slopes.append((pictures.predict({**plain, **moved}, segments, stages).mean - base) * way)
    stacked = torch.stack(slopes) if slopes else base.new_zeros((0, *base.shape))
    return stacked if lit is None or not slopes else lit.beside(stacked), steps


def _within_bounds(
    point: np.ndarray, k: int, step: float, names: Sequence[str]
) -> tuple[dict[str, dict[str, float]], int]:
    """Values a step ahead along a coordinate, or back where an upper bound is in the way; and which, 1 or -1."""
    moved = point.copy()
    moved[k] += step
    values = unpack(moved, names)
    if abs(pack(values, names)[k] - point[k]) > step / 2:
        return values, 1
    moved[k] = point[k] - step
    return unpack(moved, names), -1


def normal(target: Target, slopes: Tensor, residual: Tensor, segments: Sequence[int]) -> Normal:
    """The equations whose solution is the step to the most likely point, residuals weighed by Student's weights."""
    weight = student_weights(target, residual, segments)
    flat = slopes.flatten(1)
    weighed = flat * weight.reshape(1, -1)
    matrix = (weighed @ flat.T).double().numpy()
    vector = (weighed @ residual.reshape(-1)).double().numpy()
    return Normal(matrix, vector)


def student_weights(target: Target, residual: Tensor, segments: Sequence[int]) -> Tensor:
    """What each residual [B, C, H, W] counts for; 0 where a pixel does not."""
    variance = chosen(target.variance, segments)
    return chosen(target.counted, segments) / variance * forgiving(residual.square() / variance)


@dataclass(frozen=True)
class Beside:
    """Normal equations of what a hypothesis may move, about which one change more is asked for."""

    slopes: Tensor  # [P, pixels]
    weight: Tensor  # [pixels]
    residual: Tensor  # [pixels]
    own: Normal

    @classmethod
    def of(cls, target: Target, slopes: Tensor, residual: Tensor, segments: Sequence[int]) -> "Beside":
        """About residuals [B, C, H, W] and slopes [P, B, C, H, W]."""
        weight = student_weights(target, residual, segments).expand_as(residual).reshape(-1)
        flat = slopes.flatten(1)
        return cls(flat, weight, residual.reshape(-1), normal(target, slopes, residual, segments))

    def gain(self, change: Tensor, one_sided: bool) -> float:
        """Nats that a change [B, C, H, W] of the prediction brings beside the slopes, of the best size.

        None where that is less than nothing and the change is `one_sided`, as a blur's, which may not sharpen.
        """
        weighed = change.reshape(-1) * self.weight
        slope, curvature = float(weighed @ self.residual), float(weighed @ change.reshape(-1))
        whole, matrix = curvature, self.own.matrix
        if len(matrix):
            across = (self.slopes @ weighed).double().numpy()
            inner = matrix + 1e-9 * np.eye(len(matrix)) * max(matrix.diagonal().max(), curvature)
            beside = solved(inner, np.c_[self.own.vector, across], 1e-12)
            slope, curvature = slope - across @ beside[:, 0], curvature - across @ beside[:, 1]
        told = curvature > 1e-9 * max(whole, 1e-12) and np.isfinite(slope) and not (one_sided and slope < 0)
        return float(0.5 * slope**2 / curvature) if told else 0.0


@dataclass(frozen=True)
class _State:
    """Values of a descent, and what they leave."""

    values: Values
    cost: float
    residual: Tensor
    stages: Stages
    lit: Lit | None


@dataclass
class _Descent:
    """Some effects on some frames, in steps of their charts.

    After a short step slopes are those of the state before, with what the step did (Broyden 1965): to difference them
    anew takes a prediction a coordinate. Behind an encoder, or in light of each frame's own, they are.
    """

    target: Target
    names: Sequence[str]
    segments: Sequence[int]
    known: tuple[_State, Tensor] | None = None  # where slopes were last, and these

    def at(self, values: Values) -> _State:
        stages: Stages = {}
        residual, lit = self.target.compare(values, self.segments, stages, keep=True)
        return _State(values, self.target.mean_loss(residual, self.segments), residual, stages, lit)

    def equations(self, state: _State) -> tuple[np.ndarray, np.ndarray]:
        slopes = self._carried(state)
        if slopes is None:
            slopes, _ = columns(self.target, state.values, self.names, self.segments, state.stages, state.lit)
        self.known = state, slopes
        equations = normal(self.target, slopes, state.residual, self.segments)
        floor = _FLOOR * max(np.diag(equations.matrix).max(initial=0.0), 1e-12)
        return equations.matrix + floor * np.eye(len(slopes)), equations.vector

    def _carried(self, state: _State) -> Tensor | None:
        if self.known is None or state.lit is not None or "jpeg_compression" in state.values:
            return None
        before, slopes = self.known
        step = (pack(state.values, self.names) - pack(before.values, self.names)) / self._small
        length = float(step @ step)
        if np.abs(step).max() > _SHORT or length == 0:
            return None
        along = torch.from_numpy(step).to(slopes.dtype)
        missed = before.residual - state.residual - torch.tensordot(along, slopes, 1)
        return slopes + along.view(-1, 1, 1, 1, 1) * (missed / length)

    @property
    def _small(self) -> np.ndarray:
        return np.array([step for name in self.names for step in chart(name).steps(self.target.pictures.optics)])

    def step(self, state: _State, step: np.ndarray) -> _State:
        here = pack(state.values, self.names)
        return self.at(dict(state.values) | unpack(here + step * self._small, self.names))


def gauss_newton(
    target: Target, values: Values, names: Sequence[str], segments: Sequence[int], iterations: int
) -> tuple[Values, float]:
    """`values` with those of `names` moved to the most likely point nearby, and its mean loss.

    Steps are at most their charts' limits long.
    """
    names = charted(names)
    descent = _Descent(target, names, segments)
    start = descent.at(values)
    if not names:
        return values, start.cost
    limits = np.array([limit for name in names for limit in chart(name).limits], dtype=float)
    found = descend(descent, start, iterations, _RULE, limits)
    return found.values, found.cost


def best_start(
    target: Target, values: Values, name: str, segments: Sequence[int], candidates: Sequence[Mapping[str, float]]
) -> Values:
    """`values` with that of the effect's candidates which is likeliest."""
    stages = target.before(values, name, segments)
    losses = [target.loss(dict(values) | {name: candidate}, segments, stages) for candidate in candidates]
    return dict(values) | {name: dict(candidates[int(np.argmin(losses))])}


def search_factor(target: Target, values: Values, segments: Sequence[int]) -> tuple[Values, float]:
    """The likeliest low_resolution near that of `values`: its effect goes by whole cells, so they are counted out."""
    width, pixel = target.pictures.optics.width, target.pictures.optics.pixel

    def at(cells: int) -> Values:
        return dict(values) | {"low_resolution": {"factor": pixel * width / cells}}

    start = round(pixel * width / values["low_resolution"]["factor"])
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
