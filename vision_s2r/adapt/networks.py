"""The networks of an adaptation, as they begin."""

from dataclasses import replace

import torch
from torch import nn

from vision_s2r.adapt.config import AdaptConfig
from vision_s2r.errors import UserError
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.grasp.forms import build, load_configuration
from vision_s2r.networks.unet import NetworkConfig, UNet
from vision_s2r.scene import CLASSES
from vision_s2r.training import checkpoint
from vision_s2r.translate.config import TranslateConfig
from vision_s2r.translate.rcan import heads_for


def generators(cfg: AdaptConfig, translate: TranslateConfig) -> dict[str, nn.Module]:
    """`to_real`, and where there is a way back `to_canonical`; as the identity, or as the translator it begins as."""
    maps = {"picture": 3} | ({"segmentation": len(CLASSES)} if cfg.loss.segmentation > 0 else {})
    found: dict[str, nn.Module] = {"to_real": UNet(cfg.network, maps)}
    if cfg.way_back:
        found["to_canonical"] = UNet(*to_canonical(cfg, translate))
        if cfg.translator:
            checkpoint.load(cfg.translator, "translator").restore("unet", found["to_canonical"])
    for network in found.values():
        network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    return found


def to_canonical(cfg: AdaptConfig, translate: TranslateConfig) -> tuple[NetworkConfig, dict[str, int]]:
    """Size and maps of the generator to canonical pictures: with pairs or a start a translator's, else its own."""
    if cfg.loss.paired or cfg.translator:
        return translate.network, heads_for(translate.loss)
    return cfg.network, {"canonical": 3}


def q_functions(cfg: AdaptConfig) -> dict[str, nn.Module]:
    """`q_canonical` and `q_real`, both as the policy of the configuration, behind a fresh front where there is one."""
    start = checkpoint.load(cfg.policy, "q_function")
    found: dict[str, nn.Module] = {}
    for name, policy in policies(cfg).items():
        found[name] = build(policy)
        own = found[name].state_dict().items()
        fresh = {f"q_function.{key}": value for key, value in own if key.startswith("front.")}
        replace(start, tensors=fresh | start.tensors).restore("q_function", found[name])
    return found


def policies(cfg: AdaptConfig) -> dict[str, GraspConfig]:
    """What each Q-function is: as the policy that both begin as, that of real pictures with the front.

    Raises UserError where that policy looks at anything but canonical pictures.
    """
    canonical = load_configuration(cfg.policy)
    if canonical.picture != "canonical" or canonical.with_source or canonical.front:
        raise UserError(f"{cfg.policy}: adapt.policy expects a policy that was trained on canonical pictures alone")
    return {"q_canonical": canonical, "q_real": replace(canonical, picture="seen", validate_on="seen", front=cfg.front)}
