"""How well a recording determines the parameters of a hypothesis, from how its frames differ."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import stdtrit
from torch import Tensor

from vision_s2r.appearance import PICTURE_EFFECTS, label_of
from vision_s2r.fit.camera.coordinates import chart, pack, unpack
from vision_s2r.fit.camera.effect import CAMERA_FITS, at_stage, charted, of_stage
from vision_s2r.fit.camera.elimination import neutral_point
from vision_s2r.fit.camera.fitting import Target, columns, normal
from vision_s2r.fit.camera.prediction import Pictures, Stages, without_encoder
from vision_s2r.fit.camera.weighing import told_otherwise
from vision_s2r.fit.case import Intervals, Values

if TYPE_CHECKING:
    from vision_s2r.fit.camera.study import Study

_GROUPS = 4  # of frames, compared with each other
_TOLERANCE = 0.006  # of a parameter's distance from neutral: what the definitions of two simulators differ by
_LEAST = 0.05  # of a coordinate's step: the same, of an effect that is almost neutral
_AT_STAGE = {"warp": 0.12, "blur": 0.3}  # … of what looks between pixels: every maker by a kernel of its own
_AMOUNT = 0.02  # of a noise's standard deviation: what pictures of things tell it to
_LAMP = 0.5  # of a step: what normals from depth make of another light
_AMBIENT, _DIRECTION = 0.005, 0.01  # how well the renderer's own light is known: its share; rad


@dataclass(frozen=True)
class Spread:
    """Intervals (95 %) by effect and parameter, and of each effect the relative difference between groups of frames."""

    intervals: Intervals
    relative: dict[str, float]


def spread(target: Target, study: "Study", values: Values) -> Spread:
    """One Gauss-Newton step of each frame alone, pooled: the sandwich estimate with frames as clusters."""
    names = charted(values)
    count = len(target.pictures.sim)
    lights = [name for name in at_stage(names, "scene") if label_of(name) is None]
    others = _other_lamps(target.pictures) if lights else []
    matrices, vectors, moved, steps = [], [], [], np.empty(0)
    for segment in range(count) if names else ():
        stages: Stages = {}
        residual, lit = target.compare(values, [segment], stages, keep=True)
        slopes, steps = columns(target, values, names, [segment], stages, lit)
        equations = normal(target, slopes, residual, [segment])
        matrices.append(equations.matrix)
        vectors.append(equations.vector)
        changes = [_change(target, other, values, segment) for other in others]
        moved.append([normal(target, slopes, change, [segment]).vector for change in changes])
    intervals: Intervals = {}
    relative: dict[str, float] = {}
    if names:
        matrix, scores = np.array(matrices), np.array(vectors)
        deviation = _sandwich(matrix, scores)
        if others:
            shifts = np.array(moved).sum(0) @ _inverse(matrix)
            deviation = np.sqrt(deviation**2 + (shifts**2).sum(0))
        groups = _group_steps(matrix, scores)
        at = 0
        for name in names:
            size = len(chart(name).steps(target.pictures.optics))
            own = slice(at, at + size)
            at += size
            point = pack(values, [name])
            departure = (point - neutral_point(name, values[name], target.pictures.optics)) / steps[own]
            least = _LAMP if name in lights else _AT_STAGE.get(CAMERA_FITS[name].stage, _LEAST)
            relative[name] = relative_spread(groups[:, own], departure, matrix.sum(0)[own, own])
            half = np.hypot(deviation[own], np.maximum(_TOLERANCE * np.abs(departure), least)) * steps[own]
            intervals[name] = _outward(name, values, point, half * stdtrit(max(count - 1, 1), 0.975))
    for name in values:
        if name in of_stage("noise"):
            intervals[name] = _noise_interval(study, values, name)
        elif name not in names:
            intervals[name] = {key: _plateau(name, key, value, target) for key, value in values[name].items()}
    return Spread(intervals, relative)


def _sandwich(matrix: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Standard deviation [P] of the pooled solution, from matrices [N, P, P] and scores [N, P]."""
    count = len(scores)
    inverse = _inverse(matrix)
    centred = scores - scores.mean(0)
    covariance = inverse @ (centred.T @ centred * count / max(count - 1, 1)) @ inverse
    return np.sqrt(np.maximum(np.diag(covariance), np.diag(inverse)))


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Of the pooled curvature, from that [N, P, P] of each frame."""
    whole = matrix.sum(0)
    return np.linalg.pinv(whole + 1e-9 * np.eye(len(whole)) * whole.diagonal().max(), hermitian=True)


def _other_lamps(pictures: Pictures) -> list[Pictures]:
    """With the renderer's own light as it may be as well: of another share, or from beside, each a deviation away."""
    surfaces = pictures.surfaces
    if surfaces is None or surfaces.lamp is None:
        return []
    lamp, towards = surfaces.lamp, np.array(surfaces.lamp.direction)
    across = np.linalg.svd(towards[None])[2][1:]  # the plane that it is the normal of
    beside = [(towards + _DIRECTION * each) / np.hypot(1, _DIRECTION) for each in across]
    lamps = [replace(lamp, ambient=lamp.ambient + _AMBIENT)]
    lamps += [replace(lamp, direction=(float(x), float(y), float(z))) for x, y, z in beside]
    return [replace(pictures, surfaces=replace(surfaces, lamp=each)) for each in lamps]


def _change(target: Target, other: Pictures, values: Values, segment: int) -> Tensor:
    """What other pictures make of a frame's prediction [1, C, H, W]."""
    plain = without_encoder(values)
    return other.predict(plain, [segment]).mean - target.pictures.predict(plain, [segment]).mean


def _group_steps(matrix: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """The step [groups, P] to the solution of each group of frames."""
    groups = min(_GROUPS, len(scores))
    found = []
    for k in range(groups):
        own = matrix[k::groups].sum(0)
        damped = own + max(1e-6 * own.diagonal().max(), 1e-12) * np.eye(len(own))  # frames may show none of them
        found.append(np.linalg.solve(damped, scores[k::groups].sum(0)))
    return np.array(found)


def relative_spread(groups: np.ndarray, departure: np.ndarray, curvature: np.ndarray) -> float:
    """How much what groups of frames [groups, P] ask for differs, beside the departure [P] from neutral.

    By what it does to the pictures: k1 and k2 of a lens may differ much and bend it alike.
    """
    between = np.cov(groups, rowvar=False).reshape(curvature.shape)
    work = departure @ curvature @ departure
    return float(np.sqrt(np.trace(between @ curvature) / max(work, 1e-18 * np.trace(curvature), 1e-12)))


def _outward(name: str, values: Values, point: np.ndarray, half: np.ndarray) -> dict[str, tuple[float, float]]:
    """Half widths of coordinates as intervals of parameters, through a slope each."""
    keys = [parameter.name for parameter in PICTURE_EFFECTS[name].parameters]
    centre = np.array([values[name][key] for key in keys])
    variance = np.zeros(len(keys))
    for k in range(len(point)):
        moved = point.copy()
        moved[k] += half[k]
        there = np.array(list(unpack(moved, [name])[name].values()))
        change = there - centre
        for i, key in enumerate(keys):
            if key in ("angle", "azimuth"):
                period = chart(name).period
                change[i] = (change[i] + period / 2) % period - period / 2
        variance += change**2
    return {
        key: (float(value - width), float(value + width))
        for key, value, width in zip(keys, centre, np.sqrt(variance), strict=True)
    }


def _noise_interval(study: "Study", values: Values, name: str) -> dict[str, tuple[float, float]]:
    """By leaving out groups of frames in turn (jackknife), in logarithms; beside any noise without a name."""
    noises = [each for each in values if each in of_stage("noise")]
    noise, count = study.yardstick.noise, len(study.bins.squares)
    (key, value), *_ = values[name].items()
    groups = min(2 * _GROUPS, count)
    left = []
    for k in range(groups):
        rest = [segment for segment in range(count) if segment % groups != k]
        left.append(np.log(next(iter(noise.fit(values, noises, study.bins, rest)[name].values()))))
    deviation = np.sqrt((groups - 1) / groups * np.sum((np.array(left) - np.mean(left)) ** 2))
    least = _AMOUNT * (2 if key == "full_well" else 1)
    width = float(np.hypot(deviation * stdtrit(groups - 1, 0.975), least))
    stories = told_otherwise(noise, values, noises, study.bins, range(count))
    ends = [value, *(next(iter(each[name].values())) for each in stories)]
    return {key: (float(min(ends) * np.exp(-width)), float(max(ends) * np.exp(width)))}


def _plateau(name: str, key: str, value: float, target: Target) -> tuple[float, float]:
    """Values that mean the same: a whole number of cells, or a whole quality."""
    if name != "low_resolution":
        return value, value
    width = target.pictures.optics.width * target.pictures.optics.pixel
    cells = round(width / value)
    return width / (cells + 0.5), width / max(cells - 0.5, 0.5)
