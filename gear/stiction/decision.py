"""The joint decision: which contacts hold, and which let go, when several are at rest together.

At an instant some contacts have zero slip speed. With M the inertia of the shafts, f all torques but the friction of
these contacts, S their slip rows and T their torque rows,

    M a = f - T's        slip acceleration g = S a

each of them has three possibilities, and all must find theirs together:

    holds       g_i = 0   and |s_i| <= static_i
    slips       g_i > 0   and  s_i = forward_i
                g_i < 0   and  s_i = -backward_i           (both <= static_i)

A group holds exactly as long as any sharing of its load within the static limits exists, whatever was before: the
theorems of limit analysis. What cannot be held moves; it falls to its friction while sliding, and the others are asked
again, until nothing new moves. That is a decision for given limits each time, and the set of what moves only grows.
What was released and ends without slip is stuck again.

For given limits with T = S (bearings, meshes that stick by "conjugate speed") there is exactly one motion, the minimum
of a strictly convex function (`descent`). With T not S (stick by "mesh speed") there may be several, "all hold" among
them: that is asked for first, as nothing has moved yet, and else Lemke's path leads to one (`lemke`).

References
----------
D. E. Stewart, "Rigid-body dynamics with friction and impact", SIAM Review 42 (2000), section 5;
W. Prager, P. G. Hodge, "Theory of Perfectly Plastic Solids" (1951), limit analysis;
R. W. Cottle, J.-S. Pang, R. E. Stone, "The Linear Complementarity Problem" (1992).
"""

from typing import NamedTuple

import numpy as np

from gear.quantities import Matrix
from gear.stiction.descent import allowance, descend
from gear.stiction.elimination import applied, compiled, product, reduce, remaining
from gear.stiction.lemke import follow_path

STUCK, FORWARD, BACKWARD = 0, 1, -1  # motion of a contact
EASED = 1e-6  # part taken off the limits of contacts whose breakaway is the event: above the error of locating that
BALANCED = 1e-11  # part of all limits by which a load may exceed what friction can hold
NO_LIMIT = 1e-12  # part of the largest limit, as torque on a shaft, below which there is no friction


class RestProblem(NamedTuple):
    """What the joint decision is about, for K contacts and n independent shafts: numbers, or expressions."""

    inertia: Matrix  # (n, n)
    load: Matrix  # (n, 1): all torques, with the friction of the contacts that are not at rest
    slip: Matrix  # (K, n): slip speed per speed of each shaft
    torque: Matrix  # (K, n): torque against each shaft per unit of friction
    static: Matrix  # (K, 1): friction limit at rest, >= 0
    forward: Matrix  # (K, 1): friction at the onset of sliding forward, 0 <= forward <= static
    backward: Matrix  # (K, 1): and backward
    rest: Matrix  # (K, 1): 1 where the slip speed is zero and the contact takes part
    released: Matrix  # (K, 1): 1 where it has just let go


class Decision(NamedTuple):
    """Which contacts hold, and which way the others go."""

    motion: np.ndarray  # (K,): 0 stuck, +-1 slips; of contacts that are not at rest 0
    friction: np.ndarray  # (K,): some friction with which it is consistent
    fault: int  # 1 where no consistent motion was found


def decide(problem: RestProblem) -> Decision:
    """Decide all contacts at rest together; see the module's text for the rules."""
    arrays = [np.ascontiguousarray(value, float) for value in problem]
    count = len(arrays[2])
    arrays[4:] = [array.reshape(count) for array in arrays[4:]]
    motion, friction = np.zeros(count), np.zeros(count)
    fault = decide_contacts(arrays[0], arrays[1].reshape(-1), *arrays[2:], motion, friction)
    return Decision(motion.astype(int), friction, int(fault))


@compiled
def decide_contacts(
    inertia: np.ndarray,
    load: np.ndarray,
    slip: np.ndarray,
    torque: np.ndarray,
    static: np.ndarray,
    forward: np.ndarray,
    backward: np.ndarray,
    rest: np.ndarray,
    released: np.ndarray,
    motion: np.ndarray,
    friction: np.ndarray,
) -> int:
    """As `decide`, on arrays: fills `motion` and `friction`, returns the fault."""
    motion[:], friction[:] = 0.0, 0.0
    count = 0
    for k in range(len(rest)):
        count += rest[k] != 0.0
    if count == 0:
        return 0
    chosen = np.flatnonzero(rest)
    rubs, most = np.zeros(len(rest), np.bool_), 0.0
    for _ in range(2):  # limits that are rounding beside those of the others are none
        for k in chosen:
            size = np.max(np.abs(torque[k])) * static[k]
            most, rubs[k] = max(most, size), size > NO_LIMIT * most
    let_go = released[chosen] != 0.0
    eased = np.where(rubs[chosen], np.where(let_go, 1.0 - EASED, 1.0), 0.0)
    upper, lower = forward[chosen] * eased, backward[chosen] * eased
    moved, forces, fault = _decide(
        inertia, load, slip[chosen], torque[chosen], static[chosen] * rubs[chosen], upper, lower, let_go
    )
    motion[chosen], friction[chosen] = moved, forces
    return fault


@compiled
def _decide(
    inertia: np.ndarray,
    load: np.ndarray,
    slip: np.ndarray,
    torque: np.ndarray,
    static: np.ndarray,
    forward: np.ndarray,
    backward: np.ndarray,
    broken: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, int]:
    count = len(static)
    motion, friction = np.zeros(count), np.zeros(count)
    symmetric = np.all(slip == torque)
    small = 2.0 * allowance(torque, load, static)
    upper, lower = np.where(broken, forward, static), -np.where(broken, backward, static)
    if not symmetric and _all_hold(inertia, load, slip, torque, lower, upper, friction):
        return motion, friction, 0
    while True:
        free = np.zeros(count, np.bool_)
        friction[:] = 0.0
        if not symmetric and follow_path(inertia, load, slip, torque, lower, upper, free, friction) < 0:
            return motion, friction, 1
        # with T not S, this takes the rounding out of the end of the path
        steps, slips, ease = descend(inertia, load, slip, torque, lower, upper, free, friction)
        if steps < 0:
            return motion, friction, 1
        anew = False
        for i in range(count):
            # exactly at its limit, and nothing pulls
            motion[i] = 0.0 if abs(slips[i]) <= small[i] * ease[i] else np.sign(slips[i])
            if motion[i] != 0.0 and not broken[i]:
                broken[i], upper[i], lower[i], anew = True, forward[i], -backward[i], True
        if not anew:
            return motion, friction, 0


@compiled
def _all_hold(
    inertia: np.ndarray,
    load: np.ndarray,
    slip: np.ndarray,
    torque: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    friction: np.ndarray,
) -> bool:
    """Whether friction within the limits leaves all without slip: it must balance the load but for what Z lets move.

    Y spans what is across the momentum M Z of the motions that are left; Y'T's = Y'f is asked for by least squares.
    """
    count, n = len(upper), len(load)
    table, pivots = reduce(slip, np.ones(count, np.bool_))
    momentum = product(inertia, remaining(table, pivots)).T.copy()
    table, pivots = reduce(momentum, np.ones(len(momentum), np.bool_))
    across = remaining(table, pivots)
    rows, push = product(torque, across), applied(across.T, load)
    free = np.zeros(count, np.bool_)
    if descend(np.eye(n - len(momentum)), push, rows, rows, lower, upper, free, friction)[0] < 0:
        return False
    left = push - applied(rows.T, friction)
    reach = applied(np.abs(rows.T), upper - lower)
    return bool(np.all(np.abs(left) <= BALANCED * reach))


@compiled
def decide_vector(problem: np.ndarray, shafts: int, motion: np.ndarray) -> int:
    """As `decide`, for a problem as one vector, as `problem_vector` makes it: fills `motion`, returns the fault."""
    n, count = shafts, len(motion)
    rows = n * n + n
    vectors = problem[rows + 2 * count * n :].reshape((5, count))
    return decide_contacts(
        problem[: n * n].reshape((n, n)),
        problem[n * n : rows],
        problem[rows : rows + count * n].reshape((count, n)),
        problem[rows + count * n : rows + 2 * count * n].reshape((count, n)),
        vectors[0],
        vectors[1],
        vectors[2],
        vectors[3],
        vectors[4],
        motion,
        np.empty(count),
    )
