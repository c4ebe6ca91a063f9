"""Elimination on small dense matrices, compiled: geometry first, inertia after.

Light shafts beside heavy ones spoil the matrix S M^-1 S' by (ratio of inertias) x 1e-16. So what stuck contacts leave
to move is found from their slip rows alone, and the inertia is only seen by what is left.
"""

from collections.abc import Callable

import numba
import numpy as np

STRUCTURE = 1e-9  # part of a row that must be left for it to be independent


def compiled(function: Callable) -> Callable:
    """The function as machine code, kept on disk where that can be written."""
    options = {"nogil": True, "error_model": "numpy"}
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no place for the cache
        return numba.njit(**options)(function)


@compiled
def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A b, of two matrices."""
    result = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            if a[i, k] != 0.0:
                for j in range(b.shape[1]):
                    result[i, j] += a[i, k] * b[k, j]
    return result


@compiled
def applied(a: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A x, of a matrix and a vector."""
    result = np.zeros(a.shape[0])
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            result[i] += a[i, k] * x[k]
    return result


@compiled
def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """X of matrix X = right, by elimination; each pivot is the largest of its column, over the size of its row."""
    n, m = right.shape
    a, x, size = matrix.copy(), right.copy(), np.zeros(len(right))
    for i in range(n):
        for j in range(n):
            size[i] = max(size[i], abs(a[i, j]))
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) * size[best] > abs(a[best, k]) * size[i]:
                best = i
        if best != k:
            for j in range(n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
            for j in range(m):
                x[k, j], x[best, j] = x[best, j], x[k, j]
            size[k], size[best] = size[best], size[k]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
                for j in range(m):
                    x[i, j] -= factor * x[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(m):
            for i in range(k + 1, n):
                x[k, j] -= a[k, i] * x[i, j]
            x[k, j] /= a[k, k]
    return x


@compiled
def reduce(rows: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The chosen rows solved for one shaft each, with complete pivoting: (reduced rows, pivot shafts).

    Each reduced row is one at its pivot, and zero at the pivots of the others; rows that others imply are left out.
    """
    n, count = rows.shape[1], 0
    table = np.zeros((rows.shape[0], n))
    for i in range(rows.shape[0]):
        if chosen[i]:
            size = 0.0
            for j in range(n):
                size = max(size, abs(rows[i, j]))
            for j in range(n):
                table[count, j] = rows[i, j] / size if size > 0.0 else 0.0
            count += 1
    pivots, taken = np.zeros(min(count, n), np.int64), np.zeros(n, np.bool_)
    rank = 0
    while rank < min(count, n):
        best, at, column = STRUCTURE, -1, -1
        for i in range(rank, count):
            for j in range(n):
                if not taken[j] and abs(table[i, j]) > best:
                    best, at, column = abs(table[i, j]), i, j
        if at < 0:
            break
        for j in range(n):
            table[rank, j], table[at, j] = table[at, j], table[rank, j]
        factor = table[rank, column]
        for j in range(n):
            table[rank, j] /= factor
        for i in range(count):
            factor = table[i, column]
            if i != rank and factor != 0.0:
                for j in range(n):
                    table[i, j] -= factor * table[rank, j]
                table[i, column] = 0.0
        pivots[rank], taken[column] = column, True
        rank += 1
    return table[:rank], pivots[:rank]


@compiled
def remaining(table: np.ndarray, pivots: np.ndarray) -> np.ndarray:
    """Z: columns span the motions in which none of the reduced rows slips; entries that are known are exact."""
    rank, n = table.shape
    motions, column = np.zeros((n, n - rank)), 0
    for j in range(n):
        dependent = False
        for k in range(rank):
            dependent |= pivots[k] == j
        if not dependent:
            motions[j, column] = 1.0
            for k in range(rank):
                motions[pivots[k], column] = -table[k, j]
            column += 1
    return motions


@compiled
def is_locked(row: np.ndarray, motions: np.ndarray) -> bool:
    """Whether a row slips in none of these motions, by geometry alone."""
    size = 0.0
    for j in range(len(row)):
        size = max(size, abs(row[j]))
    for k in range(motions.shape[1]):
        slip = 0.0
        for j in range(len(row)):
            slip += row[j] * motions[j, k]
        if abs(slip) > STRUCTURE * size:
            return False
    return True


@compiled
def mobility(inertia: np.ndarray, motions: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """P: accelerations P f of the shafts from torques f, within `motions`, where friction acts across `torques`.

    P = Z (Y' M Z)^-1 Y', with Y the motions on which the friction of what holds does no work.
    """
    if motions.shape[1] == 0:
        return np.zeros(inertia.shape)
    within = product(torques.T, product(inertia, motions))
    return product(motions, solve(within, torques.T.copy()))


@compiled
def reactions(torque: np.ndarray, pivots: np.ndarray, chosen: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Friction of the chosen contacts that brings the torques `residual`, by those on the pivot shafts."""
    result, count = np.zeros(len(chosen)), 0
    for i in range(len(chosen)):
        count += chosen[i]
    if len(pivots) < count:
        result[:] = np.nan  # their rows are not independent
    elif count > 0:
        matrix, right = np.empty((count, count)), np.empty((count, 1))
        for k in range(count):
            column = 0
            for i in range(len(chosen)):
                if chosen[i]:
                    matrix[k, column] = torque[i, pivots[k]]
                    column += 1
            right[k, 0] = residual[pivots[k]]
        found = solve(matrix, right)
        column = 0
        for i in range(len(chosen)):
            if chosen[i]:
                result[i] = found[column, 0]
                column += 1
    return result
