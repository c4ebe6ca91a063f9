"""One period of a cycle: the event at which it is best cut, and the segments up to the same event of the next one."""

from collections.abc import Sequence

import numpy as np

from actuator.orbits.cut_motion import cut_motion
from actuator.orbits.flow import FlowMap, NoOrbit
from actuator.orbits.segments import Segment, passage
from actuator.simulation.failures import SimulationError

RETURNS = 1.3  # periods in which a cycle must return
LATE = 0.25  # part of the period by which a return may be early or late


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
        raise NoOrbit(f"{machine.system.name}: no event in {period:.6g} s; a cycle without any is a linear oscillation")
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
