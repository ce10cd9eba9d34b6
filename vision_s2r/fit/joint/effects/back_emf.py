"""How a motor's back-EMF is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    damping, nominal = track.scales.damping, track.nominal
    believed = nominal.back_emf or nominal.viscous_damping  # which is in part the motor's, that goes with its drive
    return [linear("value", 0.0, 20 * (damping + believed), damping, 0.5 * believed or damping)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start: the damping that there is, parted in several ways; the fit takes the rest off b."""
    return [{"value": part * max(row["viscous_damping"], track.scales.damping)} for part in (0.2, 0.6, 0.9)]


def plausible(track: JointTrack, row: Row) -> Setting | None:
    """A size that an engineer would care about; none where the drive is never off."""
    scale = track.inputs.scale
    off = scale is not None and bool((scale <= 0).any())
    return {"value": 0.3 * max(row["viscous_damping"], track.scales.damping)} if off else None


JOINT_FITS.register(
    "back_emf",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="the drive is never off while the joint moves",
        excited_by="motion with the drive switched off and a load that moves the joint",
        confusable=frozenset({"viscous_damping"}),
    ),
)
