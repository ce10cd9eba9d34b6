"""The configuration of an identification."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.options import option, validate
from vision_s2r.recording.folders import folders

EXAMPLES = ("two_point", "emps")
METHODS = ("forward", "inverse")


@dataclass
class InverseConfig:
    """What the inverse method takes from positions."""

    bandwidth: float | None = option(
        None,
        "Hz, of the motion that the model is to describe; positions are filtered at 5 times this, the torque balance "
        "at twice this. null: a fiftieth of the sampling rate.",
        above=0,
    )
    held: bool = option(
        True,
        "Whether the command is held between samples, as recordings have it; then the torque at a sample is the mean "
        "of the commands around it, to fourth order.",
    )
    reversals: bool = option(
        False,
        "Whether what is measured around reversals counts, slower than a twentieth of the fastest: the joint may stick "
        "there, which makes dry friction seem smaller.",
    )


@dataclass
class HoldConfig:
    """Nominal parameters that are known, held at what is given here.

    What is not given is identified, apart from the torque constant, which stays as the recording has it unless it is
    among the effects.
    """

    inertia: float | None = option(None, "kg·m², or kg.")
    viscous_damping: float | None = option(None, "N·m·s/rad, or N·s/m.")
    coulomb_friction: float | None = option(None, "N·m, or N.")
    gravity_torque: float | None = option(None, "N·m, or N.")
    bias_torque: float | None = option(None, "N·m, or N.")

    def known(self) -> dict[str, float]:
        """Those that are given."""
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass
class IdentifyConfig:
    """Everything that `vision-s2r identify` reads."""

    example: str = option(
        "",
        "A worked example: two_point (a joint from two steady states), or emps (a real axis against what was published "
        "of it, in recording=FOLDER with estimation/ and validation_pulses/). None if empty.",
        choices=("", *EXAMPLES),
    )
    recording: Any = option(None, "The recording's folder, or several: recording=[DIR,DIR].")
    together: bool = option(
        False,
        "Whether several recordings are of one joint, identified together, each with a bias torque and a position "
        "offset of its own; else each by itself.",
    )
    effects: list[str] = option(
        [],
        "Effects that the joint is taken to have, beside the nominal parameters, which are always identified …",
    )
    report: str = option("", "… and those that a diagnosis (its report.json) found.")
    hold: HoldConfig = option(HoldConfig, "Nominal parameters that are known.")
    method: str = option(
        "forward",
        "forward: simulation against the recording, for every effect. inverse: least squares on the torque balance, "
        "for nominal parameters and asymmetric_friction.",
        choices=METHODS,
    )
    inverse: InverseConfig = option(InverseConfig, "What the inverse method takes from positions.")
    validate: str = option("", "Another recording of the same machine, on which the identified simulator is tried.")
    out: str = option("outputs/identified", "Folder of the result; of several recordings, each gets a folder in it.")
    seed: int = option(0, "Of the bootstrap, and of the example's sensor noise.", low=0)


def check(cfg: IdentifyConfig) -> None:
    """UserError unless every value can be."""
    validate(cfg)
    if cfg.example != "two_point":
        folders(cfg.recording)
    for name in cfg.effects:
        JOINT_EFFECTS[name]
    for name, value in cfg.hold.known().items():
        JOINT_EFFECTS[name].check({"value": value}, f"hold.{name}")
        if name in cfg.effects:
            raise UserError(f"hold.{name} is {value:g}, but it is among the effects that are to be identified")


ConfigStore.instance().store("identify_schema", node=IdentifyConfig)
