"""Whether poses, velocities, shape and support can be of one motion of a body."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import ndtri

from vision_s2r.errors import UserError
from vision_s2r.recording.data import ContactRecording

# Of the body's depth: so far under the support its lowest point is no error of measurement, and no corner that is none
# (of a cube with edges as round as can be it would be 0.73 lower) …
SUNK = 0.8
OFTEN = 0.1  # … where so many of all poses are: a soft contact gives way for a moment
NEAR = 0.1  # of the body's depth: a lowest point as low as that may be in touch
PUSHED = 0.3  # of gravity: a mean acceleration over a few samples that differs by more from it was not free
FEW = 6  # samples that such a mean reaches over
PROPORTIONAL = 0.5  # of the size of a velocity: less of it than this may disagree with the poses
SPAN = 0.1  # s over which velocities and differences of poses are compared
MOVES = 0.05  # m/s or rad/s, root mean square: slower bodies say nothing of the units …
CLEARLY = 3.0  # … nor do those that are no faster than so many times the noise of these differences


def check(recording: ContactRecording, lines: np.ndarray, rows: list[np.ndarray], path: Path) -> None:
    """UserError where the body is under the support, never in touch, of another size, or its velocities another's.

    `rows` are the rows of the table of each episode, `lines` where they stand in the file.
    """
    lowest = recording.shape.lowest(recording.position, recording.attitude)
    depth = recording.shape.depth
    sunk, under = lowest < -SUNK * depth, recording.position[..., 2] < 0
    if under.any() or sunk.sum() > OFTEN * np.isfinite(lowest).sum():
        e, k = np.argwhere(sunk | under)[0]
        raise UserError(
            f"{path}, line {lines[rows[e][k]]}: its lowest point is {-lowest[e, k]:.3g} m under the support,"
            " expected poses over the plane z = 0 (of the shape's centre, in m)"
        )
    if np.nanmin(lowest) > NEAR * depth:
        height = np.nanmin(lowest)
        if _is_pushed(recording):
            raise UserError(
                f"{path}: the body is pushed while its lowest point is {height:.3g} m over the support or more: "
                "the shape does not fit the poses"
            )
        raise UserError(f"{path}: no contact in any episode, the body comes no nearer than {height:.3g} m")
    if recording.velocity is not None:
        _check_velocity(recording, path)


def _is_pushed(recording: ContactRecording) -> bool:
    """Whether anything but gravity seems to move the body."""
    span = min(FEW, (int(recording.lengths.min()) - 1) // 2)
    if span < 2:
        return False
    z = recording.position[..., 2]
    fall = (z[:, 2 * span :] - 2 * z[:, span:-span] + z[:, : -2 * span]) / (span * recording.sample_time) ** 2
    return bool(np.nanmax(np.abs(fall + recording.nominal["gravity"])) > PUSHED * recording.nominal["gravity"])


def _check_velocity(recording: ContactRecording, path: Path) -> None:
    assert recording.velocity is not None
    mean = 0.5 * (recording.velocity[:, 1:] + recording.velocity[:, :-1])
    way = np.diff(recording.position, axis=1) / recording.sample_time
    inside = np.isfinite(way[..., 0])
    attitude = Rotation.from_quat(recording.attitude[:, :-1][inside])
    turn = Rotation.from_quat(recording.attitude[:, 1:][inside]) * attitude.inv()
    spin, turned = np.full(way.shape, np.nan), np.full(way.shape, np.nan)
    spin[inside] = turn.as_rotvec() / recording.sample_time
    turned[inside] = attitude.apply(mean[inside][:, 3:])
    span = max(1, min(round(SPAN / recording.sample_time), int(recording.lengths.min()) - 1))
    least = [max(MOVES, CLEARLY * _noise(each) / span) for each in (way, spin)]
    velocity, way, given, spin, turned = (
        _averaged(each, span) for each in (mean[..., :3], way, mean[..., 3:], spin, turned)
    )
    if _size(way) > least[0]:
        _agree("vx, vy, vz", velocity, way, "position", path)
    if _size(spin) > least[1]:
        if _disagreement(turned, spin) < 0.5 * min(_disagreement(given, spin), PROPORTIONAL):
            raise UserError(f"{path}: wx, wy, wz are in the body's frame, expected the support's, as the positions")
        _agree("wx, wy, wz", given, spin, "attitude", path)


def _noise(rates: np.ndarray) -> float:
    """Standard deviation of rates [E, T, 3] that are differences of noisy poses, by the steps from each to the next."""
    steps = np.abs(np.diff(rates, axis=1))
    # Of white noise in poses a rate has 2 parts of variance on each of three axes, a step to the next rate 6 on each.
    return float(np.sqrt(3 * 2 / 6) * np.nanmedian(steps) / ndtri(0.75))


def _size(rates: np.ndarray) -> float:
    """Root mean square length of [N, 3]."""
    return float(np.sqrt((rates**2).sum(axis=-1).mean()))


def _averaged(rates: np.ndarray, span: int) -> np.ndarray:
    """Means [N, 3] of rates [E, T, 3] over so many samples, so that the noise of poses hardly counts."""
    means = np.lib.stride_tricks.sliding_window_view(rates, span, axis=1).mean(axis=-1)
    return means[np.isfinite(means[..., 0])]


def _disagreement(given: np.ndarray, derived: np.ndarray) -> float:
    """Root mean square difference over the larger of both, the largest tenth of the differences left out."""
    difference = np.sort(((given - derived) ** 2).sum(axis=1))[: max(1, int(0.9 * len(given)))].mean()
    return float(np.sqrt(difference)) / max(_size(given), _size(derived))


def _agree(names: str, given: np.ndarray, derived: np.ndarray, of: str, path: Path) -> None:
    if _disagreement(given, derived) < PROPORTIONAL:
        return
    factor = float((given * derived).sum() / (derived**2).sum())
    if factor and _disagreement(given / factor, derived) < PROPORTIONAL:
        raise UserError(f"{path}: {names} are {factor:.3g} times the derivative of {of}, expected m, m/s and rad/s")
    raise UserError(f"{path}: {names} do not follow {of}, expected its derivative in the support's frame")
