"""Newton's method closes an orbit: a fixed point of the return map, in one arc or in several.

P(x) - x = 0        P: from just after an event of the cycle to just after the same event of the next one
"""

import itertools

import numpy as np

from actuator.orbits.closed_orbit import CLOSED, FINISHED, finished
from actuator.orbits.flow import FlowMap, NoOrbit
from actuator.orbits.one_period import one_period
from actuator.orbits.orbit import Orbit
from actuator.orbits.segments import Passage, Segment, passage

NEWTON_STEPS = 12
NEAR = 1e-2  # residual below which derivatives are not worked out again
GROWN = 10.0  # factor by which a residual may grow in a step
SEQUENCES = 6  # how often the events of the cycle may turn out to be others than guessed


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
                    _again(machine, start, arc, u, p, fresh=best[0] > NEAR)
                    for start, arc in zip(starts, passages, strict=True)
                ]
                ends = [arc.end for arc in passages]
                gaps = [(a - b) / machine.nominal for a, b in zip(ends, [*starts[1:], starts[0]], strict=True)]
                residuals.append(float(np.abs(gaps).max()))
                improves = residuals[-1] < best[0] / 2
                if residuals[-1] < best[0]:
                    best = residuals[-1], starts, passages
                if best[0] < FINISHED or (best[0] < CLOSED and not improves):
                    return finished(machine, best[1][0], u, p, best[2], best[0])
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


def _again(machine: FlowMap, x: np.ndarray, arc: Passage, u: np.ndarray, p: np.ndarray, *, fresh: bool) -> Passage:
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
