"""The friction of contacts at rest between given limits, by descent: exact, however many contacts lock the same thing.

With friction that acts along the speed it stops (T = S), s minimizes 1/2 (f - S's)' M^-1 (f - S's) in the box of its
limits. An active set lowers that at every step and stays in the box: the contact whose slip acceleration points the
wrong way most is let in, and friction goes towards what keeps all those from slipping, up to the first limit. What the
others lock has no slip acceleration and never comes in, so that redundancy costs nothing.

Where T is not S there is no minimum, and a step need not lead on; the same steps then only take out the rounding of
what another method has found.
"""

import numpy as np

from gear.stiction.elimination import applied, compiled, is_locked, mobility, reactions, reduce, remaining

ROUNDING = 1e-12  # of a contact's limit, as friction
LOAD_ROUNDING = 1e-15  # of the load of a contact's shafts, the same
MOST_ROUNDING = 1e4  # times that is taken for rounding in the end, where rounding turns contacts to and fro


@compiled
def allowance(torque: np.ndarray, load: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Friction per contact that is rounding."""
    result = ROUNDING * limit
    for i in range(len(limit)):
        loaded, size = 0.0, 0.0
        for j in range(len(load)):
            loaded += abs(torque[i, j] * load[j])
            size += torque[i, j] ** 2
        result[i] += LOAD_ROUNDING * loaded / size
    return result


@compiled
def pushed(load: np.ndarray, torque: np.ndarray, friction: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Torques on the shafts without those of the free contacts."""
    push = load.copy()
    for i in range(len(free)):
        if not free[i] and friction[i] != 0.0:
            for j in range(len(load)):
                push[j] -= torque[i, j] * friction[i]
    return push


@compiled
def slip_accelerations(
    slip: np.ndarray, torque: np.ndarray, motions: np.ndarray, mobile: np.ndarray, shafts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Of all contacts, and the slip acceleration that their own friction takes per unit; zeros where locked."""
    slips, ease = np.zeros(len(slip)), np.zeros(len(slip))
    for i in range(len(slip)):
        if not is_locked(slip[i], motions):
            for j in range(len(shafts)):
                slips[i] += slip[i, j] * shafts[j]
                for k in range(len(shafts)):
                    ease[i] += slip[i, j] * mobile[j, k] * torque[i, k]
    return slips, ease


@compiled
def descend(
    inertia: np.ndarray,
    load: np.ndarray,
    slip: np.ndarray,
    torque: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    free: np.ndarray,
    friction: np.ndarray,
) -> tuple[int, np.ndarray, np.ndarray]:
    """Change `free` and `friction` until they are a decision for these limits.

    Free contacts hold, and the others are at one of their limits or touch nothing that moves. Returns how many steps
    that took, -1 for no end; the slip acceleration of every contact; what its own friction takes of it per unit.
    """
    count, steps = len(lower), 0
    small = allowance(torque, load, upper - lower)
    symmetric = np.all(slip == torque)
    while True:
        table, pivots = reduce(slip, free)
        motions = across = remaining(table, pivots)
        if not symmetric:
            table, pivots = reduce(torque, free)
            across = remaining(table, pivots)
        mobile, push = mobility(inertia, motions, across), pushed(load, torque, friction, free)
        shafts = applied(mobile, push)
        # as far as the box allows towards what keeps all free ones from slipping
        target = reactions(torque, pivots, free, push - applied(inertia, shafts))
        first, room = -1, 1.0
        for i in range(count):
            if free[i]:
                if not np.isfinite(target[i]):
                    return -1, target, target
                end = min(max(target[i], lower[i]), upper[i])
                if end != target[i]:
                    part = max((end - friction[i]) / (target[i] - friction[i]), 0.0)
                    if part < room or first < 0:
                        first, room = i, part
        for i in range(count):
            if free[i]:
                friction[i] = min(max(friction[i] + room * (target[i] - friction[i]), lower[i]), upper[i])
        if first >= 0:
            friction[first] = lower[first] if target[first] < lower[first] else upper[first]
            free[first] = False
            steps += 1
            continue
        # rounding that turns contacts to and fro is given up step by step
        patience = 10.0 ** (steps // (6 * count + 6))
        if patience > MOST_ROUNDING:
            return -1, target, target
        slips, ease = slip_accelerations(slip, torque, motions, mobile, shafts)
        worst, most = -1, 0.0
        for i in range(count):
            if free[i] or upper[i] <= lower[i] or ease[i] <= 0.0 or abs(slips[i]) <= patience * small[i] * ease[i]:
                continue
            right = friction[i] == (upper[i] if slips[i] > 0.0 else lower[i])
            if not right and slips[i] ** 2 / ease[i] > most:
                worst, most = i, slips[i] ** 2 / ease[i]
        if worst < 0:
            return steps, slips, ease
        free[worst] = True
        steps += 1
