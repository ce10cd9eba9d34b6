"""The terms that hold a scene's content in place while its look changes."""

from itertools import combinations

import torch
from torch import Tensor

Triple = tuple[Tensor, Tensor, Tensor]


def cycle(picture: Tensor, back: Tensor) -> Tensor:
    """Absolute error of a picture that went to the other domain and back (Zhu et al. 2017, arXiv:1703.10593)."""
    return (back - picture).abs().mean()


def scene_consistency(triples: list[Triple]) -> Tensor:
    """How far Q changes where only the look does: RL-scene consistency (Rao et al. 2020, arXiv:2006.09001).

    `triples`: logits [B, K] of the same grasps in a picture, its translation, and that translated back. The mean
    squared differences of the chances of success, of the three pairs of each triple.
    """
    chances = [[logits.float().sigmoid() for logits in triple] for triple in triples]
    pairs = [(a - b).square().mean() for triple in chances for a, b in combinations(triple, 2)]
    return torch.stack(pairs).sum()
