"""How well scores of grasps foretell their labels."""

import torch
import torch.nn.functional as F
from torch import Tensor


def measure(logits: Tensor, success: Tensor) -> dict[str, float]:
    """Metrics of logits [N, G] against labels [N, G] (0, 1) of N scenes with G attempts each.

    `bce`: binary cross-entropy, nats. `auc`: area under the ROC curve, the chance that a success is scored above a
    failure. `best_of_scene`: of the scenes with a success among their attempts, the part in which the best-scored
    attempt is one. The last two are 0.5 and 0 where the labels leave them undefined.
    """
    bce = F.binary_cross_entropy_with_logits(logits.double(), success.double())
    solvable = success.any(1)
    best = success.gather(1, logits.argmax(1, keepdim=True))[:, 0]
    return {
        "bce": float(bce),
        "auc": _auc(logits.flatten(), success.flatten().bool()),
        "best_of_scene": float(best[solvable].float().mean()) if solvable.any() else 0.0,
    }


def _auc(scores: Tensor, positive: Tensor) -> float:
    """By ranks (Mann and Whitney 1947), ties shared."""
    count = int(positive.sum())
    pairs = count * (len(scores) - count)
    if not pairs:
        return 0.5
    from scipy.stats import rankdata  # half a second, which whoever only grasps does not wait for

    ranks = torch.from_numpy(rankdata(scores.double().numpy()))
    return float((ranks[positive].sum() - count * (count + 1) / 2) / pairs)
