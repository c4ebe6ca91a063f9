"""Newton's method closes an orbit: a fixed point of the return map, in one arc or in several.

P(x) - x = 0        P: from just after an event of the cycle to just after the same event of the next one

The period is cut at the event that ends its longest mode; of the closed orbit the margins are checked and the
multipliers found.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from actuator.orbits.flow import FlowMap, NoOrbit, along
from actuator.orbits.orbit import Orbit
from actuator.orbits.segments import Passage, Segment, cut_motion, passage
from actuator.simulation.failures import SimulationError

RETURNS = 1.3  # periods in which a cycle must return
LATE = 0.25  # part of the period by which a return may be early or late
# residual over nominal sizes (1e-4 rad for an angle) above which nothing is an orbit; stiff teeth between absolute
# angles leave breakaway times uncertain by rounding: it falls to 1e-11 in a simple mechanism, to 1e-6 in a stiff one
CLOSED = 3e-5
FINISHED = 1e-11  # at which more steps are not tried
VIOLATED = 1e-6  # a margin below minus this contradicts the modes
NEWTON_STEPS = 12
NEAR = 1e-2  # residual below which derivatives are not worked out again
GROWN = 10.0  # factor by which a residual may grow in a step
SEQUENCES = 6  # how often the events of the cycle may turn out to be others than guessed


def find_return(
    machine: FlowMap, x: np.ndarray, m: tuple[int, ...], u: np.ndarray, p: np.ndarray, period: float
) -> tuple[np.ndarray, tuple[int, ...]]:
    """State and modes after the event that ends the longest mode of one period: what follows starts from rest."""
    pieces, states = _cut(machine, x, m, u, p, 3 * period)
    lasted, began, best = 0.0, 0.0, (0.0, -1)
    for k, (piece, state) in enumerate(zip(pieces, states, strict=True)):
        lasted += piece.duration
        began += piece.duration
        if state is not None:
            if period < began < RETURNS * 2 * period and lasted > best[0]:
                best = lasted, k
            lasted = 0.0
    if best[1] < 0 or best[1] + 1 >= len(pieces):
        raise NoOrbit(
            f"{machine.system.name}: no event in {period:.6g} s; a cycle without any is linear, or one with "
            "friction that never sticks, and is not found here"
        )
    state = states[best[1]]
    assert state is not None
    return state, pieces[best[1] + 1].modes


def _cut(
    machine: FlowMap, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray, duration: float
) -> tuple[list[Segment], list[np.ndarray | None]]:
    try:
        return cut_motion(machine, x, m, u, p, duration)
    except SimulationError as error:
        raise NoOrbit(f"{machine.system.name}: the motion of the cycle cannot be followed: {error}") from error


def one_period(
    machine: FlowMap, x: np.ndarray, m: tuple[int, ...], u: np.ndarray, p: np.ndarray, period: float
) -> list[Segment]:
    """Segments from a state after an event to the next return to the same modes by the same event, near the period.

    Raises
    ------
    NoOrbit
        Where the motion does not return.
    """
    pieces, states = _cut(machine, x, m, u, p, RETURNS * period)
    time, returns = 0.0, []
    modes = [*(piece.modes for piece in pieces[1:]), None]
    for k, (piece, state) in enumerate(zip(pieces, states, strict=True)):
        time += piece.duration
        # the modes after the last event are those of no piece; a return there counts with the state it leaves
        if state is not None and (modes[k] == m or (modes[k] is None)) and abs(time - period) < LATE * period:
            distance = float(np.max(abs(state - x) / machine.nominal))
            returns.append((distance, k))
    for _, k in sorted(returns):
        if passage(machine, x, pieces[: k + 1], u, p).modes == m:
            return pieces[: k + 1]
    raise NoOrbit(
        f"{machine.system.name}: the motion does not return to its modes {m} within {1 - LATE:g} to {1 + LATE:g} times "
        f"the period of {period:.6g} s"
    )


def build_orbit(
    machine: FlowMap, x: np.ndarray, u: np.ndarray, p: np.ndarray, passages: list[Passage], residual: float
) -> Orbit:
    """The orbit of closed passages, its margins checked and its multipliers found."""
    segments = tuple(segment for arc in passages for segment in arc.segments)
    starts = tuple(start for arc in passages for start in arc.starts)
    for k, (segment, start) in enumerate(zip(segments, starts, strict=True)):
        _hold(machine, segment, start, u, p, k)
    # in one go: in the product of the arcs' own matrices, fast slips would cancel to nothing
    whole = passage(machine, x, segments, u, p, np.eye(x.size))
    scale = machine.nominal
    multipliers = np.linalg.eigvals(whole.fixed_time * scale / scale[:, None])
    trivial = int(np.argmin(abs(multipliers - 1)))
    others = np.delete(multipliers, trivial).astype(complex)
    return Orbit(
        system=machine.system,
        u=u,
        p=p,
        period=float(sum(segment.duration for segment in segments)),
        x0=x,
        segments=segments,
        starts=starts,
        residual=residual,
        multipliers=others[np.argsort(-abs(others))],
        trivial=complex(multipliers[trivial]),
        map=machine,
    )


def _hold(machine: FlowMap, segment: Segment, start: np.ndarray, u: np.ndarray, p: np.ndarray, k: int) -> None:
    """Raise where a margin does not hold during a segment."""
    system, states = machine.system, machine.path(start, segment.modes, u, p, segment.duration)
    margins = along(system.margins, states, segment.modes, u, p)
    if segment.fired < machine.events:
        margins[segment.fired, -1] = 0.0  # it ends the segment: zero but for the error of these states
    if margins.size and margins.min() < -VIOLATED:
        row, column = np.unravel_index(margins.argmin(), margins.shape)
        raise NoOrbit(
            f"{system.name}: on the closed orbit {system.margin_names[row]} does not hold in segment {k}: its margin "
            f"is {margins.min():.3g} of its usual size {machine.grid[column] * segment.duration:.3g} s after its start"
        )


def close(
    machine: FlowMap,
    x: np.ndarray,
    m: tuple[int, ...],
    u: np.ndarray,
    p: np.ndarray,
    period: float,
    *,
    segments: int = 1,
) -> Orbit:
    """The orbit through the neighborhood of a state after an event, by Newton's method.

    Raises
    ------
    NoOrbit
        With the residual, or the margin that is violated.
    """
    residuals: list[float] = []
    reason = ""
    for _ in range(SEQUENCES):
        pieces = one_period(machine, x, m, u, p, period)
        arcs = _arcs(pieces, segments)
        starts, passages = [], []
        for arc in arcs:
            starts.append(passages[-1].end if passages else x)
            passages.append(passage(machine, starts[-1], arc, u, p, np.eye(x.size)))
        best: tuple[float, list[np.ndarray], list[Passage]] = np.inf, starts, passages
        try:
            for _ in range(NEWTON_STEPS):
                starts = _newton_step(machine, starts, passages)
                passages = [
                    _repeat(machine, start, arc, u, p, fresh=best[0] > NEAR)
                    for start, arc in zip(starts, passages, strict=True)
                ]
                ends = [arc.end for arc in passages]
                gaps = [(a - b) / machine.nominal for a, b in zip(ends, [*starts[1:], starts[0]], strict=True)]
                residuals.append(float(np.abs(gaps).max()))
                improves = residuals[-1] < best[0] / 2
                if residuals[-1] < best[0]:
                    best = residuals[-1], starts, passages
                if best[0] < FINISHED or (best[0] < CLOSED and not improves):
                    return build_orbit(machine, best[1][0], u, p, best[2], best[0])
                if residuals[-1] > GROWN * best[0]:
                    break
        except NoOrbit as error:  # the events of the cycle are others than those of its first guess
            reason = f"; {error}"
        x, period = starts[0], sum(arc.duration for arc in passages)
    raise NoOrbit(
        f"{machine.system.name}: Newton's method did not close the orbit; the residuals over nominal sizes are "
        f"{', '.join(f'{residual:.3g}' for residual in residuals)} with a period of {period:.6g} s{reason}"
    )


def _arcs(pieces: list[Segment], count: int) -> list[list[Segment]]:
    """The pieces in `count` groups of about the same number."""
    if not 1 <= count <= len(pieces):
        raise ValueError(f"segments must be 1 to {len(pieces)} on this orbit, got {count}")
    edges = [round(len(pieces) * k / count) for k in range(count + 1)]
    return [pieces[a:b] for a, b in itertools.pairwise(edges)]


def _repeat(machine: FlowMap, x: np.ndarray, arc: Passage, u: np.ndarray, p: np.ndarray, *, fresh: bool) -> Passage:
    """The same passage from another start, with derivatives of its own or those it had."""
    found = passage(machine, x, arc.segments, u, p, np.eye(x.size) if fresh else None)
    return found if fresh else found._replace(moved=arc.moved, delayed=arc.delayed)


def _newton_step(machine: FlowMap, starts: list[np.ndarray], passages: list[Passage]) -> list[np.ndarray]:
    """Start states of all arcs such that, to first order, each arc ends where the next one begins."""
    n, count, scale = starts[0].size, len(starts), machine.nominal
    matrix, defect = np.zeros((n * count, n * count)), np.zeros(n * count)
    for k, arc in enumerate(passages):
        rows, following = slice(n * k, n * k + n), (k + 1) % count
        matrix[rows, n * k : n * k + n] += arc.moved / scale[:, None] * scale
        matrix[rows, n * following : n * following + n] -= np.eye(n)
        defect[rows] = (arc.end - starts[following]) / scale
    step = np.linalg.lstsq(matrix, -defect, rcond=1e-13)[0].reshape(count, n) * scale
    return [start + change for start, change in zip(starts, step, strict=True)]
