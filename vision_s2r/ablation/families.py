"""Families of translators: which part of the configuration a variant changes, and what trains the result."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from omegaconf import OmegaConf
from omegaconf.errors import ConfigKeyError, OmegaConfBaseException

from vision_s2r import pipeline
from vision_s2r.ablation.config import AblationConfig, selected
from vision_s2r.config import Config
from vision_s2r.errors import UserError, nearest
from vision_s2r.options import validate

Visual = TypeVar("Visual", bound=Config)


@dataclass(frozen=True)
class Family:
    """`key`: of the root configuration, which variants change; `sets`: of scenes, that it learns from; `train`: to a
    released translator below `out`.
    """

    key: str
    sets: tuple[str, ...]
    train: Callable[[Config, int], Path]

    def changed(self, cfg: Visual, changes: Mapping[str, Any]) -> Visual:
        """cfg with these keys as they say. Raises UserError for a key, with the nearest, or a value that cannot be."""
        part = OmegaConf.structured(getattr(cfg, self.key))
        try:
            whole: Any = OmegaConf.to_object(OmegaConf.merge(part, dict(changes)))
        except ConfigKeyError as error:
            group, _, name = str(error.full_key).rpartition(".")
            keys = map(str, OmegaConf.select(part, group) if group else part)
            raise UserError(f"{self.key} has no key '{error.full_key}', {nearest(name, keys)}") from error
        except OmegaConfBaseException as error:
            raise UserError(f"{self.key}.{error.full_key}: {str(error).splitlines()[0]}") from error
        validate(whole, self.key)
        return replace(cfg, **{self.key: whole})


def _unpaired(cfg: Config, seed: int) -> Path:
    """The generator to canonical pictures; the policy that judges is the one that both Q-functions begin as."""
    adapted = pipeline.adapt(replace(cfg, adapt=replace(cfg.adapt, policy=cfg.translate.q_function)), seed)
    if adapted.translator is None:
        raise UserError("adapt.way_back is false: expected true, the ablation is of translators")
    return adapted.translator


FAMILIES: Mapping[str, Family] = {
    "paired": Family("translate", ("pairs",), pipeline.paired_translator),
    "unpaired": Family("adapt", ("train", "real"), _unpaired),
}


def family_of(cfg: AblationConfig) -> Family:
    """That of the job's variant. Raises UserError for one that there is none of."""
    return _family(cfg, cfg.variant)


def needed(cfg: AblationConfig) -> list[str]:
    """The sets of scenes that all jobs read together. Raises UserError as `family_of`."""
    sets = [name for variant in selected(cfg) for name in _family(cfg, variant).sets]
    return list(dict.fromkeys([*sets, *([] if cfg.policy else ["train"]), "validation", "test"]))


def _family(cfg: AblationConfig, variant: str) -> Family:
    name = cfg.definitions[variant].family
    if name not in FAMILIES:
        raise UserError(f"variant {variant}: no family '{name}', {nearest(name, FAMILIES)}")
    return FAMILIES[name]
