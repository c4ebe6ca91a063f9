"""Gaussian elimination on small matrices of expressions; zeros that are known stay zeros."""

import casadi as ca

from gear.quantities import Matrix

Lower = dict[tuple[int, int], ca.SX]


def factorize(rows: list[list[Matrix]]) -> tuple[Lower, list[list[Matrix]]]:
    """LU factors without pivoting, for matrices whose principal minors are positive."""
    rows, lower = [list(row) for row in rows], {}
    for pivot in range(len(rows)):
        for i in range(pivot + 1, len(rows)):
            if not ca.SX(rows[i][pivot]).is_zero():
                lower[i, pivot] = rows[i][pivot] / rows[pivot][pivot]
                for j in range(pivot + 1, len(rows)):
                    rows[i][j] = rows[i][j] - lower[i, pivot] * rows[pivot][j]
    return lower, rows


def substitute(lower: Lower, upper: list[list[Matrix]], right: list[Matrix]) -> list[Matrix]:
    """Solution of the factorized system for one right side."""
    solution = list(right)
    for i in range(len(solution)):
        for j in range(i):
            if (i, j) in lower:
                solution[i] = solution[i] - lower[i, j] * solution[j]
    for i in reversed(range(len(solution))):
        for j in range(i + 1, len(solution)):
            solution[i] = solution[i] - upper[i][j] * solution[j]
        solution[i] = solution[i] / upper[i][i]
    return solution
