"""Which variants are run."""

from vision_s2r.config import AblationConfig, VariantConfig
from vision_s2r.errors import UserError, nearest


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
