"""Lemke's path for bounded variables: the friction of contacts whose friction does not act along the speed it stops.

Meshes that stick by "mesh speed" have slip rows S and torque rows T that differ, and nothing is a minimum. Within a box
there is a decision all the same (a continuous map of a compact convex set into itself), and Lemke's path leads to one:
an offset theta c on the slip accelerations, large enough that every contact slips its own way, is taken down to zero.

References
----------
R. W. Cottle, J.-S. Pang, R. E. Stone, "The Linear Complementarity Problem" (1992), sections 4.4 and 4.8.
"""

import numpy as np

from gear.stiction.elimination import applied, compiled, is_locked, product, reduce, remaining, solve

UNLIKE = 0.6180339887498949  # multiples of it, less whole numbers, make weights of which no two tie


@compiled
def follow_path(
    inertia: np.ndarray,
    load: np.ndarray,
    slip: np.ndarray,
    torque: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    free: np.ndarray,
    friction: np.ndarray,
) -> int:
    """Fill `free` and `friction` with a decision for these limits: how many pivots that took, -1 for no end.

    What the free contacts lock has a slip acceleration of theta times a constant; it is zero at the end only, and left
    out of the ratio test by its geometry.
    """
    count = len(lower)
    columns = np.empty((len(load), count + 1))
    columns[:, :count], columns[:, count] = torque.T, load
    answer = product(slip, solve(inertia, columns))
    unit = np.empty(count)
    for i in range(count):
        unit[i] = 1.0 / np.sqrt(answer[i, i])
    matrix, demand = np.empty((count, count)), answer[:, count] * unit
    for i in range(count):
        for j in range(count):
            matrix[i, j] = answer[i, j] * unit[i] * unit[j]
    low, high = lower / unit, upper / unit
    side, scaled, offset, cover = np.ones(count), np.zeros(count), np.zeros(count), np.zeros(count)
    driver, most = 0, -np.inf
    for i in range(count):
        side[i] = 1.0 if demand[i] >= 0.0 else -1.0
        scaled[i] = high[i] if side[i] > 0.0 else low[i]
        reach = 0.0
        for j in range(count):
            reach += abs(matrix[i, j]) * max(high[j], -low[j])
        cover[i] = 1.0 + 0.5 * ((i + 1) * UNLIKE % 1.0)
        offset[i] = side[i] * cover[i] * (abs(demand[i]) + reach)
    slips = demand - applied(matrix, scaled)
    for i in range(count):
        short = -side[i] * slips[i] / abs(offset[i]) if offset[i] != 0.0 else -np.inf
        if short > most:
            driver, most = i, short
    free[:] = False
    inward, pivots = True, 0
    while most > 0.0:
        pivots += 1
        if pivots > 30 * count + 30:
            return -1
        # the vertex, and where it goes as the friction (inward) or the slip acceleration (else) of the driver moves
        inner = np.flatnonzero(free)
        size = len(inner) + 1
        rows = np.append(inner, driver)
        basis, right, fixed = np.zeros((size, size)), np.zeros((size, 2)), np.where(free, 0.0, scaled)
        base = demand - applied(matrix, fixed)
        for a in range(size):
            for b in range(size - 1):
                basis[a, b] = matrix[rows[a], inner[b]]
            basis[a, size - 1] = -offset[rows[a]]
            right[a, 0] = base[rows[a]]
            right[a, 1] = (
                matrix[rows[a], driver] * side[driver] if inward else (-side[driver] if a == size - 1 else 0.0)
            )
        found = solve(basis, right)
        rates = np.zeros(count)
        for a in range(size - 1):
            scaled[inner[a]], rates[inner[a]] = found[a, 0], found[a, 1]
        theta, falls = found[size - 1, 0], found[size - 1, 1]
        if inward:
            rates[driver] = -side[driver]
        slips = demand + theta * offset - applied(matrix, scaled)
        slip_rates = falls * offset - applied(matrix, rates)
        moving = free.copy()
        moving[driver] = moving[driver] or inward
        table, pivot_shafts = reduce(slip, moving)
        motions = remaining(table, pivot_shafts)
        leaver, room = -1, np.inf
        for i in range(count):
            part = np.inf
            if moving[i] and rates[i] > 0.0:
                part = (high[i] - scaled[i]) / rates[i]
            elif moving[i] and rates[i] < 0.0:
                part = (low[i] - scaled[i]) / rates[i]
            elif not moving[i] and i != driver and side[i] * slip_rates[i] < 0.0 and not is_locked(slip[i], motions):
                part = -slips[i] / slip_rates[i]
            part = max(part, 0.0)
            if part < room:
                leaver, room = i, part
        free[:] = moving
        if falls < 0.0 and theta <= -falls * room:
            break
        if leaver < 0:
            return -1
        inward = not moving[leaver]
        if moving[leaver]:
            free[leaver] = False
            side[leaver] = 1.0 if rates[leaver] > 0.0 else -1.0
            scaled[leaver] = high[leaver] if rates[leaver] > 0.0 else low[leaver]
        driver = leaver
    for i in range(count):
        friction[i] = 0.0 if free[i] else (upper[i] if side[i] > 0.0 else lower[i])
    return pivots
