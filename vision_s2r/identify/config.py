"""The configuration of an identification, as configs/identify.yaml has it."""

from dataclasses import dataclass, field
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError, nearest
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.recording.folders import folders

EXAMPLES = ("two_point", "emps")
METHODS = ("forward", "inverse")


@dataclass
class InverseConfig:
    """How the inverse method takes velocities and accelerations from positions."""

    bandwidth: float | None = None  # Hz, of what is modelled; None: a fiftieth of the sampling rate
    held: bool = True  # whether commands are held between samples


@dataclass
class HoldConfig:
    """Nominal parameters that are known, beside the torque constant."""

    inertia: float | None = None
    viscous_damping: float | None = None
    coulomb_friction: float | None = None
    gravity_torque: float | None = None
    bias_torque: float | None = None

    def known(self) -> dict[str, float]:
        """Those that are given."""
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass
class IdentifyConfig:
    """Everything that scripts/identify.py reads."""

    example: str = ""
    recording: Any = None  # DIR or [DIR, …]
    effects: list[str] = field(default_factory=list)
    report: str = ""
    hold: HoldConfig = field(default_factory=HoldConfig)
    method: str = "forward"
    inverse: InverseConfig = field(default_factory=InverseConfig)
    validate: str = ""
    out: str = "outputs/identified"
    seed: int = 0


def check(cfg: IdentifyConfig) -> None:
    """UserError unless every value can be."""
    if cfg.example and cfg.example not in EXAMPLES:
        raise UserError(f"example: none is called '{cfg.example}': {nearest(cfg.example, EXAMPLES)}")
    if cfg.example != "two_point":
        folders(cfg.recording)
    if cfg.method not in METHODS:
        raise UserError(f"method is '{cfg.method}': {nearest(cfg.method, METHODS)}")
    for name in cfg.effects:
        JOINT_EFFECTS[name]
    for name, value in cfg.hold.known().items():
        JOINT_EFFECTS[name].check({"value": value}, f"hold.{name}")
        if name in cfg.effects:
            raise UserError(f"hold.{name} is {value:g}, but it is among the effects that are to be identified")
    if cfg.inverse.bandwidth is not None and not cfg.inverse.bandwidth > 0:
        raise UserError(f"inverse.bandwidth is {cfg.inverse.bandwidth:g}, expected Hz, more than 0")


ConfigStore.instance().store("identify_schema", node=IdentifyConfig)
