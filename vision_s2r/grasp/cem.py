"""The cross-entropy method over grasps, batched over scenes.

As QT-Opt (Kalashnikov et al. 2018, arXiv:1806.10293): score samples, keep the best tenth, sample around them. The
distribution is a mixture with a Gaussian on each elite: a bin holds several objects, and the mean of their grasps
is none. Widths shrink by a fixed factor.
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor

from vision_s2r.grasp.config import CemConfig
from vision_s2r.grasp.geometry import wrap

Score = Callable[[Tensor], Tensor]  # grasps float32 [B, K, 3] to values [B, K]


def maximize(
    score: Score, seeds: list[int], area: list[float], cfg: CemConfig, device: torch.device
) -> tuple[Tensor, Tensor]:
    """The best grasps [B, 3] found, and their values [B], one for each seed.

    The first samples are uniform over |x| ≤ area[0], |y| ≤ area[1] (m) and all yaws. What a scene is asked is a
    function of its own seed and scores alone. The result is the best of everything that was scored.
    """
    uniform, normal = _noise(seeds, cfg, device)
    half = torch.tensor([*area, math.pi / 2], device=device)
    spread = torch.tensor([cfg.position_spread, cfg.position_spread, cfg.yaw_spread], device=device)
    elites = max(1, round(cfg.elites * cfg.samples))
    grasps = (2 * uniform - 1) * half
    values = score(grasps)
    for noise in normal:
        centres = _take(grasps, values.topk(min(elites, values.shape[1]), dim=1).indices)
        repeats = -(-cfg.samples // centres.shape[1])
        drawn = centres.repeat(1, repeats, 1)[:, : cfg.samples] + noise * spread
        position = torch.minimum(torch.maximum(drawn[..., :2], -half[:2]), half[:2])
        drawn = torch.cat([position, wrap(drawn[..., 2:])], -1)
        grasps, values = torch.cat([grasps, drawn], 1), torch.cat([values, score(drawn)], 1)
        spread = spread * cfg.shrink
    best, index = values.max(1)
    return _take(grasps, index[:, None])[:, 0], best


def _noise(seeds: list[int], cfg: CemConfig, device: torch.device) -> tuple[Tensor, Tensor]:
    """Each scene's own random numbers: uniform [B, K, 3], normal [iterations - 1, B, K, 3]."""
    uniform, normal = [], []
    for seed in seeds:
        generator = torch.Generator().manual_seed(seed)
        uniform.append(torch.rand(cfg.samples, 3, generator=generator))
        normal.append(torch.randn(cfg.iterations - 1, cfg.samples, 3, generator=generator))
    return torch.stack(uniform).to(device), torch.stack(normal, 1).to(device)


def _take(grasps: Tensor, indices: Tensor) -> Tensor:
    """[B, N, 3]: in each scene the grasps of these indices [B, N]."""
    return grasps.gather(1, indices[..., None].expand(-1, -1, 3))
