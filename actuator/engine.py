"""The engine: runs a HybridSystem on CasADi's Rosenbrock integrator with located events.

It knows no physics. What it adds to the integrator, and why:

* Time runs from 0 to 1 over a window and the window's length is a parameter, so one compiled function
  serves every duration and resolution, and derivatives with respect to a period exist.
* States are scaled by their nominal sizes, so the scalar tolerance means the same for each of them.
* Modes and an event log ride along as states without dynamics, so events survive compilation. They do not
  count in the error: the tolerance is sharpened by what they dilute.
* An event fires only where a margin falls from positive to negative; a margin that is already negative is
  never seen again. So every margin is looked at on every output point, and where one is negative the modes
  are settled again from there.
* The log holds the last LOG_SLOTS mode changes of an output interval. Where an interval had more, it is run
  again in finer steps.
"""

import contextlib
import io
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.compiled import compile_function
from actuator.hybrid import HybridSystem
from actuator.signals import Piece

INTERVALS = 200  # output intervals of one window
LOG_SLOTS = 3
MODE_BASE = 5  # mode variables are -2..2; a log entry packs them as digits
MODES_PER_CODE = 20  # 5^20 < 2^53
EVENT_TOLERANCE = 1e-14  # part of a window
MAX_EVENTS = 20_000  # in one window
VIOLATION = 1e-6  # a margin below minus this is a missed event, not rounding
FINEST_WINDOW = 1e-7  # s; a window that fails at this length is a failure of the model


class SimulationError(RuntimeError):
    """A run that could not be completed; `time` [s] and `modes` say where it stood."""

    def __init__(self, message: str, time: float, modes: dict[str, int]) -> None:
        super().__init__(message)
        self.time = time
        self.modes = modes


class Chattering(SimulationError):
    """More events than any mechanism has: the modes change back and forth without time passing."""


class InconsistentModes(SimulationError):
    """No combination of modes satisfies all contacts at once."""


class Window(NamedTuple):
    """What one call of the integrator returns, on its output points (columns); the first is the start."""

    time: np.ndarray  # (n,)
    states: np.ndarray  # (nx, n)
    modes: np.ndarray  # (nm, n)
    outputs: np.ndarray  # (ny, n)
    margins: np.ndarray  # (ng, n)
    events: list[tuple[float, tuple[int, ...]]]  # (time, modes after)
    settled: int  # missed events that had to be settled

    @property
    def end(self) -> tuple[np.ndarray, np.ndarray]:
        """State and modes at the end."""
        return self.states[:, -1], self.modes[:, -1]

    def until(self, k: int) -> "Window":
        """The points up to and including k."""
        return Window(*(array[..., : k + 1] for array in self[:5]), self.events, self.settled)


def join(windows: list[Window]) -> Window:
    """Windows in a row; of a point that two share the later value counts."""
    *heads, last = windows
    arrays = [[array[..., :-1] for array in window[:5]] for window in heads] + [list(last[:5])]
    return Window(
        *(np.concatenate(parts, axis=-1) for parts in zip(*arrays, strict=True)),
        [event for window in windows for event in window.events],
        sum(window.settled for window in windows),
    )


@dataclass(frozen=True)
class EngineOptions:
    """How finely and by which means to integrate.

    Attributes
    ----------
    tolerance : float
        Local error of each state over its nominal size.
    compiled : bool or None
        True and False insist; None compiles where a C compiler is present.
    waves : int
        Number of sine waves that the inputs need at the same time.
    """

    tolerance: float = 1e-7
    compiled: bool | None = None
    waves: int = 0


@lru_cache(maxsize=32)
def engine(system: HybridSystem, options: EngineOptions = EngineOptions()) -> "Engine":
    """The engine of a system, built once per system and options."""
    return Engine(system, options)


class Engine:
    """A system made ready to run: see the module's text for what is added to it."""

    def __init__(self, system: HybridSystem, options: EngineOptions) -> None:
        self.system, self.options = system, options
        self.nominal = np.array([state.nominal for state in system.states])
        self.codes = -(-len(system.modes) // MODES_PER_CODE)
        function = self._window_function()
        loaded = None if options.compiled is False else compile_function(function)
        if loaded is None and options.compiled:
            raise RuntimeError("EngineOptions.compiled=True needs a C compiler (cc, gcc or $CC); none was found")
        self.compiled = loaded is not None
        self.window = loaded or function

    # -- building -------------------------------------------------------------------------------------

    def _window_function(self) -> ca.Function:
        """(x, m, p, length, signal) -> states, modes, log, outputs, margins on the output points."""
        system = self.system
        nx, nm, nu, n_p = len(system.states), len(system.modes), len(system.inputs), len(system.parameters)
        y, logged = ca.SX.sym("y", nx + nm), ca.SX.sym("log", 1 + LOG_SLOTS * (1 + self.codes))
        tau, length = ca.SX.sym("tau"), ca.SX.sym("length")
        p, signal = ca.SX.sym("p", n_p), ca.SX.sym("signal", self._signal_size())
        x, m = y[:nx] * ca.DM(self.nominal), y[nx:]
        whole, everything = ca.vertcat(y, logged), ca.vertcat(p, length, signal)

        u = self._input(tau * length, signal)
        rate = length * system.flow(x, m, u, p) / ca.DM(self.nominal)
        # what depends on the parameters alone (tooth geometry, say) is worked out once, not in every stage
        (rate, margins), names, derived = ca.extract_parametric([rate, system.margins(x, m, u, p)], p)
        once = ca.Function("once", [p], [ca.vertcat(*derived)])
        everything = ca.vertcat(everything, *names)
        dae = {
            "t": tau,
            "x": whole,
            "p": everything,
            "ode": ca.vertcat(rate, ca.SX.zeros(nm + logged.shape[0])),
        }
        dilution = np.sqrt(nx / whole.shape[0])
        settings = {
            "abstol": self.options.tolerance * dilution,
            "reltol": self.options.tolerance * dilution * 1e-3,
            # the interpolant between steps, on which events are located, is not under error control
            "max_step_size": 1 / INTERVALS,
        }
        if system.margin_names:
            dae["zero"] = margins
            settings |= {
                "transition": self._transition(whole.shape[0], everything.shape[0]),
                "event_tol": EVENT_TOLERANCE,
                "max_events": MAX_EVENTS,
            }
        grid = [k / INTERVALS for k in range(1, INTERVALS + 1)]
        with contextlib.redirect_stderr(io.StringIO()):  # "Event support is experimental", once per integrator
            integrator = ca.integrator("integrator", "rosenbrock", dae, 0, grid, settings)

        observe = ca.Function("observe", [tau, y, p, length, signal], [system.outputs_function(x, m, u, p), system.margins(x, m, u, p)])
        x0, m0 = ca.MX.sym("x0", nx), ca.MX.sym("m0", nm)
        given = ca.MX.sym("p", n_p), ca.MX.sym("length"), ca.MX.sym("signal", self._signal_size())
        start = ca.vertcat(x0 / ca.DM(self.nominal), m0, ca.DM.zeros(logged.shape[0]))
        path = integrator(x0=start, p=ca.vertcat(*given, once(given[0])))["xf"]
        points = ca.horzcat(start, path)
        times = ca.DM([0.0, *grid]).T
        outputs, margins = observe.map(INTERVALS + 1)(times, points[: nx + nm, :], *(ca.repmat(g, 1, INTERVALS + 1) for g in given))
        return ca.Function(
            "window",
            [x0, m0, *given],
            [points[:nx, :] * ca.repmat(ca.DM(self.nominal), 1, INTERVALS + 1), points[nx : nx + nm, :], points[nx + nm :, :], outputs, margins],
        )

    def _signal_size(self) -> int:
        return len(self.system.inputs) * (2 + 2 * self.options.waves) + 3 * self.options.waves

    def _input(self, time: ca.SX, signal: ca.SX) -> ca.SX:
        """u(t) from its coefficients: offset, slope, and per wave a sine and a cosine amplitude."""
        nu, waves = len(self.system.inputs), self.options.waves
        u = signal[:nu] + signal[nu : 2 * nu] * time
        for k in range(waves):
            sines, cosines = (signal[(2 + 2 * k + j) * nu : (3 + 2 * k + j) * nu] for j in (0, 1))
            phase, frequency, rate = ca.vertsplit(signal[(2 + 2 * waves) * nu + 3 * k :][:3])
            angle = phase + frequency * time + rate * time**2 / 2
            u += sines * ca.sin(angle) + cosines * ca.cos(angle)
        return u

    def signal_coefficients(self, pieces: list[Piece]) -> np.ndarray:
        """Coefficients of `_input` from one piece per input."""
        nu, count = len(self.system.inputs), self.options.waves
        shapes = sorted({(wave.frequency, wave.rate) for piece in pieces for wave in piece.waves})
        if len(shapes) > count:
            raise ValueError(f"the inputs have {len(shapes)} different waves at once, the engine was built for {count}")
        vector = np.zeros(self._signal_size())
        for i, piece in enumerate(pieces):
            vector[i], vector[nu + i] = piece.offset, piece.slope
            for wave in piece.waves:
                k = shapes.index((wave.frequency, wave.rate))
                vector[(2 + 2 * k) * nu + i] += wave.amplitude * np.cos(wave.phase)
                vector[(3 + 2 * k) * nu + i] += wave.amplitude * np.sin(wave.phase)
        for k, (frequency, rate) in enumerate(shapes):
            vector[(2 + 2 * count) * nu + 3 * k : (2 + 2 * count) * nu + 3 * k + 3] = 0.0, frequency, rate
        return vector

    def _transition(self, size: int, size_p: int) -> ca.Function:
        system = self.system
        nx, nm, n_p = len(system.states), len(system.modes), len(system.parameters)
        index, tau, whole = ca.MX.sym("index"), ca.MX.sym("tau"), ca.MX.sym("whole", size)
        everything = ca.MX.sym("everything", size_p)
        p, length, signal = everything[:n_p], everything[n_p], everything[n_p + 1 : n_p + 1 + self._signal_size()]
        x, m, logged = whole[:nx] * ca.DM(self.nominal), whole[nx : nx + nm], whole[nx + nm :]
        fired = ca.vertcat(*(ca.fabs(index - k) < 0.5 for k in range(len(system.margin_names))))  # noqa: PLR2004
        u = ca.Function("input", [t := ca.SX.sym("t"), s := ca.SX.sym("s", signal.shape[0])], [self._input(t, s)])(
            tau * length, signal
        )
        state, modes, fault = system.reset(fired, x, m, u, p)
        # newest entry first: count, times, codes; a fault marks its entry by a negative time
        codes = self._packed(modes)
        entries = [ca.if_else(fault, -1.0, tau), *codes]
        shifted = [logged[0] + 1]
        for column, newest in enumerate(entries):
            shifted += [newest, logged[1 + column * LOG_SLOTS : (column + 1) * LOG_SLOTS]]
        post = ca.vertcat(state / ca.DM(self.nominal), modes, *shifted)
        return ca.Function(
            "transition",
            {"index": index, "t": tau, "x": whole, "p": everything, "post_x": post},
            ca.event_in(),
            ca.event_out(),
        )

    def _packed(self, modes: ca.MX) -> list[ca.MX]:
        count = len(self.system.modes)
        groups = [modes[k : min(k + MODES_PER_CODE, count)] for k in range(0, count, MODES_PER_CODE)]
        return [
            ca.sum1((group + 2) * ca.DM([float(MODE_BASE**i) for i in range(group.shape[0])])) for group in groups
        ]

    def _unpacked(self, codes: np.ndarray) -> tuple[int, ...]:
        modes: list[int] = []
        for code in codes:
            rest = int(round(code))
            for _ in range(min(MODES_PER_CODE, len(self.system.modes) - len(modes))):
                rest, digit = divmod(rest, MODE_BASE)
                modes.append(digit - 2)
        return tuple(modes)

    # -- running --------------------------------------------------------------------------------------

    def settle(self, time: float, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """State and modes after a consistent decision of all modes from the continuous state.

        Raises
        ------
        InconsistentModes
            Where there is none.
        """
        state, modes, fault = self.system.reset(np.zeros(len(self.system.margin_names)), x, m, u, p)
        modes = np.round(modes.full().ravel())
        if float(fault):
            raise self._inconsistent(time, modes)
        return state.full().ravel(), modes

    def run(self, time: float, length: float, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]) -> Window:
        """From `time` over `length` in at least INTERVALS output intervals, modes checked on every point."""

        def part(start: float, end: float, x: np.ndarray, m: np.ndarray) -> Window:
            return self.run(start, end - start, x, m, p, [piece.after(start - time) for piece in pieces])

        try:
            raw = [array.full() for array in self.window(x, m, p, length, self.signal_coefficients(pieces))]
            failure = None if all(np.isfinite(array).all() for array in raw) else "the state is no longer finite"
        except RuntimeError as error:
            raw, failure = [], str(error).strip().splitlines()[-1]
        if failure:
            if length / 2 < FINEST_WINDOW:
                raise self._stopped(time, m, failure)
            first = part(time, time + length / 2, x, m)
            return join([first, part(time + length / 2, time + length, *first.end)])

        states, modes, logged, outputs, margins = raw
        modes, grid = np.round(modes), time + length * np.arange(INTERVALS + 1) / INTERVALS
        window = Window(grid, states, modes, outputs, margins, [], 0)
        counts = np.diff(logged[0])
        missed = np.flatnonzero((margins < -VIOLATION).any(axis=0))
        crowded = np.flatnonzero(counts > LOG_SLOTS)
        trouble = min([*(missed[:1] - 1), *crowded[:1]], default=INTERVALS)
        events = []
        for k in np.flatnonzero(counts[: max(trouble, 0)]):
            events += self._logged(time, length, logged[:, k + 1], int(counts[k]))
        if trouble == INTERVALS:
            return window._replace(events=events)
        if trouble < 0 or length / INTERVALS < FINEST_WINDOW:
            # the violation is pinned down: settle the modes on the first point that shows it
            k = trouble + 1
            u = np.array([piece(grid[k] - time) for piece in pieces])
            state, settled = self.settle(grid[k], states[:, k], modes[:, k], u, p)
            if np.array_equal(settled, modes[:, k]):
                raise self._inconsistent(grid[k], settled)
            found = [*events, (grid[k], tuple(int(mode) for mode in settled))]
            head = window.until(k)._replace(events=found, settled=1)
            return join([head, part(grid[k], time + length, state, settled)])
        inner = part(grid[trouble], grid[trouble + 1], states[:, trouble], modes[:, trouble])
        parts = [window.until(trouble)._replace(events=events), inner]
        if trouble + 1 < INTERVALS:
            parts.append(part(grid[trouble + 1], time + length, *inner.end))
        return join(parts)

    def _logged(self, time: float, length: float, logged: np.ndarray, count: int) -> list[tuple[float, tuple[int, ...]]]:
        columns = logged[1:].reshape(1 + self.codes, LOG_SLOTS)[:, :count][:, ::-1]
        found = []
        for tau, *codes in columns.T:
            modes = self._unpacked(np.array(codes))
            if tau < 0:
                raise self._inconsistent(time, np.array(modes))
            found.append((time + length * tau, modes))
        return found

    def _stopped(self, time: float, modes: np.ndarray, reason: str) -> SimulationError:
        named = {name: int(mode) for name, mode in zip(self.system.modes, modes, strict=True)}
        kind = Chattering if "max_events" in reason else SimulationError
        return kind(
            f"{self.system.name}: the run cannot go on after t = {time:.9g} s ({reason}); the modes there are "
            f"{', '.join(f'{name} = {mode}' for name, mode in named.items())}",
            time,
            named,
        )

    def _inconsistent(self, time: float, modes: np.ndarray) -> InconsistentModes:
        named = {name: int(mode) for name, mode in zip(self.system.modes, modes, strict=True)}
        return InconsistentModes(
            f"{self.system.name}: no combination of contact modes is consistent at t = {time:.9g} s; the last tried is "
            f"{', '.join(f'{name} = {mode}' for name, mode in named.items())}. Is friction so strong that the train jams?",
            time,
            named,
        )
