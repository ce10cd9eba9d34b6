"""What fitting needs of a joint effect: one record an effect, each in a file of `fit/joint/effects`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vision_s2r.effects import Records
from vision_s2r.fit.coordinates import ParameterRange, Setting

if TYPE_CHECKING:  # the file of an effect holds its physics too, and is read before the simulator is there
    from vision_s2r.fit.joint.track import JointTrack

Row = Mapping[str, float]  # a machine's columns by name


@dataclass(frozen=True, kw_only=True)
class JointFit:
    """What fitting needs of one effect. `row` is the machine that the effect is tried beside."""

    # (track, noise of the position) -> ranges of the fitted parameters, in their order.
    ranges: Callable[[JointTrack, float], list[ParameterRange]]
    # (track, row, residuals [E, T, channels] of that machine) -> settings of which one is near any.
    starts: Callable[[JointTrack, Row, np.ndarray], list[Setting]]
    # (track, row) -> a size that an engineer would care about; None: no size could show here. Without it, the effect
    # is never said to be not excited.
    plausible: Callable[[JointTrack, Row], Setting | None] | None = None
    not_excited: str = ""  # why a recording could not have shown it
    # The motion that shows it; may hold {unit}, {quantity} (current, target), {effort} (torque), and {peak},
    # {slow}, {rate}, {fast} with formats.
    excited_by: str = ""
    confusable: frozenset[str] = frozenset()  # effects that may pass for this one; one side of a pair is enough
    # Axes of a report's `where` along which its definition makes it larger in some places than in others.
    along: tuple[str, ...] = ()
    # (parameters) -> after which way (rad, m) its torque comes again, if it does.
    period: Callable[[Row], float] | None = None
    rough: bool = False  # its form is only roughly the same on any two machines
    rippled: bool = False  # its likelihood has ripples, of impacts
    instants: bool = False  # something else looks like it whose size is another at each sample


JOINT_FITS: Records[JointFit] = Records("joint", "fitting")
