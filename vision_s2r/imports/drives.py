"""What simulators believe of drives that are sold: a start for a diagnosis, no measurement."""

from dataclasses import dataclass, field

from vision_s2r.errors import UserError, nearest


@dataclass(frozen=True)
class KnownDrive:
    """Nominal values and the law of a position servo, as recording.yaml has them."""

    nominal: dict[str, float] = field(default_factory=dict)
    control: dict[str, float] = field(default_factory=dict)
    source: str = "what was given"


DRIVES = {
    "sts3215": KnownDrive(
        nominal={"torque_constant": 1.0, "inertia": 0.028, "viscous_damping": 0.60, "coulomb_friction": 0.052},
        control={"proportional": 17.8, "limit": 3.35},
        source="the SO-101's MuJoCo model (github.com/TheRobotStudio/SO-ARM100), adapted there from Open Duck Mini",
    ),
    # Back-EMF is stall torque over no-load speed; of viscous damping beside it the data sheet says nothing. The gain is
    # that of the firmware's 32, whose law asks for 0.166 of the full pulse width a radian and unit of gain, by an
    # oscilloscope (BAM's bam/feetech/actuator.py); here of 4.9 N·m.
    "sts3250": KnownDrive(
        nominal={
            "torque_constant": 1.0,
            "inertia": 0.012,
            "viscous_damping": 0.0,
            "coulomb_friction": 0.10,
            "back_emf": 0.62,
        },
        control={"proportional": 26.0, "limit": 4.9},
        source="its data sheet (4.9 N·m, 75 rpm at 12 V), the gain as BAM has it (github.com/Rhoban/bam)",
    ),
}


def known_drive(name: str) -> KnownDrive:
    """The drive of this name; nothing is known of one without a name. Raises UserError for one that is not here."""
    if name and name not in DRIVES:
        raise UserError(f"no drive is called '{name}': {nearest(name, DRIVES)}")
    return DRIVES[name] if name else KnownDrive()
