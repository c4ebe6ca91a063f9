"""Whether the poles of a model are stable, and how far rounding may have moved each of them."""

import math

import numpy as np
from scipy.linalg import eig, matrix_balance


def room(a: np.ndarray, *, discrete: bool) -> float:
    """How far within the boundary of stability the poles are, each moved there by what may be its rounding.

        n eps |A| / |y x|,    at most sqrt(n eps) |A|

    is what errors of n eps in the balanced matrix make of a simple pole with left and right eigenvectors y and x of
    length one, and of a double one. Negative where one is unstable beyond doubt; [1/s], or of |z| in discrete time.

    References
    ----------
    Golub, Van Loan, "Matrix Computations", 4th edition, 2013, section 7.2.2 (condition of an eigenvalue).
    """
    if not len(a):
        return math.inf
    balanced = np.asarray(matrix_balance(a, permute=False)[0])
    poles, left, right = eig(balanced, left=True, right=True)  # pyright: ignore[reportAssignmentType] - stubs of three answers
    size, error = np.linalg.norm(balanced, 2), len(a) * np.finfo(float).eps
    aligned = abs((left.conj() * right).sum(axis=0))
    moved = size * error / np.maximum(aligned, math.sqrt(error))
    beyond = abs(poles) - 1 if discrete else np.real(poles)
    return float((moved - beyond).min())
