"""What simulators believe of drives that are sold: a start for a diagnosis, no measurement."""

import math
from dataclasses import dataclass, field

from vision_s2r.errors import UserError, nearest


@dataclass(frozen=True)
class KnownDrive:
    """Nominal values and the law of a position servo, as recording.yaml has them."""

    nominal: dict[str, float] = field(default_factory=dict)
    control: dict[str, float] = field(default_factory=dict)
    source: str = "what was given"
    firmware_gain: float = 32.0  # the setting of the firmware that the law's gain is of
    volts: float = 0.0  # supply that torques and gain are of; 0: not known


def _dynamixel(
    stall: float,  # N·m
    speed: float,  # rpm, without load
    volts: float,
    duty: float,  # of the full pulse width that the firmware's law asks for, per radian
    firmware_gain: float,
    friction: tuple[float, float, float],  # armature, kg·m², and dry and viscous friction, N·m and N·m·s/rad
    gain_source: str,
) -> KnownDrive:
    """A servo whose torque and back-EMF are those of its data sheet."""
    armature, dry, viscous = friction
    nominal = {"torque_constant": 1.0, "inertia": armature, "viscous_damping": viscous, "coulomb_friction": dry}
    return KnownDrive(
        nominal={**nominal, "back_emf": round(stall / (speed * math.tau / 60), 4)},
        control={"proportional": round(stall * duty, 4), "limit": stall},
        source=f"its data sheet ({stall} N·m, {speed:g} rpm at {volts:g} V), the gain as {gain_source}; armature and "
        "friction as BAM's simplest model of another specimen has them (github.com/Rhoban/bam)",
        firmware_gain=firmware_gain,
        volts=volts,
    )


MANUAL = 4096 / math.tau / 128 / 885  # of the pulse width a radian and unit of gain: counts, divisor and full width
OSCILLOSCOPE = "BAM has it, by an oscilloscope"
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
        volts=12.0,
    ),
    "mx64": _dynamixel(6.0, 63, 12.0, 0.158 * 32, 32, (0.012, 0.09, 0.012), OSCILLOSCOPE),
    "mx106": _dynamixel(8.4, 45, 12.0, 0.158 * 32, 32, (0.027, 0.10, 0.035), OSCILLOSCOPE),
    "xl320": _dynamixel(0.39, 114, 7.4, 0.0505 * 32, 32, (0.0011, 0.03, 0.009), OSCILLOSCOPE),
    # Of XL330s BAM found a divisor of 256 where the manual has 128: a cause that a diagnosis may find.
    "xl330": _dynamixel(0.52, 103, 5.0, MANUAL * 400, 400, (0.002, 0.018, 0.006), "in its manual"),
}


def known_drive(name: str) -> KnownDrive:
    """The drive of this name; nothing is known of one without a name. Raises UserError for one that is not here."""
    if name and name not in DRIVES:
        raise UserError(f"no drive is called '{name}': {nearest(name, DRIVES)}")
    return DRIVES[name] if name else KnownDrive()
