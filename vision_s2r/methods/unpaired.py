"""What adaptations without pairs release, whatever their losses."""

from dataclasses import replace
from pathlib import Path

from vision_s2r.adapt import AdaptConfig, train_adapted
from vision_s2r.config import Config
from vision_s2r.methods.registry import MethodInputs, Released


def adapted(name: str, settings: AdaptConfig, cfg: Config, inputs: MethodInputs, out: Path, seed: int) -> Released:
    """Row NAME_policy: a policy on real pictures as they are; row NAME: the translator, where there is one."""
    settings = replace(settings, policy=inputs.policy)
    found = train_adapted(settings, inputs.labelled, inputs.recorded, cfg.translate, out, seed)
    return {f"{name}_policy": found.policy} | ({name: found.translator} if found.translator else {})
