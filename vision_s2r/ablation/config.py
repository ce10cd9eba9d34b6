"""What the ablation is told."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.config import Config
from vision_s2r.errors import UserError, nearest
from vision_s2r.options import option


@dataclass
class VariantConfig:
    """One way to train: a family of translators, and what of it differs from the configuration."""

    family: str = option("paired", "Of translators.")
    changes: dict[str, Any] = option(
        {}, "By group (loss, network, training) or key of the family's configuration: what differs from it."
    )


@dataclass
class AblationConfig:
    """Variants, and where they are measured. A job is one variant with one training seed."""

    definitions: dict[str, VariantConfig] = option({}, "Every variant there is, by name.")
    references: dict[str, str] = option({}, "By family: the variant that the others are compared with.")
    variants: list[str] = option([], "Those to run, by name, and their families' references with them; empty: all.")
    policy: list[str] = option(
        [],
        "Released canonical policies, one a seed, which grasp and judge translations; empty: trained first, in "
        "OUT/policy-SEED.",
    )
    cameras: list[str] = option(
        ["webcam", "harsh"], "What the real look is seen through: names in configs/camera.", unique=True
    )
    scenes: int = option(250, "Test scenes a camera, from the first; 0: all.", low=0)
    variant: str = option("", "Of this job; the sweep sets it.")
    seed: int = option(0, "Of this job; the sweep sets it.", low=0)


@dataclass
class AblationStudyConfig(Config):
    """Everything that `vision-s2r ablate` reads: the visual pipeline's keys, and variants."""

    ablation: AblationConfig = option(AblationConfig, "What each term of a translator's loss is worth.")


def check(cfg: AblationConfig, seeds: int) -> None:
    """Raises UserError unless every name can be and there is a policy for each of the seeds."""
    for key, names in (("variants", cfg.variants), ("variant", [cfg.variant] if cfg.variant else [])):
        for name in names:
            if name not in cfg.definitions:
                raise UserError(f"ablation.{key}: no variant '{name}', {nearest(name, cfg.definitions)}")
    for name, variant in cfg.definitions.items():
        if variant.family not in cfg.references:
            raise UserError(f"variant {name}: no family '{variant.family}', {nearest(variant.family, cfg.references)}")
    for family, name in cfg.references.items():
        if name not in cfg.definitions or cfg.definitions[name].family != family:
            raise UserError(f"ablation.references.{family} = '{name}': expected a variant of that family")
    if cfg.policy and len(cfg.policy) != seeds:
        raise UserError(f"ablation.policy: {len(cfg.policy)} policies for {seeds} seeds: expected one for each")
    if not cfg.cameras:
        raise UserError("ablation.cameras is empty: expected at least one of configs/camera")


def selected(cfg: AblationConfig) -> dict[str, VariantConfig]:
    """The variants to run in their order, each family's reference with them."""
    wanted = cfg.variants or list(cfg.definitions)
    wanted = wanted + [cfg.references[cfg.definitions[name].family] for name in wanted]
    return {name: variant for name, variant in cfg.definitions.items() if name in wanted}


ConfigStore.instance().store("ablation_schema", node={"ablation": AblationConfig()})
