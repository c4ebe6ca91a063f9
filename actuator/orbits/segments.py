"""The passage of a motion through a sequence of events, with exact derivatives.

Where a segment ends is an equation of its own, margin = 0, solved by Newton's method to rounding. Between events
derivatives are those of the integrator; across an event

    dt  = -(dg/dx dx + dg/dp dp) / (dg/dx f)          when it happens
    dx+ = dr/dx (dx + f dt) + dr/dp dp                the state after it, at its own time

with the margin g, the flow f before and the reset r. At a fixed time, dx+ - f+ dt is the saltation matrix times dx.
Switching surfaces inside a mode (a limit that is met, say) end a segment, too: they are events that change nothing.

References
----------
P. C. Mueller, "Calculation of Lyapunov exponents for dynamic systems with discontinuities", Chaos, Solitons &
Fractals 5 (1995) 1671-1681; R. I. Leine, H. Nijmeijer, "Dynamics and Bifurcations of Non-Smooth Mechanical Systems"
(2004), chapter 7.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from actuator.orbits.flow import GRID, FlowMap, NoOrbit, along, directional
from actuator.simulation.signals import Piece
from actuator.simulation.simulate import resume

EVENT_STEPS = 25
EVENT_ROUNDING = 8 * np.finfo(float).eps  # of the duration
MARGIN_NOISE = 1e-7  # friction of redundant contacts is known to this part of a usual force
SMALLEST_RATE = 1e-300
TOUCHES = 0.02  # part of its value one output point earlier; below it a surface is met with the event, not before
LINGERS = 1e-4, 1e-3  # s, and part of the time since the last; an event that is this near may be the one that happened


class Segment(NamedTuple):
    """A smooth piece of motion that ends with an event."""

    modes: tuple[int, ...]  # while it lasts
    sides: tuple[int, ...]  # of the switching surfaces
    duration: float  # s
    fired: int  # row that ends it by falling through zero, of the margins followed by the switching surfaces

    @property
    def held(self) -> tuple[int, ...]:
        """Modes and sides."""
        return self.modes + self.sides


class Passage(NamedTuple):
    """A motion through events; derivatives are with respect to k directions, k = 0 where none were asked for."""

    segments: tuple[Segment, ...]
    starts: tuple[np.ndarray, ...]  # state at the start of each segment
    end: np.ndarray  # state after the last event
    modes: tuple[int, ...]  # after the last event
    along: np.ndarray  # flow after the last event
    moved: np.ndarray  # (nx, k): derivative of `end`, each at its own time
    delayed: np.ndarray  # (k,): derivative of the duration

    @property
    def duration(self) -> float:
        """[s]."""
        return float(sum(segment.duration for segment in self.segments))

    @property
    def fixed_time(self) -> np.ndarray:
        """Derivative of the state at a fixed time, (nx, k): the product of transition and saltation matrices."""
        return self.moved - np.outer(self.along, self.delayed)


def passage(
    machine: FlowMap,
    x: np.ndarray,
    segments: Sequence[Segment],
    u: np.ndarray,
    p: np.ndarray,
    seed_x: np.ndarray | None = None,
    seed_p: np.ndarray | None = None,
) -> Passage:
    """Follow a sequence of segments; their durations are first guesses.

    Directions are columns of derivatives with respect to anything, of the state and of the parameters: `seed_x` (nx, k)
    and `seed_p` (np, k).

    Raises
    ------
    NoOrbit
        Where a margin is never reached, or the modes after an event are not those of the next segment.
    """
    count = 0 if seed_x is None else seed_x.shape[1]
    moved = np.zeros((machine.nx, 0)) if seed_x is None else seed_x
    seed_p = np.zeros((p.size, count)) if seed_p is None else seed_p
    delayed = np.zeros(count)
    starts, found = [], []
    modes = segments[0].modes
    none = [np.zeros((size, count)) for size in (1, len(modes), u.size, len(segments[0].held))]
    fired = np.zeros(len(machine.system.margin_names))
    no_fired = np.zeros((fired.size, count))
    for segment in segments:
        if modes != segment.modes:
            raise NoOrbit(
                f"{machine.system.name}: after {machine.names[found[-1].fired]!r} the modes are {modes}, "
                f"not {segment.modes}"
            )
        duration, before, by_x, by_p, rate = _crossing(machine, x, segment, u, p)
        starts.append(x)
        found.append(segment._replace(duration=duration))
        if count:
            seeds = [moved, none[3], none[2], seed_p, none[0]]
            moved = directional(machine.tangent, [x, segment.held, u, p, duration, before], seeds)
            delay = -(by_x @ moved + by_p @ seed_p) / (by_x @ rate)
            moved, delayed = moved + np.outer(rate, delay), delayed + delay
        x = before
        if segment.fired >= machine.events:
            continue
        fired[:] = 0
        fired[segment.fired] = 1
        after, decided, fault = (part.full().ravel() for part in machine.system.reset(fired, before, modes, u, p))
        if fault:
            raise NoOrbit(f"{machine.system.name}: no consistent modes after {machine.names[segment.fired]!r}")
        if count:
            known = [fired, before, modes, u, p, after]
            moved = directional(machine.reset_tangent, known, [no_fired, moved, none[1], none[2], seed_p])
        x, modes = after, machine.integer_modes(decided)
    return Passage(tuple(found), tuple(starts), x, modes, machine.rate(x, modes, u, p), moved, delayed)


def _crossing(
    machine: FlowMap, x: np.ndarray, segment: Segment, u: np.ndarray, p: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """When the margin of a segment is zero: duration, state, derivatives of the margin, and flow there."""
    duration, row = segment.duration, segment.fired
    name = machine.names[row]
    least = np.inf
    for _ in range(EVENT_STEPS):
        end = machine.advance(x, segment.held, u, p, duration)
        margins, by_x, by_p, rate = (part.full() for part in machine.rows(end, segment.held, u, p))
        slope = float((by_x[row] @ rate).item())
        if not np.isfinite(slope) or abs(slope) < SMALLEST_RATE:
            raise NoOrbit(
                f"{machine.system.name}: the margin {name!r} does not move after {duration:.9g} s of a segment"
            )
        step = -float(margins[row, 0]) / slope
        value = abs(float(margins[row, 0]))
        if abs(step) <= EVENT_ROUNDING * duration or least <= value <= MARGIN_NOISE:
            return duration, end, by_x[row], by_p[row], rate.ravel()
        least = min(least, value)
        duration = min(max(duration + step, duration / 2), 2 * duration)
    raise NoOrbit(
        f"{machine.system.name}: the margin {name!r} does not reach zero near the end of a segment of "
        f"{segment.duration:.9g} s: it is {float(margins[row, 0]):.3g} after {duration:.9g} s"
    )


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
    inputs, tolerance = [Piece(float(value)) for value in u], max(machine.tolerance, 1e-9)
    trace = resume(machine.system, 0.0, duration, x, np.array(m, float), inputs, p, np.array([duration]), tolerance)
    found: list[Segment] = []
    states: list[np.ndarray | None] = []
    modes, began = machine.integer_modes(m), 0.0
    for time, raw in zip(trace.event_times, trace.event_modes, strict=True):
        after = machine.integer_modes(raw)
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
    """The motion in one mode over `length`, cut at its surfaces; what ends the last piece is left open."""
    grid = length * GRID
    states = machine.path(x, modes, u, p, length)
    surfaces = along(machine.surfaces, states, modes, u, p)
    # at its ends the motion may touch a surface; just before the last event it may go through one
    touches = abs(surfaces[:, -1]) < TOUCHES * abs(surfaces[:, -2])
    surfaces[touches, -1] = surfaces[touches, -2]
    inside = surfaces[:, 1:]
    cuts = []
    for row, k in zip(*np.nonzero(inside[:, 1:] * inside[:, :-1] < 0), strict=True):
        low, high = inside[row, k], inside[row, k + 1]
        cuts.append((grid[k + 1] + (grid[k + 2] - grid[k + 1]) * low / (low - high), machine.events + int(row)))
    cuts = [(0.0, -1), *sorted(cuts), (length, -1)]
    found = []
    for (began, _), (ended, row) in itertools.pairwise(cuts):
        middle = [np.interp((began + ended) / 2, grid, values) for values in surfaces]
        found.append(Segment(modes, tuple(1 if value >= 0 else -1 for value in middle), ended - began, row))
    return found
