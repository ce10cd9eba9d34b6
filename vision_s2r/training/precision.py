"""In which arithmetic networks are trained, where the machine is to choose."""

import torch

from vision_s2r.training.config import TrainingConfig

# What processors that multiply bfloat16 themselves call it; others take 2 to 3 times as long for it as for float32.
OWN_BFLOAT16 = ("amx_bf16", "avx512_bf16", "bf16")


def resolved(cfg: TrainingConfig) -> str:
    """`cfg.precision` in Lightning Fabric's words, `auto` decided for the device that its accelerator stands for."""
    found = torch.accelerator.current_accelerator(check_available=True)
    device = torch.device("cpu") if cfg.accelerator == "cpu" or found is None else found
    return "bf16-mixed" if is_mixed(cfg, device) else "32-true"


def is_mixed(cfg: TrainingConfig, device: torch.device) -> bool:
    """Whether convolutions and matrix products are done in bfloat16 on a device."""
    return cfg.precision == "bf16-mixed" or (cfg.precision == "auto" and _multiplies_bfloat16(device))


def _multiplies_bfloat16(device: torch.device) -> bool:
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    return device.type == "cpu" and any(torch.cpu.get_capabilities().get(name, False) for name in OWN_BFLOAT16)
