"""What the body does in each window: it flies, hits, bounces, slides, rolls or rests, how fast, and on what part."""

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.fit.bins import by_rank
from vision_s2r.fit.case import Axis
from vision_s2r.fit.contact.windows import ContactTrack, rests

PHASES = ("in free flight", "at the first impact", "bouncing", "sliding", "rolling or tumbling", "at rest")
PARTS = ("on a corner", "on an edge", "on a face")
SLIPS = 0.1  # m/s of the lowest point
TURNS = 0.5  # of the speed of the centre: a spin about the support's axes that is faster rolls or tumbles
SPEEDS, SPINS = 4, 2  # bins


def phases_of(track: ContactTrack, episode: np.ndarray, sample: np.ndarray, samples: np.ndarray) -> tuple[Axis, ...]:
    """The axes of windows [W], of these episodes, from these samples on, so many samples long."""
    state, lowest = track.states.state, track.lowest
    touching = lowest < track.near
    count, begun = len(sample), state[episode, sample]
    phase, part, touches = np.full(count, -1), np.full(count, -1), np.zeros(count, dtype=bool)
    speed = np.linalg.norm(begun[:, 7:10], axis=1)
    # One that was put down, or pushed, has no first impact.
    first_touch = [int(np.argmax(row)) if row.any() and not row[0] else len(row) for row in touching]
    for k in range(count):
        e, start = int(episode[k]), int(sample[k])
        end = min(start + int(samples[k]), int(track.lengths[e]))
        phase[k] = _phase(track, state[e, start:end], touching[e, start:end], start <= first_touch[e] < end)
        touches[k] = touching[e, start:end].any()
        if touches[k] and track.shape.kind == "box":
            at = start + int(np.nanargmin(lowest[e, start:end]))
            part[k] = _part(track, state[e, at])
    spin = np.where(touches, np.abs(begun[:, 12]), np.nan)
    axes = [
        Axis("phase", PHASES, phase),
        Axis("speed", *by_rank(speed, SPEEDS, "{low:.2g} to {high:.2g} m/s")),
        Axis("spin", *by_rank(spin, SPINS, "{low:.2g} to {high:.2g} rad/s on the spot")),
    ]
    return (*axes, Axis("part", PARTS, part)) if (part >= 0).any() else tuple(axes)


def _phase(track: ContactTrack, state: np.ndarray, touching: np.ndarray, first: bool) -> int:
    if not touching.any():
        return 0
    if first:
        return 1
    velocity, spin = state[:, 7:10], state[:, 10:]
    if rests(track, state):
        return 5
    if not touching.all():
        return 2
    slip = velocity[:, :2] + track.shape.depth * np.stack([-spin[:, 1], spin[:, 0]], axis=1)
    speed = np.linalg.norm(velocity, axis=1).mean()
    tumbles = track.shape.reach * np.linalg.norm(spin[:, :2], axis=1).mean() > TURNS * speed
    return 4 if tumbles or np.linalg.norm(slip, axis=1).mean() < SLIPS else 3


def _part(track: ContactTrack, state: np.ndarray) -> int:
    """Corner, edge or face of a box, by how many of its corners are about as low as the lowest."""
    heights = Rotation.from_quat(state[3:7]).apply(track.shape.points)[:, 2]
    low = int((heights < heights.min() + 0.1 * track.shape.depth).sum())
    return 0 if low < 2 else 1 if low < 4 else 2
