"""The recording to make next: commands that rivals would answer differently, or that excite what was not_excited."""

from collections.abc import Sequence

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.fitter import JointFitter, names_of
from vision_s2r.fit.joint.track import Track
from vision_s2r.joint import simulate

SECONDS = 8.0


def excitations(peak: float, sample_time: float) -> dict[str, np.ndarray]:
    """Candidate commands [samples] about zero, by what they are called."""
    t = np.arange(round(SECONDS / sample_time)) * sample_time
    top = 0.1 / sample_time
    noise = np.random.default_rng(0)
    found: dict[str, np.ndarray] = {}
    for share in (0.3, 1.0):
        a = share * peak
        found |= {
            f"steps of ±{a:.3g} {{unit}} every second": a * np.sign(np.sin(np.pi * t + 1e-9)),
            f"a sine of {a:.3g} {{unit}} at 0.25 Hz": a * np.sin(0.5 * np.pi * t),
            f"a chirp of {a:.3g} {{unit}} from 0.2 to {top:.3g} Hz": a
            * np.sin(2 * np.pi * (0.2 * t + (top - 0.2) * t**2 / (2 * SECONDS))),
            f"random steps of {a:.3g} {{unit}}, a new one every sample": a * noise.uniform(-1, 1, len(t)),
            f"a constant {a:.3g} {{unit}}, then as much backward": a * np.where(t < SECONDS / 2, 1.0, -1.0),
        }
    return found


def experiment(fitter: JointFitter, rivals: Sequence[Hypothesis], not_excited: Sequence[str], noise: np.ndarray) -> str:
    """One sentence, or two; empty where nothing is to be told apart and nothing was not_excited.

    Commands are what this recording's drive takes: current, torque or force, or the targets of a position servo, which
    stay in the range that they had.
    """
    track = fitter.track
    low, high = float(track.command.min()), float(track.command.max())
    centre, peak = (0.5 * (low + high), 0.5 * (high - low)) if track.servo else (0.0, max(-low, high))
    words = _words(track, centre, peak or 1.0)
    sentences = []
    if len(rivals) > 1:
        sentences.append(_telling_apart(fitter, rivals, noise, centre, peak or 1.0).format(**words))
    asked = {name: JOINT_FITS[name].excited_by for name in not_excited}
    wishes = [motion.format(**words) + f" would show {name}" for name, motion in asked.items() if motion]
    if wishes:
        sentences.append("; ".join(wishes[:4]).capitalize() + ".")
    return " ".join(sentences)


def _words(track: Track, centre: float, peak: float) -> dict[str, str | float]:
    linear = track.units == "linear"
    effort = "force" if linear else "torque"
    if track.servo:
        length = "m" if linear else "rad"
        quantity, unit = "target", f"{length} about {centre:.3g} {length}"
    elif track.nominal.torque_constant != 1:
        quantity, unit = "current", "A"
    else:
        quantity, unit = effort, "N" if linear else "N·m"
    return {
        "unit": unit,
        "quantity": quantity,
        "effort": effort,
        "peak": peak if track.servo else 1.5 * peak,
        "slow": 0.2,
        "rate": 2.0,
        "fast": 0.2 / track.sample_time,
    }


def _telling_apart(
    fitter: JointFitter, rivals: Sequence[Hypothesis], noise: np.ndarray, centre: float, peak: float
) -> str:
    track = fitter.track
    commands = excitations(peak, track.sample_time)
    states = []
    for rival in rivals:
        space = fitter.space(names_of(rival))
        point = space.start(rival)
        rows = space.machines(point[None])
        states.append(
            simulate(
                rows,
                np.array(list(commands.values())) + centre,
                np.tile([centre if track.servo else 0.0, 0.0], (len(commands), 1)),
                track.sample_time,
                substeps=fitter.observer.substeps,
                tables=space.tables,
                threads=1,
            )[0]
        )
    channel = 0 if track.velocity is None else 1
    shown = np.array(states)[..., channel]
    spread = np.min([np.sqrt(np.mean((shown[0] - other) ** 2, axis=1)) for other in shown[1:]], axis=0)
    best = int(np.argmax(spread))
    unit = ("m" if track.units == "linear" else "rad") + ("/s" if channel else "")
    return (
        f"Record {list(commands)[best]}: the rivals' {'velocities' if channel else 'positions'} then differ by "
        f"{spread[best]:.2g} {unit} (rms) where the noise is {np.sqrt(noise[channel]):.2g}."
    )
