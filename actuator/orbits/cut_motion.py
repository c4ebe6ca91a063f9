"""A motion as the engine runs it, cut into smooth segments at its events and at the corners of its flow."""

import itertools
from collections.abc import Sequence

import numpy as np

from actuator.orbits.flow import GRID, FlowMap, NoOrbit, along
from actuator.orbits.segments import Segment, passage
from actuator.simulation.engine import engine
from actuator.simulation.prepared import EngineOptions
from actuator.simulation.signals import Piece

TOUCHES = 0.02  # part of its value one output point earlier; below it a corner is met with the event, not before
LINGERS = 1e-4, 1e-3  # s, and part of the time since the last; an event that is this near may be the one that happened


def cut_motion(
    machine: FlowMap, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray, duration: float
) -> tuple[list[Segment], list[np.ndarray | None]]:
    """What the engine goes through from a state with its modes: segments, and the states after their events.

    Raises
    ------
    SimulationError
        Where the engine stops.
    NoOrbit
        Where an event cannot be told from its modes.
    """
    runs = engine(machine.system, EngineOptions(tolerance=max(machine.tolerance, 1e-9), compiled=machine.compiled))
    window = runs.run(0.0, duration, x, np.array(m, float), p, [Piece(float(value)) for value in u])
    found: list[Segment] = []
    states: list[np.ndarray | None] = []
    modes, began = machine.words(m), 0.0
    for time, raw in window.events:
        after = machine.words(raw)
        if time <= began or after == modes:
            continue
        # lengths by the engine's clock: a slip may be shorter than two engines agree on when it began
        pieces, end = _ended_by(machine, x, modes, after, u, p, time - began)
        began = time
        found += pieces
        states += [None] * (len(pieces) - 1) + [end]
        x, modes = end, after
    return found, states


def _ended_by(
    machine: FlowMap,
    x: np.ndarray,
    before: tuple[int, ...],
    after: tuple[int, ...],
    u: np.ndarray,
    p: np.ndarray,
    length: float,
) -> tuple[list[Segment], np.ndarray]:
    """The segments whose last event leads from modes to modes after about `length`, and the state after it."""
    pieces = _pieces(machine, x, before, u, p, length)
    end = x
    for piece in pieces:
        end = machine.advance(end, piece.held, u, p, piece.duration)
    margins, by_x, _, rate = (part.full() for part in machine.rows(end, pieces[-1].held, u, p))
    slopes = (by_x @ rate).ravel()[: machine.events]
    with np.errstate(divide="ignore", invalid="ignore"):
        waits = np.where(slopes < 0, -margins.ravel()[: machine.events] / slopes, np.inf)
    for row in np.argsort(abs(waits)):
        if not abs(waits[row]) < LINGERS[0] + LINGERS[1] * length:
            break
        last = pieces[-1].duration
        trial = [*pieces[:-1], pieces[-1]._replace(duration=max(last + waits[row], last / 2), fired=int(row))]
        try:
            found = passage(machine, x, trial, u, p)
        except NoOrbit:
            continue
        if found.modes == after:
            return list(found.segments), found.end
    nearest = int(np.argmin(abs(waits)))
    raise NoOrbit(
        f"{machine.system.name}: no single event leads from the modes {before} to {after}; the nearest is "
        f"{machine.names[nearest]!r}, {waits[nearest]:.3g} s away"
    )


def _pieces(
    machine: FlowMap, x: np.ndarray, modes: tuple[int, ...], u: np.ndarray, p: np.ndarray, length: float
) -> list[Segment]:
    """The motion in one mode over `length`, cut at its corners; what ends the last piece is left open."""
    grid = length * GRID
    states = machine.path(x, modes, u, p, length)
    corners = along(machine.corners, states, modes, u, p)
    # at its ends the motion may touch a corner; just before the last event it may go through one
    touches = abs(corners[:, -1]) < TOUCHES * abs(corners[:, -2])
    corners[touches, -1] = corners[touches, -2]
    inside = corners[:, 1:]
    cuts = []
    for row, k in zip(*np.nonzero(inside[:, 1:] * inside[:, :-1] < 0), strict=True):
        low, high = inside[row, k], inside[row, k + 1]
        cuts.append((grid[k + 1] + (grid[k + 2] - grid[k + 1]) * low / (low - high), machine.events + int(row)))
    cuts = [(0.0, -1), *sorted(cuts), (length, -1)]
    found = []
    for (began, _), (ended, row) in itertools.pairwise(cuts):
        middle = [np.interp((began + ended) / 2, grid, values) for values in corners]
        found.append(Segment(modes, tuple(1 if value >= 0 else -1 for value in middle), ended - began, row))
    return found
