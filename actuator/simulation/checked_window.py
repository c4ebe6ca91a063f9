"""A window without ticks, run and checked: what the engine does about events that the integrator has missed.

An event fires only where a margin falls from positive to negative; a margin that is already negative is never seen
again. So every margin is looked at on every output point, and where one is negative the interval is run again in finer
steps until the violation is pinned down, and the modes are settled there. Intervals with more events than the log
holds are run again in finer steps too.
"""

from collections.abc import Callable

import numpy as np

from actuator.simulation.failures import explain_inconsistent_modes, explain_stop
from actuator.simulation.mode_code import LOG_SLOTS
from actuator.simulation.prepared import Prepared, called
from actuator.simulation.signals import Piece
from actuator.simulation.window import INTERVALS, VIOLATION
from actuator.simulation.window_points import Window, join

FINEST_WINDOW = 1e-7  # s; a window that fails at this length is a failure of the model


def checked_window(
    machine: Prepared, time: float, length: float, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]
) -> Window:
    """From `time` over `length` in at least INTERVALS output intervals, modes checked on every point."""

    def part(start: float, end: float, x: np.ndarray, m: np.ndarray) -> Window:
        return checked_window(machine, start, end - start, x, m, p, [piece.after(start - time) for piece in pieces])

    arguments = x, m, p, length, machine.form.coefficients(pieces)
    raw, failure = called(machine.window.best, arguments)
    if failure:
        if length / 2 < FINEST_WINDOW:
            # compiled code fails without a word; the interpreter knows why
            raise explain_stop(machine.system, time, m, called(machine.window.interpreted, arguments)[1] or failure)
        first = part(time, time + length / 2, x, m)
        return join([first, part(time + length / 2, time + length, *first.end)])

    states, modes, outputs, margins, log = raw
    count, times, codes = np.split(log, [1, 1 + LOG_SLOTS])
    grid = time + length * np.arange(INTERVALS + 1) / INTERVALS
    window = Window(grid, states, modes, outputs, margins, [], 0)
    missed = np.flatnonzero((margins < -VIOLATION).any(axis=0))
    good = int(missed[0]) - 1 if missed.size else INTERVALS
    events = []
    counts = np.diff(np.round(count[0])).astype(int)
    for k in np.flatnonzero(counts[: max(good, 0)]):
        if counts[k] > LOG_SLOTS:
            events += part(grid[k], grid[k + 1], states[:, k], modes[:, k]).events
        else:
            events += machine.logged(time, length, times[: counts[k], k + 1], codes[:, k + 1])
    window = Window(grid, states, modes, outputs, margins, events, 0)
    if good == INTERVALS:
        return window
    if good < 0 or length / INTERVALS < FINEST_WINDOW:
        return _settled(machine, window, good + 1, p, pieces, part)
    inner = part(grid[good], grid[good + 1], states[:, good], modes[:, good])
    parts = [window.until(good), inner]
    if good + 1 < INTERVALS:
        parts.append(part(grid[good + 1], time + length, *inner.end))
    return join(parts)


def _settled(machine: Prepared, window: Window, k: int, p: np.ndarray, pieces: list[Piece], part: Callable) -> Window:
    """A violation pinned down to point k: settle the modes there and go on."""
    time, x, m = window.time[k], window.states[:, k], window.modes[:, k]
    u = np.array([piece(time - window.time[0]) for piece in pieces])
    state, modes = machine.settle(time, x, m, u, p)
    if np.array_equal(modes, m):
        margins = machine.system.margins(state, modes, u, p).full().ravel()
        raise explain_inconsistent_modes(machine.system, time, modes, margins)
    head = window.until(k)._replace(events=[*window.events, (time, tuple(int(mode) for mode in modes))], settled=1)
    return join([head, part(time, window.time[-1], state, modes)])
