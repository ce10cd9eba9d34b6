"""What simulators believe of drives that are sold: a start for a diagnosis, no measurement."""

from dataclasses import dataclass


@dataclass(frozen=True)
class KnownDrive:
    """Nominal values and the law of a position servo, as recording.yaml has them."""

    nominal: dict[str, float]
    control: dict[str, float]
    source: str


DRIVES = {
    "sts3215": KnownDrive(
        nominal={"torque_constant": 1.0, "inertia": 0.028, "viscous_damping": 0.60, "coulomb_friction": 0.052},
        control={"proportional": 17.8, "limit": 3.35},
        source="the SO-101's MuJoCo model (github.com/TheRobotStudio/SO-ARM100), adapted there from Open Duck Mini",
    ),
    # Damping is stall torque over no-load speed; the gain, of the firmware's 32, is twice the sts3215's in pulse width.
    "sts3250": KnownDrive(
        nominal={"torque_constant": 1.0, "inertia": 0.012, "viscous_damping": 0.62, "coulomb_friction": 0.10},
        control={"proportional": 52.0, "limit": 4.9},
        source="its data sheet (4.9 N·m, 75 rpm at 12 V), the gain scaled from the sts3215's",
    ),
}
