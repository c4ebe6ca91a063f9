"""A window of ticks of sampled controllers, run and checked: as many of them as went well."""

import math

import numpy as np

from actuator.simulation.mode_code import LOG_SLOTS
from actuator.simulation.prepared import Prepared, called
from actuator.simulation.signals import Piece
from actuator.simulation.window import VIOLATION
from actuator.simulation.window_points import Window


def ticks_that_hold(
    machine: Prepared, first: int, count: int, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]
) -> tuple[int, Window]:
    """As many of `count` ticks as went well, and their window."""
    fine, stride, period = machine.options.fine, machine.options.stride, machine.system.tick_period(p)
    none = np.empty((0, 0))
    nothing = 0, Window(none, none, none, none, none, [], 0)
    due = machine.system.due(first + np.arange(machine.count))
    due[:, count:] = -1
    results, failure = called(machine.ticks.best, (x, m, p, due, period, machine.form.coefficients(pieces)))
    if failure:
        return nothing
    *seen, log, faults, ends, end_modes = results
    counts, times, codes = np.split(log.reshape(-1, fine + 1, machine.count, order="F"), [1, 1 + LOG_SLOTS])
    happened = np.diff(np.round(counts[0]), axis=0).astype(int)  # (fine, ticks)
    bad = (faults[0] > 0) | (happened > LOG_SLOTS).any(axis=0)
    # a margin that is negative at an output point became so in the ticks before it
    below = np.flatnonzero((seen[-1] < -VIOLATION).any(axis=0))
    if below.size:
        bad[max((below[0] - 1) // fine * stride, 0) :] = True
    good = int(np.argmax(bad[:count])) if bad[:count].any() else count
    if not good:
        return nothing
    starts, points = (first + np.arange(good)) * period, math.ceil(good / stride) * fine
    u = np.array([piece(good * period) for piece in pieces])
    state, mode = ends[:, good - 1], end_modes[:, good - 1]
    end = [
        state,
        mode,
        *(f(state, mode, u, p).full().ravel() for f in (machine.system.outputs_function, machine.system.margins)),
    ]
    if (end[-1] < -VIOLATION).any():
        return nothing
    present = codes[: machine.code.size]
    before = np.concatenate([machine.code.packed(m)[:, None], present[:, -1, : good - 1]], axis=1)
    # codes are whole numbers
    jumps = np.abs(present[:, 0, :good] - before).max(axis=0, initial=0.0) > 0.5  # noqa: PLR2004
    events: list[tuple[float, tuple[int, ...]]] = []
    for k in np.flatnonzero(jumps | happened[:, :good].any(axis=0)):
        if jumps[k]:
            events.append((starts[k], machine.code.words(present[:, 0, k])))
        for i in np.flatnonzero(happened[:, k]):
            events += machine.logged(starts[k], period, times[: happened[i, k], i + 1, k], codes[:, i + 1, k])
    grid = np.append((starts[::stride, None] + period * np.arange(fine) / fine).ravel(), (first + good) * period)
    state, mode, output, margin = (
        np.column_stack([array[:, :points], last]) for array, last in zip(seen, end, strict=True)
    )
    return good, Window(grid, state, mode, output, margin, events, 0)
