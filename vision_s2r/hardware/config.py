"""The configuration of a study of measured machines."""

from dataclasses import dataclass

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.options import option, validate


@dataclass
class HardwareConfig:
    """Everything that `vision-s2r hardware` reads."""

    path: str = option(
        "", "Folder of recordings of joints, arms or cameras, motions of SAGE, benches of BAM, however deep in it."
    )
    out: str = option(
        "outputs/hardware", "Folder of recordings/, reports/ and tables; what is measured there is not measured again."
    )
    only: list[str] = option([], "Measure now only what has one of these in its name (so101/Wrist_Roll); empty: all.")
    together: list[str] = option(
        [], "Motions to diagnose as one, [multisine,prbs_excitation], of each machine that has them; empty: each alone."
    )
    diagnose: bool = option(
        True, "Diagnose each; false: only identify joints' nominal values, in seconds, and try them on the others."
    )
    added: bool = option(
        False,
        "Diagnose each log of a joint, and each set of photographs beside renders, again with each of a dozen known "
        "effects added to it: what is found?",
    )
    jobs: int = option(1, "Threads of a diagnosis.", low=1)


def check(cfg: HardwareConfig) -> None:
    """UserError unless every value can be."""
    validate(cfg)
    if not cfg.path:
        raise UserError("path is missing, expected path=DIR, a folder of logs")
    for key, asked in (("together", bool(cfg.together)), ("added", cfg.added)):
        if asked and not cfg.diagnose:
            raise UserError(f"{key} asks for diagnoses, but diagnose is false")


ConfigStore.instance().store("hardware_schema", node=HardwareConfig)
