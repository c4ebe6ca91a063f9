"""The ladder of a mode: exp and phi_1..3 of L s for steps s that halve from rung to rung, each made when first needed.

    phi_0(z) = exp(z),  phi_k(z) = (phi_{k-1}(z) - 1/(k-1)!) / z

At the foot of the ladder, where L s is small, by Taylor; from there up by doubling:

    phi_0(2z) = phi_0^2                             phi_2(2z) = (phi_0 phi_2 + phi_1 + phi_2) / 4
    phi_1(2z) = (phi_0 phi_1 + phi_1) / 2           phi_3(2z) = (phi_0 phi_3 + phi_1/2 + phi_2 + phi_3) / 8

Ladders are kept with their modes and their L: a cycle comes back to the same dozen, and finds them made.

References
----------
M. Hochbruck, A. Ostermann, "Exponential integrators", Acta Numerica 19 (2010); N. J. Higham, "The scaling and squaring
method for the matrix exponential revisited", SIAM J. Matrix Anal. Appl. 26 (2005).
"""

import numpy as np

from actuator.engine.evaluate import jacobian, product, project_out_slip, projected
from actuator.engine.layout import (
    ARRIVED,
    BUILT,
    BUILT_RUNGS,
    CALM,
    CURVED,
    DERIVED,
    ENTERED,
    FIRST,
    FOOT,
    FRESH,
    L_NEW,
    LADDER,
    LADDER_MODES,
    LADDERS,
    MADE,
    MOVING,
    NORM,
    PHI,
    PREPARE,
    RUNG,
    RUNGS,
    SINCE,
    SIZES,
    SQUARE_B,
    STEPS,
    TOP,
    L,
    M,
    P,
    X,
)
from actuator.engine.memory import call, clear, copy, kernel, row, square, vec

SMALL = 0.5  # norm of L s at the foot, in balanced coordinates: twelve terms of the series reach rounding there
SWEEPS = 6  # of balancing; more change the norm by less than a rung
SAME_PART, SAME_SIZE = 0.02, 1e-6  # L of a ladder may differ by this part and size [1/s]: what is left is in N
MOVED = 1e-3  # part of an entry of L that makes another ladder worth building where a step fails
REBUILD_AFTER = 20  # steps: a ladder costs about as many
FIRST_ABOVE_FOOT = 8  # rung that is tried first with a new ladder: fast transients follow an event
TERMS = ((1e-5, 3), (1e-3, 4), (1e-2, 6), (0.1, 8), (np.inf, 11))  # of phi_3, by the norm of L s
FACTORIALS = (6.0, 24.0, 120.0, 720.0, 5040.0, 40320.0, 362880.0, 3628800.0, 39916800.0, 479001600.0, 6227020800.0)
LAST_FACTORIAL = 87178291200.0


@kernel
def phi(w, k, j):
    """phi_j of rung k of the present ladder, made by `rung` before."""
    return square(w, PHI, (w[LADDER] * (RUNGS + 3) + k) * 4 + j, w[MOVING])


@kernel
def linear_part(w):
    """L of the present ladder."""
    return square(w, L, w[LADDER], w[MOVING])


@kernel
def rung(w, k):
    """Make rung k of the present ladder, and those between it and the nearest one below that is there."""
    made, foot = row(w, BUILT_RUNGS, w[LADDER], RUNGS + 3), int(vec(w, FOOT)[w[LADDER]])
    low = k
    while low < foot and made[low] == 0.0:
        low += 1
    for q in range(low, k - 1, -1):
        if made[q] == 0.0:
            if q >= foot:
                taylor(w, q)
            else:
                double(w, q)
            made[q] = 1.0


@kernel
def taylor(w, k):
    """Rung k from the series of phi_3, then phi_{j-1} = 1/(j-1)! + z phi_j."""
    n, step = w[MOVING], vec(w, SIZES)[k]
    z, other, linear = square(w, SQUARE_B, 0, n), phi(w, k, 0), linear_part(w)
    size, terms = vec(w, NORM)[w[LADDER]] * step, 3
    for limit, count in TERMS:
        terms = count
        if size <= limit:
            break
    for j in range(n):
        for i in range(n):
            z[j, i] = linear[j, i] * step
    top = phi(w, k, 3)
    for j in range(n):
        clear(top[j])
        top[j, j] = 1 / (FACTORIALS[terms] if terms < len(FACTORIALS) else LAST_FACTORIAL)
    for term in range(terms - 1, -1, -1):
        product(w, z, top, other)
        for j in range(n):
            copy(top[j], other[j])
            top[j, j] += 1 / FACTORIALS[term]
    for j in range(2, -1, -1):
        lower = phi(w, k, j)
        product(w, z, phi(w, k, j + 1), lower)
        for i in range(n):
            lower[i, i] += 0.5 if j == 2 else 1.0  # noqa: PLR2004 - 1/2!


@kernel
def double(w, k):
    """Rung k from the one below."""
    n = w[MOVING]
    for j in range(4):
        product(w, phi(w, k + 1, 0), phi(w, k + 1, j), phi(w, k, j))
    one, two, three = phi(w, k + 1, 1), phi(w, k + 1, 2), phi(w, k + 1, 3)
    new_one, new_two, new_three = phi(w, k, 1), phi(w, k, 2), phi(w, k, 3)
    for j in range(n):
        for i in range(n):
            new_one[j, i] = (new_one[j, i] + one[j, i]) / 2
            new_two[j, i] = (new_two[j, i] + one[j, i] + two[j, i]) / 4
            new_three[j, i] = (new_three[j, i] + one[j, i] / 2 + two[j, i] + three[j, i]) / 8


@kernel
def balanced_norm(w, a, b):
    """The 1-norm of a in coordinates scaled such that its rows and columns weigh the same; b is overwritten."""
    n = w[MOVING]
    for j in range(n):
        copy(b[j], a[j])
    for _ in range(SWEEPS):
        for i in range(n):
            in_row = in_column = 0.0
            for j in range(n):
                if j != i:
                    in_column += abs(b[i, j])
                    in_row += abs(b[j, i])
            if in_row > 0.0 and in_column > 0.0:
                factor = np.sqrt(in_row / in_column)
                for j in range(n):
                    b[i, j] *= factor
                    b[j, i] /= factor
    norm = 0.0
    for j in range(n):
        total = 0.0
        for i in range(n):
            total += abs(b[j, i])
        norm = max(norm, total)
    return norm


@kernel
def begin_ladder(w, c):
    """Ladder c for L_NEW, with nothing made yet but the place of its foot."""
    n = w[MOVING]
    w[LADDER] = c
    w[BUILT] += 1
    w[CURVED] = 0
    w[SINCE] = w[STEPS]
    copy(row(w, L, c, n * n), vec(w, L_NEW))
    norm, foot, sizes = balanced_norm(w, square(w, L_NEW, 0, n), square(w, SQUARE_B, 0, n)), 0, vec(w, SIZES)
    while norm * sizes[foot] > SMALL and foot < RUNGS - 1:
        foot += 1
    vec(w, NORM)[c] = norm
    vec(w, FOOT)[c] = foot
    vec(w, CALM)[c] = 0.0
    vec(w, FIRST)[c] = max(w[TOP], foot - FIRST_ABOVE_FOOT)
    clear(row(w, BUILT_RUNGS, c, RUNGS + 3))


@kernel
def enter(w, t):
    """Into the present modes at the present state: numbers of the mode, projector, and a ladder, kept or new."""
    w[ENTERED] += 1
    w[FRESH] = 0
    w[ARRIVED] = 1
    w[CURVED] = 0
    call(w, PREPARE, (vec(w, P), vec(w, M), vec(w, DERIVED)))
    project_out_slip(w)
    projected(w, vec(w, X))
    n, modes = w[MOVING], vec(w, M)
    new = square(w, L_NEW, 0, n)
    jacobian(w, t, vec(w, X), new)
    for c in range(w[MADE]):
        kept, same = row(w, LADDER_MODES, c, modes.size), True
        for i in range(modes.size):
            same = same and kept[i] == modes[i]
        if same and alike(n, square(w, L, c, n), new):
            w[LADDER] = c
            w[RUNG] = int(vec(w, FIRST)[c])
            return
    c = w[MADE] if w[MADE] < LADDERS else w[ENTERED] % LADDERS
    w[MADE] = min(w[MADE] + 1, LADDERS)
    copy(row(w, LADDER_MODES, c, modes.size), modes)
    begin_ladder(w, c)
    w[RUNG] = int(vec(w, FIRST)[c])


@kernel
def alike(n, a, b):
    """Whether two linear parts differ by little."""
    for j in range(n):
        for i in range(n):
            if not abs(a[j, i] - b[j, i]) <= SAME_PART * abs(b[j, i]) + SAME_SIZE:
                return False
    return True


@kernel
def refresh(w, t):
    """Whether L has moved, and a ladder for it was begun; not again at once, as one costs as much as many steps."""
    if w[STEPS] - w[SINCE] < REBUILD_AFTER:
        return False
    n, moved = w[MOVING], False
    new, old = square(w, L_NEW, 0, n), linear_part(w)
    jacobian(w, t, vec(w, X), new)
    for j in range(n):
        for i in range(n):
            moved = moved or abs(new[j, i] - old[j, i]) > MOVED * abs(old[j, i])
    if moved:
        begin_ladder(w, w[LADDER])
    return moved
