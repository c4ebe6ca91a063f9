"""The friction of contacts that are known to hold, and what they leave to move, as expressions."""

from collections.abc import Callable, Sequence

import casadi as ca

from gear.kinematics import Row, factorize, substitute
from gear.quantities import Matrix
from gear.stiction.elimination import STRUCTURE

REGULARIZATION = 1e-8  # of G where contacts are redundant; refined away, see `friction`
OVER = 1e-9  # part of a limit by which a share may exceed it for rounding
UNBALANCED = 1e-7  # part of the limits
NO_STIFFNESS = 1e-12  # part of a diagonal entry that is none, of a semidefinite matrix
REFINEMENTS = 2  # each takes the leftover acceleration down by REGULARIZATION


def friction(compliance: Matrix, demand: Matrix, held: Matrix, given: Matrix, redundant: bool) -> Matrix:
    """Friction scalars: those of `held` contacts from a = 0, the others as `given`.

    Parameters
    ----------
    compliance, demand : SX, (K, K) and (K, 1)
        Slip acceleration a = demand - compliance s: G, and a without any contact friction.
    held, given : SX, (K, 1)
        1 where the contact holds, else 0; friction scalar where it does not hold.
    redundant : bool
        Whether held contacts may lock the same shafts. G is then singular; it is regularized, which gives
        the smallest friction, and the error in the acceleration is taken out again by refinement.
    """
    solve = _solver(compliance, held, REGULARIZATION if redundant else 0.0)
    solution = solve(ca.if_else(held, demand, given))
    for _ in range(REFINEMENTS if redundant else 0):
        solution += solve(held * (demand - compliance @ solution))
    return solution


def _solver(compliance: Matrix, held: Matrix, shift: float) -> Callable[[Matrix], Matrix]:
    """Solves G s = right for the held contacts, with G's diagonal larger by `shift`; the others are as on the right."""
    count = compliance.shape[0]
    lower, upper = factorize(
        [
            [
                ca.if_else(held[i], compliance[i, j] * (1 + shift if i == j else 1), 1.0 if i == j else 0.0)
                for j in range(count)
            ]
            for i in range(count)
        ]
    )
    return lambda right: ca.vertcat(*substitute(lower, upper, ca.vertsplit(right)))


def smallest_sharing(torque: Matrix, scalar: Matrix, held: Matrix, limit: Matrix, spare: int) -> Matrix:
    """The friction that is shown of contacts which hold together: the same torques with the least sum of s^2 / limit.

    Contacts that lock the same thing carry equal parts of their limits. What would exceed its limit is at it, the worst
    first, and the others share the rest.

    Parameters
    ----------
    torque : SX, (K, n)
        Torque per unit of friction.
    scalar, held, limit : SX, (K, 1)
        Some friction that holds; 1 where a contact holds; friction limit at rest.
    spare : int
        By how many the contacts are more than what they lock.
    """
    shafts, pinned = torque.shape[1], ca.SX.zeros(scalar.shape[0])
    parts = []
    for _ in range(2 * spare + 2):  # Newton's method on the dual: s = limit * part, cut at +-1, part = T y
        weight = held * ca.eq(pinned, 0) * limit
        load = torque.T @ (held * (scalar - limit * pinned))
        part = torque @ _semidefinite_solution(torque.T @ (ca.repmat(weight, 1, shafts) * torque), load)
        parts.append(part)
        over = ca.if_else(held, ca.fabs(part), 0)
        new = ca.logic_and(over > 1 + OVER, over >= ca.mmax(ca.if_else(pinned, 0, over)))
        pinned = ca.if_else(ca.logic_or(new, ca.logic_and(ca.fabs(pinned), over > 1)), ca.sign(part), 0)
    shared, wanted = held * limit * ca.fmin(ca.fmax(parts[-1], -1), 1), torque.T @ (held * scalar)
    # of a thousand sharings near their limits four do not settle; the torques are right all the same
    left = ca.fabs(wanted - torque.T @ shared) > UNBALANCED * (ca.fabs(torque.T) @ (held * limit))
    return ca.if_else(held, ca.if_else(ca.sum1(left) > 0, limit * parts[0], shared), scalar)


def _semidefinite_solution(matrix: Matrix, right: Matrix) -> Matrix:
    """Some solution of a consistent system with a positive semidefinite matrix; what it leaves open is zero."""
    count = matrix.shape[0]
    rows = [[matrix[i, j] for j in range(count)] + [right[i]] for i in range(count)]
    for k in range(count):
        kept = rows[k][k] > NO_STIFFNESS * matrix[k, k]
        pivot = ca.if_else(kept, rows[k][k], 1)
        rows[k] = [
            ca.if_else(kept, entry / pivot, float(j == k)) * (1 if j < count else kept)
            for j, entry in enumerate(rows[k])
        ]
        for i in range(k + 1, count):
            factor = rows[i][k]
            rows[i] = [a - factor * b if j > k else a for j, (a, b) in enumerate(zip(rows[i], rows[k], strict=True))]
    for k in reversed(range(count)):
        for i in range(k):
            rows[i][count] -= rows[i][k] * rows[k][count]
    return ca.vertcat(*(row[count] for row in rows))


def motion_without_slip(slip: Sequence[Row], held: Matrix, shafts: Sequence[str]) -> Matrix:
    """Z, (n, n): takes the motion of the shafts to one in which no held contact slips, and leaves such a one as it is.

    One shaft per independent held contact follows the others, by elimination on the slip rows; so what holds has a slip
    of zero by construction, and where nothing is left to move Z is exactly zero.
    """
    count = len(shafts)
    motion = [[ca.SX(float(s == j)) for j in range(count)] for s in range(count)]
    for k, row in enumerate(slip):
        known = [(shafts.index(shaft), c) for shaft, c in row.items()]
        left = [sum((c * motion[s][j] for s, c in known), ca.SX(0)) for j in range(count)]
        places = [j for j in range(count) if not left[j].is_zero()]
        largest, chosen = ca.SX(0), {}
        for j in places:  # the shaft with the most to say follows
            more = ca.fabs(left[j]) > largest
            chosen = {i: ca.logic_and(flag, ca.logic_not(more)) for i, flag in chosen.items()} | {j: more}
            largest = ca.fmax(largest, ca.fabs(left[j]))
        if not places:
            continue
        independent = ca.logic_and(held[k], largest > STRUCTURE * sum(ca.fabs(c) for _, c in known))
        pivot = ca.if_else(independent, sum(chosen[j] * left[j] for j in places), 1)
        for s in range(count):
            taken = independent * sum((chosen[j] * motion[s][j] for j in places), ca.SX(0))
            for j in places:
                motion[s][j] -= taken * (left[j] / pivot)
    return ca.vertcat(*(ca.horzcat(*entries) for entries in motion))
