"""The figures of a diagnosis."""

import math

import numpy as np
from matplotlib.figure import Figure

from vision_s2r.fit.case import Axis, Samples, Values
from vision_s2r.recording import CameraRecording, ContactRecording, JointRecording
from vision_s2r.report import drawing
from vision_s2r.report.drawing import Figures

STRETCH = 400  # samples of an episode that are drawn
FRAMES = 3  # pictures that are drawn
GRID = "grid"  # the axis of a picture's cells, drawn as a map


def figures(
    recording: JointRecording | CameraRecording | ContactRecording,
    effects: Values,
    before: Samples,
    after: Samples,
    unit: str,
) -> Figures:
    """By caption: what it looks like, and where the gap lies before and after `effects`.

    `before` and `after` are the samples of the simulator as it came and of the diagnosed one; `unit` that of the gap.
    """
    looks = Figures()
    if isinstance(recording, JointRecording):
        looks |= _joint(recording, effects)
    elif isinstance(recording, CameraRecording):
        looks |= _camera(recording, effects)
    else:
        looks |= _contact(recording, effects)
    axes = [axis for axis in before.axes if axis.name != GRID and len(axis.labels) > 1]
    parts = [(axis.name, axis.labels, *_levels(before, after, axis)) for axis in axes]
    if parts:
        looks["Where the gap lies: root mean square, before and after, against measurement noise"] = drawing.by_bin(
            unit, parts
        )
    for axis in before.axes:
        if axis.name == GRID:
            looks["Where in the picture the gap lies"] = _map(before, after, axis, unit)
    return looks


def _levels(before: Samples, after: Samples, axis: Axis) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Root mean square of each bin before, after, and of the noise; NaN where a bin is empty."""
    inside = axis.bins >= 0
    bins, size = axis.bins[inside], len(axis.labels)
    count = np.bincount(bins, minlength=size)

    def level(values: np.ndarray) -> np.ndarray:
        total = np.bincount(bins, values[inside], size)
        return np.sqrt(np.divide(total, count, out=np.full(size, np.nan), where=count > 0))

    return level(before.error), level(after.error), level(before.floor)


def _map(before: Samples, after: Samples, axis: Axis, unit: str) -> Figure:
    side = math.isqrt(len(axis.labels))
    first, second, _ = _levels(before, after, axis)
    return drawing.maps(unit, {"before": first.reshape(side, side), "after": second.reshape(side, side)})


def _joint(recording: JointRecording, effects: Values) -> dict[str, Figure]:
    """The stretch where the free-running simulator is furthest from what was measured."""
    from vision_s2r.fit.joint.free_run import free_run, measured  # which no other kind needs

    real, before, after = measured(recording), free_run(recording, {}), free_run(recording, effects)
    errors = np.nan_to_num((before[..., 1] - real[..., 1]) ** 2)
    episode = int(np.argmax(errors.sum(axis=1) / recording.lengths))
    length = int(recording.lengths[episode])
    size = min(STRETCH, length)
    sums = np.convolve(errors[episode, :length], np.ones(size), "valid")
    start = int(np.argmax(sums))
    rows = slice(start, start + size)
    unit = "rad" if recording.units == "rotary" else "m"
    panels = {
        label: {
            name: states[episode, rows, k]
            for name, states in (("measured", real), ("before", before), ("after", after))
        }
        for k, label in enumerate((f"position, {unit}", f"velocity, {unit}/s"))
    }
    t = np.arange(start, start + size) * recording.sample_time
    caption = f"Where the simulator is furthest off: episode {recording.episodes[episode]}, free run from its first row"
    return {caption: drawing.series(t, panels)}


def _contact(recording: ContactRecording, effects: Values) -> dict[str, Figure]:
    """The toss that the simulator gets worst, in windows from measured states."""
    from vision_s2r.fit.contact.free_run import WINDOW, windowed  # likewise

    before, after = windowed(recording, {}), windowed(recording, effects)
    errors = np.nanmean(np.linalg.norm(before.position - recording.position, axis=-1), axis=1)
    episode = int(np.argmax(errors))
    rows = slice(0, int(recording.lengths[episode]))
    panels = {
        f"{axis}, m": {
            "measured": recording.position[episode, rows, k],
            "before": before.position[episode, rows, k],
            "after": after.position[episode, rows, k],
        }
        for k, axis in enumerate("xyz")
    }
    t = np.arange(recording.lengths[episode]) * recording.sample_time
    caption = f"Where the simulator is furthest off: episode {recording.episodes[episode]}, in windows of {WINDOW:g} s"
    return {caption: drawing.series(t, panels)}


def _camera(recording: CameraRecording, effects: Values) -> dict[str, Figure]:
    """Pictures of the frames that are furthest off, and their residuals where pictures are paired."""
    from vision_s2r.fit.camera.pictures import rendered, show  # imports torch

    count = min(FRAMES, len(recording.sim), len(recording.real))
    if recording.pairing == "unpaired":
        shown = [show(recording, k, effects) for k in range(count)]
        columns = {
            "real": list(recording.real[:count]),
            "simulator": list(recording.sim[:count]),
            "simulator with the effects found": [each.picture for each in shown],
        }
        return {"What the camera takes, and what the simulator shows (other scenes)": drawing.strips(columns, {})}
    distance = np.mean((recording.real - recording.sim) ** 2, axis=(1, 2, 3))
    worst = sorted(np.argsort(-distance, kind="stable")[:count].tolist())
    surfaces = rendered(recording, effects)
    shown = [show(recording, k, effects, surfaces=surfaces) for k in worst]
    columns = {
        "real": [recording.real[k] for k in worst],
        "simulator": [recording.sim[k] for k in worst],
        "with the effects found": [each.picture for each in shown],
    }
    residuals = {
        "real − simulator": [_where(recording.real[k] - recording.sim[k], recording, k) for k in worst],
        "real − with the effects": [
            (recording.real[k] - each.mean) * each.known[..., None] for k, each in zip(worst, shown, strict=True)
        ],
    }
    return {"The pictures that are furthest off; grey is no difference": drawing.strips(columns, residuals)}


def _where(residual: np.ndarray, recording: CameraRecording, frame: int) -> np.ndarray:
    return residual if recording.mask is None else residual * recording.mask[frame][..., None]
