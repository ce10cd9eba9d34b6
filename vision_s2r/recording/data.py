"""What a recording is, once it has been read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeAlias, TypeVar, cast

import numpy as np

from vision_s2r.contact.shape import Shape


@dataclass(frozen=True)
class JointRecording:
    """E episodes of a joint, the longest of T samples; units are SI, angular or linear as `units` says.

    Row k of an episode is the state at `time[:, k]`, and the command from then until the next row. The commands of a
    position servo, whose `nominal` has a proportional_gain, are target positions.
    """

    nominal: dict[str, float]  # what the simulator believes: arguments of `vision_s2r.joint.NominalJoint`
    sample_time: float  # s; of uneven samples the median
    units: Literal["rotary", "linear"]
    # float64 [E, T]: current in A, or torque or force with a torque constant of 1, or target in rad or m; 0 at the end
    command: np.ndarray
    position: np.ndarray  # float64 [E, T], rad or m; NaN after the end
    velocity: np.ndarray | None  # float64 [E, T], rad/s or m/s; NaN after the end; None where it was not recorded
    lengths: np.ndarray  # int64 [E]
    episodes: tuple[int, ...]  # the episodes' numbers in the recording
    times: np.ndarray | None = None  # float64 [E, T], s since each first row; None: every `sample_time`
    supply: np.ndarray | None = None  # float64 [E, T]: factor of the command, 0 where the drive is off; None: 1
    # float64 [E, T], or of an arm's joint [E, T·S], S values a row, held for an equal part of the time to the next each
    external: np.ndarray | None = None  # torque or force on the load; None: none
    load_inertia: np.ndarray | None = None  # kg·m² or kg beside the nominal one; None: none
    least_inertia: float = 0.0  # of the nominal inertia, what is the bodies' of an arm: no rotor makes it less
    left_out: dict[str, str] = field(default_factory=dict)  # columns that could not be used, and why
    # int64 [E]: which of the recordings that were joined an episode is of, from 0 on; None: all of one
    source: np.ndarray | None = None
    gains: np.ndarray | None = None  # float64 [E]: factor of both gains of a servo, episode by episode; None: 1
    # float64 [E], rad/s or m/s: of the first rows, where there are no velocities and episodes begin in motion; None: 0
    start_velocity: np.ndarray | None = None
    # int64 [E]: where rows were left out, which of the episodes before an episode is a stretch of; None: each is whole
    stretch_of: np.ndarray | None = None

    kind = "joint"

    def __len__(self) -> int:
        return len(self.lengths)

    @property
    def motions(self) -> int:
        """How many motions there are: episodes, as they were before any rows were left out."""
        return len(self) if self.stretch_of is None else len(np.unique(self.stretch_of))

    @property
    def servo(self) -> bool:
        """Whether commands are the targets of a position servo."""
        return "proportional_gain" in self.nominal

    @property
    def time(self) -> np.ndarray:
        """float64 [E, T]: s since each episode's first row; it goes on after the end."""
        if self.times is not None:
            return self.times
        return np.broadcast_to(np.arange(self.position.shape[1]) * self.sample_time, self.position.shape)

    @property
    def first(self) -> np.ndarray:
        """float64 [E, 2]: position and velocity of each episode's first row; from rest where nothing says otherwise."""
        at_rest = np.zeros(len(self)) if self.start_velocity is None else self.start_velocity
        velocity = at_rest if self.velocity is None else self.velocity[:, 0]
        return np.stack([self.position[:, 0], velocity], axis=1)


@dataclass(frozen=True)
class CameraRecording:
    """Pictures that a camera took, and a simulator's: of the same N scenes, or two sets."""

    pairing: Literal["paired", "unpaired"]
    encoding: Literal["srgb", "linear"]  # what values mean
    sim: np.ndarray  # float32 [N, H, W, 3] RGB in [0, 1]; a grey picture has three equal channels
    real: np.ndarray  # the same; unpaired, of another number of pictures
    labels: np.ndarray | None  # uint8 [N, H, W]: segmentation of `sim`
    mask: np.ndarray | None  # bool [N, H, W]: where `sim` is meant at all
    intrinsics: np.ndarray | None  # float64 [4]: fx, fy, cx, cy in px, pixel centres at integers
    bits: int  # 8 or 16: of `real`'s values
    grey: bool
    names: tuple[str, ...]  # of `sim`, and of `real` where they are paired
    real_names: tuple[str, ...]
    depth: np.ndarray | None = None  # float32 [N, H, W]: m along the optical axis of `sim`'s camera, 0 where unknown
    label_names: Mapping[int, str] = field(default_factory=dict)  # what labels are called, of those that have a name

    kind = "camera"

    def __len__(self) -> int:
        return len(self.real)


@dataclass(frozen=True)
class ContactRecording:
    """E tosses, drops or pushes of a body onto its support, the longest of T samples; in the support's frame, SI units.

    Row k of an episode is the state at `k * sample_time`, of the centre of the shape; NaN after the end.
    """

    nominal: dict[str, float]  # what the simulator believes: mass, lateral_friction, restitution, gravity
    shape: Shape
    sample_time: float  # s
    position: np.ndarray  # float64 [E, T, 3], m
    attitude: np.ndarray  # float64 [E, T, 4]: unit quaternions x, y, z, w
    velocity: np.ndarray | None  # float64 [E, T, 6], m/s and rad/s; None where it was not recorded
    lengths: np.ndarray  # int64 [E]
    episodes: tuple[int, ...]  # the episodes' numbers in the recording

    kind = "contact"

    def __len__(self) -> int:
        return len(self.lengths)


@dataclass(frozen=True)
class ArmRecording:
    """E episodes of an arm, whose joints were logged together.

    Of each joint, by its name in the model, a recording of its own: commands, positions, and what the simulator
    believes of its drive, whose inertia is the rotor's. What the rest of the arm does to it is not in there.
    """

    model: Path  # MJCF or URDF
    joints: dict[str, JointRecording]
    modes: dict[str, str]  # of each joint: position, velocity or torque, what is commanded
    hold: dict[str, float]  # rad or m: where joints are that were not logged; others of these are at 0
    tip: str | None  # the body or site that works
    # float64 [E, T], N·m or N at the joint, of those that logged one; NaN after the end. No fit looks at it.
    torque: dict[str, np.ndarray] = field(default_factory=dict)

    kind = "arm"

    def __len__(self) -> int:
        return len(self.any)

    @property
    def by_goals(self) -> bool:
        """Whether all joints are commanded in positions."""
        return set(self.modes.values()) == {"position"}

    @property
    def any(self) -> JointRecording:
        """One of the joints, which have episodes, lengths and times in common."""
        return next(iter(self.joints.values()))

    @property
    def episodes(self) -> tuple[int, ...]:
        """The episodes' numbers in the recording."""
        return self.any.episodes

    @property
    def position(self) -> np.ndarray:
        """float64 [E, T, J], rad or m; NaN after the end."""
        return np.stack([joint.position for joint in self.joints.values()], axis=-1)

    @property
    def left_out(self) -> dict[str, str]:
        """Columns that were not used, and why."""
        return {f"{key}.{name}": why for name, each in self.joints.items() for key, why in each.left_out.items()}


Recording: TypeAlias = JointRecording | CameraRecording | ContactRecording | ArmRecording
R = TypeVar("R", JointRecording, CameraRecording, ContactRecording, ArmRecording)


def split(recording: R, units: Sequence[int]) -> R:
    """The recording of these episodes or frames alone, in this order.

    Of an unpaired camera, frames are those of `real`; all of `sim` stays.
    """
    index = np.asarray(units, dtype=np.int64)
    if isinstance(recording, JointRecording):
        return cast(R, _episodes(recording, index))
    if isinstance(recording, ContactRecording):
        return cast(R, _tosses(recording, index))
    if isinstance(recording, ArmRecording):
        return cast(R, _of_arm(recording, index))
    return cast(R, _frames(cast(CameraRecording, recording), index))


def _episodes(recording: JointRecording, index: np.ndarray) -> JointRecording:
    lengths = recording.lengths[index]
    longest = int(lengths.max(initial=0))

    def taken(values: np.ndarray | None) -> np.ndarray | None:
        if values is None:
            return None
        parts = values.shape[1] // recording.command.shape[1]
        return values[index, : longest * parts]

    return replace(
        recording,
        command=recording.command[index, :longest],
        position=recording.position[index, :longest],
        velocity=taken(recording.velocity),
        times=taken(recording.times),
        supply=taken(recording.supply),
        external=taken(recording.external),
        load_inertia=taken(recording.load_inertia),
        lengths=lengths,
        gains=None if recording.gains is None else recording.gains[index],
        start_velocity=None if recording.start_velocity is None else recording.start_velocity[index],
        source=None if recording.source is None else recording.source[index],
        stretch_of=None if recording.stretch_of is None else recording.stretch_of[index],
        episodes=tuple(recording.episodes[k] for k in index),
    )


def _of_arm(recording: ArmRecording, index: np.ndarray) -> ArmRecording:
    joints = {name: _episodes(joint, index) for name, joint in recording.joints.items()}
    longest = next(iter(joints.values())).position.shape[1]
    torque = {name: values[index, :longest] for name, values in recording.torque.items()}
    return replace(recording, joints=joints, torque=torque)


def _tosses(recording: ContactRecording, index: np.ndarray) -> ContactRecording:
    lengths = recording.lengths[index]
    longest = int(lengths.max(initial=0))
    return replace(
        recording,
        position=recording.position[index, :longest],
        attitude=recording.attitude[index, :longest],
        velocity=None if recording.velocity is None else recording.velocity[index, :longest],
        lengths=lengths,
        episodes=tuple(recording.episodes[k] for k in index),
    )


def _frames(recording: CameraRecording, index: np.ndarray) -> CameraRecording:
    taken = replace(recording, real=recording.real[index], real_names=tuple(recording.real_names[k] for k in index))
    if recording.pairing == "unpaired":
        return taken
    return replace(
        taken,
        sim=recording.sim[index],
        names=tuple(recording.names[k] for k in index),
        labels=None if recording.labels is None else recording.labels[index],
        mask=None if recording.mask is None else recording.mask[index],
        depth=None if recording.depth is None else recording.depth[index],
    )
