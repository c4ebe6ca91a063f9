"""The motion between two events as a function with exact derivatives, and the passage through a sequence of events.

What the engine does in one integration is taken apart here: in each smooth segment the modes are fixed and known, so
the integrator needs no events, and where the segment ends is an equation of its own, margin = 0, solved by Newton's
method to rounding. Between events derivatives are those of the integrator; across an event

    dt  = -(dg/dx dx + dg/dp dp) / (dg/dx f)          when it happens
    dx+ = dr/dx (dx + f dt) + dr/dp dp                the state after it, at its own time

with the margin g, the flow f before and the reset r. At a fixed time, dx+ - f+ dt is the saltation matrix times dx.
Corners of the flow inside a mode (a limit that is met, say) end a segment, too: they are events that change nothing.

References
----------
P. C. Mueller, "Calculation of Lyapunov exponents for dynamic systems with discontinuities", Chaos, Solitons &
Fractals 5 (1995) 1671-1681; R. I. Leine, H. Nijmeijer, "Dynamics and Bifurcations of Non-Smooth Mechanical Systems"
(2004), chapter 7.
"""

import contextlib
import io
import itertools
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.hunting.kinks import hold_corners
from actuator.hybrid import MARGIN_BAND, HybridSystem
from actuator.simulation.compiled import compile_function
from actuator.simulation.engine import EngineOptions, engine
from actuator.simulation.run import contact_names
from actuator.simulation.signals import Piece

TOLERANCE = 1e-10  # local error of each state over its nominal size
FINEST_RELATIVE = 1e-13  # relative tolerance below which an integrator counts rounding
BLOCK = 4  # directions differentiated at once; compiling takes as long as there are directions
POINTS = 200  # output points of a segment
GRID = np.linspace(0, 1, POINTS + 1) ** 3  # parts of a segment; it starts with the fast transients
EVENT_STEPS = 25
EVENT_ROUNDING = 8 * np.finfo(float).eps  # of the duration
MARGIN_NOISE = 1e-7  # friction of redundant contacts is known to this part of a usual force
SMALLEST_RATE = 1e-300
TOUCHES = 0.02  # part of its value one output point earlier; below it a corner is met with the event, not before
LINGERS = 1e-4, 1e-3  # s, and part of the time since the last; an event that is this near may be the one that happened


class NoOrbit(RuntimeError):
    """No periodic orbit was found; the message says where the search ended, with numbers."""


class Segment(NamedTuple):
    """A smooth piece of motion that ends with an event."""

    modes: tuple[int, ...]  # while it lasts
    sides: tuple[int, ...]  # of the corners of the flow
    duration: float  # s
    fired: int  # row that ends it by falling through zero, of the margins followed by the corners of the flow

    @property
    def held(self) -> tuple[int, ...]:
        """Modes and sides."""
        return self.modes + self.sides


class Passage(NamedTuple):
    """A motion through events; derivatives are with respect to k directions, None where they were not asked for."""

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


@lru_cache(maxsize=16)
def flow_map(system: HybridSystem, tolerance: float = TOLERANCE, compiled: bool | None = None) -> "FlowMap":
    """The flow map of a system, built once."""
    return FlowMap(system, tolerance, compiled)


class FlowMap:
    """The smooth motion of a system in fixed modes, its events and resets, with derivatives.

    Inputs are constant. Directions are columns of derivatives with respect to anything, of the state and of the
    parameters: `seed_x` (nx, k) and `seed_p` (np, k).
    """

    def __init__(self, system: HybridSystem, tolerance: float, compiled: bool | None) -> None:
        self.system, self.tolerance, self.compiled = system, tolerance, compiled
        self.nominal = np.array([state.nominal for state in system.states])
        self.nx, self.grid = len(system.states), GRID
        contacts = contact_names(system.modes)
        x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(k)) for k, name in enumerate("xmup"))
        both = [system.flow(x, m, u, p), system.margins(x, m, u, p) - MARGIN_BAND]
        smooth = hold_corners(ca.Function("both", [x, m, u, p], both, {"cse": True}))
        x, m, u, p = smooth.arguments
        held = [x, ca.vertcat(m, smooth.sides), u, p]
        end = self._segment("segment", ca.Function("smooth", held, smooth.results[:1]), [1.0], {})
        self._end = self._fast(end)
        self._tangent = self._fast(end.forward(BLOCK))
        self._path = self._fast(self._segment("path", system.flow, list(GRID[1:]), {"max_step_size": 2 / POINTS}))
        rows = ca.vertcat(smooth.results[1], smooth.corners)
        self._rows = ca.Function(
            "rows", held, [rows, ca.jacobian(rows, x), ca.jacobian(rows, p), smooth.results[0]], {"cse": True}
        )
        self._corners = ca.Function("corners", [x, m, u, p], [smooth.true_corners])
        self.names = [*system.margin_names, *(f"corner {k} of the flow" for k in range(smooth.sides.shape[0]))]
        self.events = len(system.margin_names)
        # the decision of the modes has no derivative: only what leads to the state after it is kept
        given = [ca.MX.sym(f"given{k}", system.reset.size1_in(k)) for k in range(system.reset.n_in())]
        after = ca.Function("after", given, system.reset.call(given, True, False)[:1])
        self._reset = self._fast(after.forward(BLOCK))
        flanks = {name.removesuffix(".flank"): k for k, name in enumerate(system.modes) if name.endswith(".flank")}
        self._free = [(system.modes.index(f"{name}.motion"), k) for name, k in flanks.items() if name in contacts]

    def _fast(self, function: ca.Function) -> ca.Function:
        loaded = None if self.compiled is False else compile_function(function)
        if loaded is None and self.compiled:
            raise RuntimeError("compiled=True needs a C compiler (cc, gcc or $CC); none was found")
        return loaded or function

    def _segment(self, name: str, flow: ca.Function, grid: list[float], options: dict) -> ca.Function:
        """(x, m, u, p, duration) -> states at the parts `grid` of the duration, in fixed modes."""
        nominal = ca.DM(self.nominal)
        sizes = [flow.size1_in(k) for k in (3, 1, 2)]
        y, length, given = ca.SX.sym("y", self.nx), ca.SX.sym("length"), ca.SX.sym("given", sum(sizes))
        p, m, u = ca.vertsplit(given, [0, *(int(k) for k in np.cumsum(sizes))])
        # what does not depend on the state is worked out once, not in every stage
        (rate,), names, derived = ca.extract_parametric([flow(y * nominal, m, u, p)], given)
        once = ca.Function("once", [given], [ca.vertcat(*derived)])
        dae = {"x": y, "p": ca.vertcat(length, given, *names), "ode": length * rate / nominal}
        settings = {"abstol": self.tolerance, "reltol": max(1e-3 * self.tolerance, FINEST_RELATIVE)} | options
        integrator = ca.integrator("integrator", "rosenbrock", dae, 0, grid, settings)
        x, modes, inputs, parameters = (
            ca.MX.sym(letter, size) for letter, size in zip("xmup", (self.nx, *sizes[1:], sizes[0]), strict=True)
        )
        duration, held = ca.MX.sym("duration"), ca.vertcat(parameters, modes, inputs)
        states = integrator(x0=x / nominal, p=ca.vertcat(duration, held, once(held)))["xf"]
        return ca.Function(name, [x, modes, inputs, parameters, duration], [states * ca.repmat(nominal, 1, len(grid))])

    # -- one segment ----------------------------------------------------------------------------------

    def advance(self, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray, duration: float) -> np.ndarray:
        """State after `duration` in the modes and sides m."""
        return self._called(self._end, x, m, u, p, duration).ravel()

    def path(self, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray, duration: float) -> np.ndarray:
        """States on POINTS + 1 output points, (nx, POINTS + 1)."""
        return np.column_stack([x, self._called(self._path, x, m, u, p, duration)])

    def _called(self, function: ca.Function, *arguments: object) -> np.ndarray:
        try:
            with (
                contextlib.redirect_stdout(io.StringIO()),
                contextlib.redirect_stderr(io.StringIO()),
            ):  # CasADi's own words
                return np.asarray(function(*arguments))
        except RuntimeError as error:
            raise NoOrbit(
                f"{self.system.name}: a segment of {arguments[-1]:.9g} s cannot be integrated to a tolerance of "
                f"{self.tolerance:g}: {str(error).strip().splitlines()[-1]}"
            ) from error

    def words(self, m: Sequence[float] | np.ndarray) -> tuple[int, ...]:
        """Modes as integers; a mesh in its gap has no motion of its own, and what rounding says of it is dropped."""
        modes = [round(float(mode)) for mode in m]
        for motion, flank in self._free:
            modes[motion] *= abs(modes[flank])
        return tuple(modes)

    def rate(self, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """The flow."""
        return self.system.flow(x, m, u, p).full().ravel()

    def _tangents(self, function: ca.Function, known: list, seeds: list[np.ndarray]) -> np.ndarray:
        """Directional derivatives of the first result of `function`, BLOCK directions at a time."""
        count, found = seeds[0].shape[1], []
        for k in range(0, count, BLOCK):
            part = [np.pad(s[:, k : k + BLOCK], ((0, 0), (0, max(0, k + BLOCK - count)))) for s in seeds]
            result = function(*known, *part)
            found.append((result[0] if isinstance(result, tuple | list) else result).full())
        return np.hstack(found)[:, :count]

    def _crossing(
        self, x: np.ndarray, segment: Segment, u: np.ndarray, p: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """When the margin of a segment is zero: duration, state, derivatives of the margin, and flow there."""
        duration, row = segment.duration, segment.fired
        name = self.names[row]
        least = np.inf
        for _ in range(EVENT_STEPS):
            end = self.advance(x, segment.held, u, p, duration)
            margins, by_x, by_p, rate = (part.full() for part in self._rows(end, segment.held, u, p))
            slope = float((by_x[row] @ rate).item())
            if not np.isfinite(slope) or abs(slope) < SMALLEST_RATE:
                raise NoOrbit(
                    f"{self.system.name}: the margin {name!r} does not move after {duration:.9g} s of a segment"
                )
            step = -float(margins[row, 0]) / slope
            value = abs(float(margins[row, 0]))
            if abs(step) <= EVENT_ROUNDING * duration or least <= value <= MARGIN_NOISE:
                return duration, end, by_x[row], by_p[row], rate.ravel()
            least = min(least, value)
            duration = min(max(duration + step, duration / 2), 2 * duration)
        raise NoOrbit(
            f"{self.system.name}: the margin {name!r} does not reach zero near the end of a segment of "
            f"{segment.duration:.9g} s: it is {float(margins[row, 0]):.3g} after {duration:.9g} s"
        )

    # -- through events -------------------------------------------------------------------------------

    def passage(
        self,
        x: np.ndarray,
        segments: Sequence[Segment],
        u: np.ndarray,
        p: np.ndarray,
        seed_x: np.ndarray | None = None,
        seed_p: np.ndarray | None = None,
    ) -> Passage:
        """Follow a sequence of segments; their durations are first guesses.

        Raises
        ------
        NoOrbit
            Where a margin is never reached, or the modes after an event are not those of the next segment.
        """
        count = 0 if seed_x is None else seed_x.shape[1]
        moved = np.zeros((self.nx, 0)) if seed_x is None else seed_x
        seed_p = np.zeros((p.size, count)) if seed_p is None else seed_p
        delayed = np.zeros(count)
        starts, found = [], []
        modes = segments[0].modes
        none = (
            np.zeros((1, count)),
            np.zeros((len(modes), count)),
            np.zeros((u.size, count)),
            np.zeros((len(segments[0].held), count)),
        )
        fired = np.zeros(len(self.system.margin_names))
        no_fired = np.zeros((fired.size, count))
        for segment in segments:
            if modes != segment.modes:
                raise NoOrbit(
                    f"{self.system.name}: after {self.names[found[-1].fired]!r} the modes are {modes}, "
                    f"not {segment.modes}"
                )
            duration, before, by_x, by_p, rate = self._crossing(x, segment, u, p)
            starts.append(x)
            found.append(segment._replace(duration=duration))
            if count:
                seeds = [moved, none[3], none[2], seed_p, none[0]]
                moved = self._tangents(self._tangent, [x, segment.held, u, p, duration, before], seeds)
                delay = -(by_x @ moved + by_p @ seed_p) / (by_x @ rate)
                moved, delayed = moved + np.outer(rate, delay), delayed + delay
            x = before
            if segment.fired >= self.events:
                continue
            fired[:] = 0
            fired[segment.fired] = 1
            after, decided, fault = (part.full().ravel() for part in self.system.reset(fired, before, modes, u, p))
            if fault:
                raise NoOrbit(f"{self.system.name}: no consistent modes after {self.names[segment.fired]!r}")
            if count:
                known = [fired, before, modes, u, p, after]
                moved = self._tangents(self._reset, known, [no_fired, moved, none[1], none[2], seed_p])
            x, modes = after, self.words(decided)
        return Passage(tuple(found), tuple(starts), x, modes, self.rate(x, modes, u, p), moved, delayed)

    def segments(
        self, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray, duration: float
    ) -> tuple[list[Segment], list[np.ndarray | None]]:
        """What the engine goes through from a state with its modes: segments, and the states after their events.

        Raises
        ------
        SimulationError
            Where the engine stops.
        NoOrbit
            Where an event cannot be told from its modes.
        """
        machine = engine(self.system, EngineOptions(tolerance=max(self.tolerance, 1e-9), compiled=self.compiled))
        window = machine.run(0.0, duration, x, np.array(m, float), p, [Piece(float(value)) for value in u])
        found: list[Segment] = []
        states: list[np.ndarray | None] = []
        modes, began = self.words(m), 0.0
        for time, raw in window.events:
            after = self.words(raw)
            if time <= began or after == modes:
                continue
            # lengths by the engine's clock: a slip may be shorter than two engines agree on when it began
            pieces, end = self._ended_by(x, modes, after, u, p, time - began)
            began = time
            found += pieces
            states += [None] * (len(pieces) - 1) + [end]
            x, modes = end, after
        return found, states

    def _ended_by(
        self,
        x: np.ndarray,
        before: tuple[int, ...],
        after: tuple[int, ...],
        u: np.ndarray,
        p: np.ndarray,
        length: float,
    ) -> tuple[list[Segment], np.ndarray]:
        """The segments whose last event leads from modes to modes after about `length`, and the state after it."""
        pieces = self._pieces(x, before, u, p, length)
        end = x
        for piece in pieces:
            end = self.advance(end, piece.held, u, p, piece.duration)
        margins, by_x, _, rate = (part.full() for part in self._rows(end, pieces[-1].held, u, p))
        slopes = (by_x @ rate).ravel()[: self.events]
        with np.errstate(divide="ignore", invalid="ignore"):
            waits = np.where(slopes < 0, -margins.ravel()[: self.events] / slopes, np.inf)
        for row in np.argsort(abs(waits)):
            if not abs(waits[row]) < LINGERS[0] + LINGERS[1] * length:
                break
            last = pieces[-1].duration
            trial = [*pieces[:-1], pieces[-1]._replace(duration=max(last + waits[row], last / 2), fired=int(row))]
            try:
                passage = self.passage(x, trial, u, p)
            except NoOrbit:
                continue
            if passage.modes == after:
                return list(passage.segments), passage.end
        nearest = int(np.argmin(abs(waits)))
        raise NoOrbit(
            f"{self.system.name}: no single event leads from the modes {before} to {after}; the nearest is "
            f"{self.names[nearest]!r}, {waits[nearest]:.3g} s away"
        )

    def _pieces(
        self, x: np.ndarray, modes: tuple[int, ...], u: np.ndarray, p: np.ndarray, length: float
    ) -> list[Segment]:
        """The motion in one mode over `length`, cut at its corners; what ends the last piece is left open."""
        grid = length * GRID
        states = self.path(x, modes, u, p, length)
        repeated = (np.tile(np.array(given, float)[:, None], POINTS + 1) for given in (modes, u, p))
        corners = self._corners.map(POINTS + 1)(states, *repeated).full()
        # at its ends the motion may touch a corner; just before the last event it may go through one
        touches = abs(corners[:, -1]) < TOUCHES * abs(corners[:, -2])
        corners[touches, -1] = corners[touches, -2]
        inside = corners[:, 1:]
        cuts = []
        for row, k in zip(*np.nonzero(inside[:, 1:] * inside[:, :-1] < 0), strict=True):
            low, high = inside[row, k], inside[row, k + 1]
            cuts.append((grid[k + 1] + (grid[k + 2] - grid[k + 1]) * low / (low - high), self.events + int(row)))
        cuts = [(0.0, -1), *sorted(cuts), (length, -1)]
        found = []
        for (began, _), (ended, row) in itertools.pairwise(cuts):
            middle = [np.interp((began + ended) / 2, grid, values) for values in corners]
            found.append(Segment(modes, tuple(1 if value >= 0 else -1 for value in middle), ended - began, row))
        return found
