"""Loops for tools that work with polynomials: without poles that do not show and poles that are too fast to matter."""

import math

import control
import numpy as np
from scipy.linalg import hessenberg, matrix_balance, schur, solve_sylvester

from actuator.linear.margins.response import GRID, NOTHING, LoopResponse

HIDDEN = 1e-10 * 0.1 ** np.arange(7)  # parts of the model by which a state may be moved, or seen, by rounding
SAME, SLOW = 1e-2, 1e-2  # part of the response that may change above SLOW [rad/s] by what is left out
PASSED = 0.5  # largest loop gain at which fast poles may be taken together
COARSE = 20  # of the points of the grid, every so many are compared
FAINT = 1e-3  # part of the loop at `fastest` of which the fast poles are left out


def reduce_order(loop: control.StateSpace, fastest: float | None = None) -> control.StateSpace:
    """A loop with the same response up to a frequency and fewer states, for root loci.

    States that the input does not move or the output does not see, but for rounding, are left out as long as the
    response above 0.01 rad/s stays that of the loop to 1 %: integrators below that may not be kept. Poles faster than
    `fastest` become one lag at that frequency with their gain at standstill, or nothing where that is nothing.

    Tools that turn a model into polynomials (`control.root_locus_map`, `control.sisotool`, `control.tf`) need both: the
    coefficients of poles from 0 to 1e6 rad/s have no correct digits, and what rounding leaves of them are zeros that do
    not exist, to which the locus goes. What is left out is stable, or `fastest` is refused, but for what the loop does
    not show: whether the actuator is stable, `margins` of the whole loop knows.

    Parameters
    ----------
    loop : control.StateSpace
        With one input and one output, from `loop_transfer`.
    fastest : float or None
        [rad/s], in continuous time; None keeps all poles that show.

    Raises
    ------
    ValueError
        Where the loop gain beyond `fastest` is more than one half, as the poles there decide too, or where one of them
        is unstable; and for `fastest` in discrete time, where a fast pole is a delay.

    References
    ----------
    Rosenbrock, "State-space and Multivariable Theory", 1970 (the staircase).
    Kokotovic, Khalil, O'Reilly, "Singular Perturbation Methods in Control", 1986 (fast poles).
    """
    response = LoopResponse(loop)
    balanced, transform = matrix_balance(response.a, permute=False)
    a, b, c = np.asarray(balanced), np.linalg.solve(transform, response.b), response.c @ transform
    if fastest is not None:
        _require_slow_crossover(response, fastest)
        a, b, c = _slow_part(a, b, c, fastest, FAINT * abs(response(fastest)))
    whole = control.StateSpace(
        a, b, c, response.d, loop.dt, inputs=loop.input_labels, outputs=loop.output_labels, remove_useless_states=False
    )
    return next(
        (shown for shown in (_minimal(whole, hidden) for hidden in HIDDEN) if _same_response(shown, whole)), whole
    )


def _minimal(loop: control.StateSpace, hidden: float) -> control.StateSpace:
    """The part of a loop that the input moves and the output sees."""
    a, b, c = (np.asarray(part) for part in (loop.A, loop.B, loop.C))
    a, c, b = (part.T for part in _reachable(a.T, c.T, b.T, hidden))
    a, b, c = _reachable(a, b, c, hidden)
    return control.StateSpace(
        a, b, c, loop.D, loop.dt, inputs=loop.input_labels, outputs=loop.output_labels, remove_useless_states=False
    )


def _same_response(shown: control.StateSpace, whole: control.StateSpace) -> bool:
    """Whether two loops have the same response, where there is one beyond doubt."""
    response = LoopResponse(whole)
    frequencies = GRID[::COARSE][GRID[::COARSE] > SLOW]
    if response.step:
        frequencies = frequencies[frequencies < math.pi / response.step]
    values, doubts = response.values(frequencies)
    found, _ = LoopResponse(shown).values(frequencies)
    return bool((abs(found - values) <= SAME * abs(values) + doubts + NOTHING).all())


def _require_slow_crossover(response: LoopResponse, fastest: float) -> None:
    """Raise ValueError where poles faster than this decide about stability too."""
    if response.step:
        raise ValueError(f"reduce_order: fastest={fastest:.6g} rad/s is for loops in continuous time; leave it out")
    beyond = np.append(fastest, GRID[fastest < GRID])
    sizes = abs(response.values(beyond)[0])
    if sizes.max() > PASSED:
        raise ValueError(
            f"reduce_order: the loop gain is {sizes.max():.3g} beyond fastest={fastest:.6g} rad/s, where it must be "
            f"at most {PASSED} for slower poles to decide alone; choose it above {beyond[sizes > PASSED][-1]:.6g} rad/s"
        )


def _slow_part(a: np.ndarray, b: np.ndarray, c: np.ndarray, fastest: float, faint: float) -> tuple[np.ndarray, ...]:
    """The part with the slow poles, and a lag with the gain of the others at standstill."""

    def is_slow(real: float, imaginary: float) -> bool:
        return bool(np.hypot(real, imaginary) <= fastest)

    triangle, base, count = schur(a, output="real", sort=is_slow)  # pyright: ignore[reportAssignmentType] - stubs of two answers
    slow, fast, corner = triangle[:count, :count], triangle[count:, count:], triangle[:count, count:]
    if len(fast) and np.linalg.eigvals(fast).real.max() >= 0:
        raise ValueError(
            f"reduce_order: a pole faster than fastest={fastest:.6g} rad/s is unstable; choose it beyond that"
        )
    b, c = base.T @ b, c @ base
    coupling = np.asarray(solve_sylvester(slow, -fast, -corner))
    b_slow, c_slow, c_fast = b[:count] - coupling @ b[count:], c[:, :count], c[:, count:] + c[:, :count] @ coupling
    gain = -c_fast @ np.linalg.solve(fast, b[count:])
    if abs(gain.item()) <= faint:
        return slow, b_slow, c_slow
    side = np.zeros((count, 1))
    lagged = np.block([[slow, side], [side.T, np.full((1, 1), -fastest)]])
    return lagged, np.vstack([b_slow, [[fastest]]]), np.hstack([c_slow, gain])


def _reachable(a: np.ndarray, b: np.ndarray, c: np.ndarray, hidden: float) -> tuple[np.ndarray, ...]:
    """The part that the input moves: a staircase from the input on, up to the first step that is rounding."""
    n = len(a)
    if not b.any() or not c.any():
        return np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))
    bordered = np.zeros((n + 1, n + 1))
    bordered[1:, :1], bordered[1:, 1:] = b / np.linalg.norm(b), a
    stairs, base = hessenberg(bordered, calc_q=True)
    steps = abs(np.diag(stairs, -1))[1:]
    small = np.flatnonzero(steps <= hidden * np.linalg.norm(a, 2))
    kept = int(small[0]) + 1 if len(small) else n
    driven = np.zeros((kept, 1))
    driven[0] = stairs[1, 0] * np.linalg.norm(b)
    seen = c @ base[1:, 1 : kept + 1]
    # exactly zero where it is rounding: a response that falls faster than 1/s has no zero at 1e12 rad/s
    seen[0, : int((abs(seen[0]) > hidden * abs(seen).max()).argmax())] = 0
    return np.triu(stairs[1 : kept + 1, 1 : kept + 1], -1), driven, seen
