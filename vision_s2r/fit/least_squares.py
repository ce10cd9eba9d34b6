"""Linear least squares that always end.

By QR with pivoted columns (LAPACK's gelsy): the divide-and-conquer SVD behind `numpy.linalg.lstsq` does not converge on
some processors, for matrices that are as good as any.
"""

from typing import cast

import numpy as np
import scipy.linalg


def solved(matrix: np.ndarray, target: np.ndarray, rcond: float) -> np.ndarray:
    """The shortest x [D, ...] for which matrix [N, D] · x is nearest to target [N, ...].

    Directions of a condition beyond 1/rcond count as not seen.
    """
    if not matrix.size:
        return np.zeros((matrix.shape[1], *target.shape[1:]))
    found = scipy.linalg.lstsq(matrix, target, cond=rcond, lapack_driver="gelsy", check_finite=False)[0]
    return cast(np.ndarray, found)
