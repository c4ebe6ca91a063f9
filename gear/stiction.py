"""The joint decision: which contacts hold, and which let go, when several are at rest together.

Contacts are numbered k = 1..K. Each has a slip speed v_k and transmits one friction scalar s_k; with all
other forces known the slip accelerations are linear in the friction scalars:

    a = demand - G s            G: slip acceleration taken away per unit of friction, positive diagonal

A contact at rest has three possibilities, and all contacts at rest must find theirs together:

    holds           a_k = 0 and |s_k| <= static_k
    slips           s_k = +forward_k or -backward_k and a_k has that sign     (both <= static_k)
    holds, at limit a_k = 0 because others hold it, s_k = +-static_k  (only where contacts are redundant)

This is a complementarity problem with boxes. It is solved by an active-set method in a fixed number of
sweeps (so that it can be compiled and differentiated): first all contacts hold with their static limits;
whatever exceeds its limit and can move is broken loose, falls to its sliding limit, and the rest is asked
again. Contacts are redundant where several lock the same shafts (two bearings and the mesh between them);
their friction is then not unique, and the smallest friction that does the job (least squares, weighted by G)
is taken. Whether a contact holds is asked of the friction that it has in the run: the regularized problem takes a
little load off it, and a contact held for that would be overloaded in the run from the first moment on.

Where the load on redundant contacts turns round, the group lets go too early: a contact at its limit keeps its friction
there until the others have let go, though it would unload with them (two bearings of 0.2 and 1 N m, loaded to 1.15 N m,
let go at -0.8 N m, not at -1.2 N m).

References
----------
D. E. Stewart, "Rigid-body dynamics with friction and impact", SIAM Review 42 (2000), section 5;
M. Hintermueller, K. Ito, K. Kunisch, "The primal-dual active set strategy", SIAM J. Optim. 13 (2002).
"""

from collections.abc import Callable
from typing import NamedTuple

import casadi as ca

from gear.kinematics import factorize, substitute
from gear.quantities import Matrix

STUCK, FORWARD, BACKWARD, AT_LIMIT = 0, 1, -1, 2  # motion of a contact; AT_LIMIT is +2 or -2

REGULARIZATION = 1e-8  # of G where contacts are redundant; refined away, see `friction`
REFINEMENTS = 2  # each takes the leftover acceleration down by REGULARIZATION
INDEPENDENT = 1e-9  # a contact can slip by itself if the others leave this part of its own 1/inertia
SHARPER = 1e-12  # regularization where only that is asked, so that light shafts behind heavy ones are told from locked
RELEASED = 1 - 1e-6  # a contact that has just let go is not to hold again at the very same limit
ROUNDING = 1e-12  # of a limit: the same for the others, where a load is exactly at it
PATIENCE = 1e-6  # the same in late sweeps: rounding grows with the ratio of inertias, where many are at their limits
SHARED = 1e-5  # of a limit: redundant contacts may share their load as much otherwise than with the smallest friction


def friction(compliance: Matrix, demand: Matrix, held: Matrix, given: Matrix, redundant: bool) -> Matrix:
    """Friction scalars: those of `held` contacts from a = 0, the others as `given`.

    Parameters
    ----------
    compliance, demand : SX, (K, K) and (K, 1)
        G and the slip acceleration without any contact friction.
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


class RestProblem(NamedTuple):
    """What the joint decision is about; all (K, 1) except `compliance` (K, K)."""

    compliance: Matrix  # G
    demand: Matrix  # slip acceleration without contact friction
    static: Matrix  # friction limit at rest, >= 0
    forward: Matrix  # friction at the onset of sliding forward, 0 <= forward <= static
    backward: Matrix  # and backward
    rest: Matrix  # 1 where the slip speed is zero and the contact takes part in the decision
    given: Matrix  # friction scalar of the contacts that do not
    released: Matrix  # 1 where the contact has just let go


class Decision(NamedTuple):
    """`motion` per contact at rest (STUCK, +-1 slips, +-AT_LIMIT) and whether the sweeps agreed (else 1)."""

    motion: Matrix
    fault: Matrix


def decide(problem: RestProblem, redundant: bool) -> Decision:
    """Decide all contacts at rest together; see the module's text for the rules.

    The arguments may be SX or MX of the sizes given in `RestProblem`; the result is MX. `fault` is 1 where
    no consistent combination was found within the fixed number of sweeps.
    """
    count = problem.demand.shape[0]
    sweep = _sweep_function(count, redundant)
    status: Matrix = ca.MX.zeros(count)
    broken = problem.released
    sweeps = 8 * count + 2  # twice what physical trains were seen to need
    for number in range(sweeps):
        # every violator at once is fast; one at a time cannot cycle (K. G. Murty, 1974), so it comes last
        status, broken, motion, settled = sweep(status, broken, number > sweeps // 2, *problem)
    _, _, motion, settled = sweep(status, broken, True, *problem)
    return Decision(motion, 1 - settled)


def _sweep_function(count: int, redundant: bool) -> ca.Function:
    """One active-set sweep; `status` is 0 for holding and +-1 for at the limit in that direction."""
    vector = [ca.SX.sym(name, count) for name in ("status", "broken")]
    status, broken = vector
    single = ca.SX.sym("single")
    problem = RestProblem(
        ca.SX.sym("compliance", count, count),
        *(ca.SX.sym(name, count) for name in ("demand", "static", "forward", "backward", "rest", "given", "released")),
    )
    upper, lower = (ca.if_else(broken, onset, problem.static) for onset in (problem.forward, problem.backward))
    held = problem.rest * ca.eq(status, 0)
    given = ca.if_else(problem.rest, ca.if_else(status > 0, upper, -lower), problem.given)
    force = friction(problem.compliance, problem.demand, held, given, redundant)
    fresh = ca.if_else(problem.released, RELEASED, 1)
    exceeds = ca.if_else(force > fresh * upper, 1, ca.if_else(force < -fresh * lower, -1, 0))
    # what acceleration falls short by that part of the limit is no return, so that no contact is turned to and fro
    usual = ca.diag(problem.compliance) * ca.fabs(given)
    along = status * (problem.demand - problem.compliance @ force)
    patience = ca.if_else(single, PATIENCE, ROUNDING)
    returns = along < -(1 - fresh + patience) * usual
    can_slip = _can_slip(problem.compliance, held) if redundant else ca.SX.ones(count)
    if redundant:
        # what is locked has no acceleration that tells, but in the regularized problem, which has one solution
        shifted = problem.compliance * (1 + REGULARIZATION * ca.SX.eye(count))
        creep = status * (problem.demand - shifted @ friction(shifted, problem.demand, held, given, redundant=False))
        returns = ca.if_else(can_slip, returns, creep < -SHARED * REGULARIZATION * usual)
    stays = ca.if_else(returns, 0, status)
    proposal = problem.rest * ca.if_else(ca.eq(status, 0), exceeds, stays)

    first, found = [], 0
    for k in range(count):
        differs = ca.logic_not(ca.eq(proposal[k], status[k]))
        first.append(ca.if_else(ca.logic_and(single, found), status[k], proposal[k]))
        found = ca.logic_or(found, differs)
    settled = ca.logic_not(found)

    slips = ca.fabs(status) * can_slip
    loosened = ca.if_else(settled, ca.fmax(broken, slips), broken)
    motion = status * ca.if_else(slips, 1, AT_LIMIT)
    done = ca.logic_and(settled, ca.logic_not(ca.sum1(ca.fabs(loosened - broken))))
    return ca.Function(
        "sweep",
        [status, broken, single, *problem],
        [ca.vertcat(*first), loosened, motion, done],
        {"never_inline": True},
    )


def _can_slip(compliance: ca.SX, held: ca.SX) -> ca.SX:
    """1 for contacts that could move although all `held` ones hold (Schur complement of G)."""
    solve, result = _solver(compliance, held, SHARPER), []
    for k in range(compliance.shape[0]):
        column = compliance[:, k]
        taken = solve(held * column)
        for _ in range(REFINEMENTS):  # else SHARPER over the ratio of inertias would pass for a way to slip
            taken += solve(held * (column - compliance @ taken))
        left = compliance[k, k] - (compliance[k, :] * held.T) @ taken
        result.append(left > INDEPENDENT * compliance[k, k])
    return ca.vertcat(*result)
