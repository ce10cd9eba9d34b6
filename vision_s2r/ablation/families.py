"""Families of translators: which part of the configuration a variant changes, and what trains the result."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TypeVar

from vision_s2r import pipeline
from vision_s2r.ablation.config import AblationConfig
from vision_s2r.config import Config
from vision_s2r.errors import UserError, nearest

Visual = TypeVar("Visual", bound=Config)


@dataclass(frozen=True)
class Family:
    """`key`: of the root configuration, whose `loss` variants change; `train`: to a released translator below `out`."""

    key: str
    train: Callable[[Config, int], Path]

    def changed(self, cfg: Visual, loss: Mapping[str, float]) -> Visual:
        """cfg with these weights. Raises UserError, with the nearest name, for a term that there is none of."""
        part = getattr(cfg, self.key)
        terms = asdict(part.loss)
        for term in loss:
            if term not in terms:
                raise UserError(f"{self.key}.loss has no term '{term}': {nearest(term, terms)}")
        return replace(cfg, **{self.key: replace(part, loss=replace(part.loss, **loss))})


def _unpaired(cfg: Config, seed: int) -> Path:
    """The generator to canonical pictures; the policy that judges is the one that both Q-functions begin as."""
    adapted = pipeline.adapt(replace(cfg, adapt=replace(cfg.adapt, policy=cfg.translate.q_function)), seed)
    if adapted.translator is None:
        raise UserError("adapt.way_back is false: expected true, the ablation is of translators")
    return adapted.translator


FAMILIES: Mapping[str, Family] = {
    "paired": Family("translate", pipeline.paired_translator),
    "unpaired": Family("adapt", _unpaired),
}


def family_of(cfg: AblationConfig) -> Family:
    """That of the job's variant. Raises UserError for one that there is none of."""
    name = cfg.definitions[cfg.variant].family
    if name not in FAMILIES:
        raise UserError(f"variant {cfg.variant}: no family '{name}', {nearest(name, FAMILIES)}")
    return FAMILIES[name]
