"""How scenes scatter the statistics, which is the noise of the comparison, and what no simulator gets exactly right."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import ndtr, stdtrit

from vision_s2r.fit.unpaired.summary import Statistic

RELATIVE = 0.04  # of a statistic's shift, that a simulated camera may be wrong by
ABSOLUTE = 0.02  # the same of a logarithm or slope, of any statistic
_RARE = 4.0  # deviations
OF_TONE = 0.5 / 255  # the same of a coded brightness


@dataclass(frozen=True)
class Scatter:
    """A covariance of the statistics of one picture; distances in it are standard deviations."""

    deviation: np.ndarray  # [K]
    root: np.ndarray  # [K, K] lower Cholesky factor

    def whitened(self, differences: np.ndarray) -> np.ndarray:
        """Differences of statistics [..., K] in independent standard deviations."""
        flat = np.atleast_2d(differences)
        return solve_triangular(self.root, flat.T, lower=True).T.reshape(np.shape(differences))


def scatter(real: np.ndarray, simulated: np.ndarray, wrong: np.ndarray, worth: float) -> Scatter:
    """From the statistics of both sets [N, K] about their own means.

    `wrong` [K, K] is the covariance of what the sets' means may differ by under a perfect diagnosis. It counts as often
    as the comparison is `worth` pictures: averaging does not lessen it. Correlations are shrunk towards none (Schaefer
    and Strimmer 2005, Stat. Appl. Genet. Mol. Biol. 4:32). What is known from few pictures is widened until four
    deviations are as rare as they are by Student's distribution.
    """
    centred = np.concatenate([real - real.mean(0), simulated - simulated.mean(0)])
    freedom = len(centred) - 2
    deviation = np.sqrt((centred**2).sum(0) / freedom) + 1e-9
    scaled = centred / deviation
    products = scaled[:, :, None] * scaled[:, None, :]
    correlation = products.sum(0) / freedom
    variance = products.var(0) * len(centred) / freedom**2
    off = ~np.eye(len(correlation), dtype=bool)
    shrinkage = min(max(variance[off].sum() / max((correlation[off] ** 2).sum(), 1e-9), 0.02), 1.0)
    shrunk = np.where(off, correlation * (1 - shrinkage), 1.0)
    rare = float(stdtrit(max(freedom, 3), ndtr(_RARE))) / _RARE
    covariance = shrunk * np.outer(deviation, deviation) * rare**2 + wrong * worth
    return Scatter(np.sqrt(np.diag(covariance)), np.linalg.cholesky(covariance))


def tolerance(statistics: tuple[Statistic, ...], shift: np.ndarray) -> np.ndarray:
    """Variance [K] of what a simulated camera gets wrong, of statistics that its effects shift by `shift` [K]."""
    absolute = [OF_TONE if "quantile" in each.label else ABSOLUTE for each in statistics]
    return np.array(absolute) ** 2 + (RELATIVE * shift) ** 2
