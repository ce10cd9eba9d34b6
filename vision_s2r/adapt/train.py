"""From views and recorded pictures to a translator and a policy."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from vision_s2r.adapt.config import AdaptConfig, check
from vision_s2r.adapt.method import KIND, LABELS, Adaptation
from vision_s2r.errors import UserError
from vision_s2r.render.seen import Recorded
from vision_s2r.training import Inputs, checkpoint, train
from vision_s2r.training.data import require, require_alike
from vision_s2r.translate.config import TranslateConfig
from vision_s2r.translate.pairs import needed
from vision_s2r.translate.rcan import depth_range
from vision_s2r.translate.translator import network_of

TRAINING = ("canonical", "segmentation", "depth", *LABELS)
VALIDATION = ("canonical", "real", "segmentation", *LABELS)


@dataclass(frozen=True)
class Adapted:
    """Released checkpoints: the policy for real pictures, and the translator to canonical ones if there is one."""

    policy: Path
    translator: Path | None


def train_adapted(
    cfg: AdaptConfig, inputs: Inputs, recorded: Recorded, translate: TranslateConfig, out: Path, seed: int
) -> Adapted:
    """Trains in the folder `out`, or goes on there, and releases what came of it.

    The views have labelled canonical pictures, `recorded` real pictures of other scenes. `translate` and the first
    camera are of the pairs, where they count; the validation camera chooses the checkpoint. Raises UserError where
    configuration, views and checkpoints do not fit, and as `vision_s2r.training.train`.
    """
    check(cfg)
    if cfg.translator:
        translate = replace(translate, network=network_of(cfg.translator))
    views, validation = inputs.views, inputs.validation
    stride = 2 ** max(cfg.network.levels, translate.network.levels)
    if views.size % stride or recorded.size != views.size:
        raise UserError(
            f"views of {views.size} px, recorded pictures of {recorded.size} px: expected the same multiple of {stride}"
        )
    pairs = (*needed(translate), "randomized") if cfg.loss.paired > 0 else ()
    for part, source, names in (("training", views, (*TRAINING, *pairs)), ("validation", validation, VALIDATION)):
        require(part, source, names)
    require_alike(views, validation, sources=cfg.loss.paired > 0)
    method = partial(Adaptation, cfg, translate, recorded, inputs.cameras, validation.margin, depth_range(views))
    return _release(train(method, views, validation, cfg.training, out, seed).best, cfg)


def _release(path: Path, cfg: AdaptConfig) -> Adapted:
    """What other programs load, taken out of the checkpoint of all of it, beside it."""
    found = checkpoint.load(path, KIND)
    known = found.configuration
    cameras = {name: known[name] for name in ("camera", "validation_camera")}
    policy = path.with_name("policy.safetensors")
    _save(policy, found, "q_function", {"q_real": "q_function"}, known["policy"] | cameras)
    if not cfg.way_back:
        return Adapted(policy, None)
    translator = path.with_name("translator.safetensors")
    network = {"network": known["network"], "heads": known["heads"]}
    _save(translator, found, "translator", {"to_canonical": "unet"}, network | cameras)
    return Adapted(policy, translator)


def _save(
    path: Path, found: checkpoint.Checkpoint, kind: str, names: dict[str, str], configuration: dict[str, Any]
) -> None:
    """A checkpoint of some of its networks, under other names; left as it is where it has been released before."""
    if path.exists() and path.stat().st_mtime_ns > found.path.stat().st_mtime_ns:
        return
    tensors = {}
    for key, value in found.tensors.items():
        network, _, rest = key.partition(".")
        if network in names:
            tensors[f"{names[network]}.{rest}"] = value
    checkpoint.save(
        path, checkpoint.Checkpoint(kind, configuration, found.normalization, found.training, tensors, path)
    )
