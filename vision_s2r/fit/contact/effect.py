"""What fitting needs of a contact effect: one record an effect, each in a file of `fit/contact/effects`."""

from collections.abc import Callable
from dataclasses import dataclass

from vision_s2r.contact import NominalContact, Shape
from vision_s2r.effects import Records
from vision_s2r.fit.coordinates import ParameterRange, Setting


@dataclass(frozen=True)
class ContactScales:
    """How large things are in a recording."""

    nominal: NominalContact
    shape: Shape
    sample_time: float  # s


@dataclass(frozen=True, kw_only=True)
class ContactFit:
    """What fitting needs of one effect."""

    ranges: Callable[[ContactScales], list[ParameterRange]]  # of the fitted parameters, in their order
    starts: Callable[[ContactScales], list[Setting]]  # settings of which one is near any
    plausible: Callable[[ContactScales], Setting]  # a size that an engineer would care about
    not_excited: str  # why a recording could not have shown it
    excited_by: str  # the motion that shows it
    confusable: frozenset[str] = frozenset()  # effects that may pass for this one; one side of a pair is enough
    along: tuple[str, ...] = ()  # axes of `phases` on which it has a place
    # Ways [N, K] from one start to the next, where a fit has to begin nearer to the optimum than these are.
    valley: Callable[[ContactScales], list[tuple[float, ...]]] | None = None
    length: bool = False  # of an arm, in m, though its unit says nothing
    rough: bool = False  # its form is only roughly the same on any two bodies


CONTACT_FITS: Records[ContactFit] = Records("contact", "fitting")
