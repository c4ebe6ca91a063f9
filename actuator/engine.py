"""The engine: runs a HybridSystem window by window, and trusts no event it has not checked.

It knows no physics. An event fires only where a margin falls from positive to negative; a margin that is
already negative is never seen again. So every margin is looked at on every output point, and where one is
negative the interval is run again in finer steps until the violation is pinned down, and the modes are
settled there. Intervals with more events than the log holds are run again in finer steps too.
"""

import contextlib
import io
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.compiled import compile_function
from actuator.hybrid import HybridSystem
from actuator.signals import Piece
from actuator.window import INTERVALS, LOG_SLOTS, InputForm, ModeCode, window_function

VIOLATION = 1e-9  # a margin below minus this is a missed event, not rounding
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
        return self._replace(**{name: getattr(self, name)[..., : k + 1] for name in ARRAYS})


ARRAYS = ("time", "states", "modes", "outputs", "margins")  # fields of a window with a column per point


def join(windows: list[Window]) -> Window:
    """Windows in a row; of a point that two share the later value counts."""
    last = len(windows) - 1

    def joined(name: str) -> np.ndarray:
        parts = [getattr(window, name) for window in windows]
        return np.concatenate([part if k == last else part[..., :-1] for k, part in enumerate(parts)], axis=-1)

    return windows[last]._replace(
        **{name: joined(name) for name in ARRAYS},
        events=[event for window in windows for event in window.events],
        settled=sum(window.settled for window in windows),
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


def _called(window: ca.Function, arguments: tuple) -> tuple[list[np.ndarray], str]:
    """Results of a window, or why there are none."""
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):  # CasADi's own words
            raw = [array.full() for array in window(*arguments)]
    except RuntimeError as error:
        return [], str(error).strip().splitlines()[-1]
    return raw, "" if all(np.isfinite(array).all() for array in raw) else "the state is no longer finite"


@lru_cache(maxsize=32)
def engine(system: HybridSystem, options: EngineOptions = EngineOptions()) -> "Engine":
    """The engine of a system, built once per system and options."""
    return Engine(system, options)


class Engine:
    """A system made ready to run."""

    def __init__(self, system: HybridSystem, options: EngineOptions) -> None:
        self.system, self.options = system, options
        self.form, self.code = InputForm(len(system.inputs), options.waves), ModeCode(len(system.modes))
        function = window_function(system, self.form, self.code, options.tolerance)
        loaded = None if options.compiled is False else compile_function(function)
        if loaded is None and options.compiled:
            raise RuntimeError("EngineOptions.compiled=True needs a C compiler (cc, gcc or $CC); none was found")
        self.compiled = loaded is not None
        self.interpreted, self.window = function, loaded or function

    def settle(
        self, time: float, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
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

    def run(
        self, time: float, length: float, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]
    ) -> Window:
        """From `time` over `length` in at least INTERVALS output intervals, modes checked on every point."""

        def part(start: float, end: float, x: np.ndarray, m: np.ndarray) -> Window:
            return self.run(start, end - start, x, m, p, [piece.after(start - time) for piece in pieces])

        arguments = x, m, p, length, self.form.coefficients(pieces)
        raw, failure = _called(self.window, arguments)
        if failure:
            if length / 2 < FINEST_WINDOW:
                # compiled code fails without a word; the interpreter knows why
                raise self._stopped(time, m, _called(self.interpreted, arguments)[1] or failure)
            first = part(time, time + length / 2, x, m)
            return join([first, part(time + length / 2, time + length, *first.end)])

        states, modes, count, times, codes, outputs, margins = raw
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
                events += self._logged(time, length, times[: counts[k], k + 1], codes[:, k + 1])
        window = Window(grid, states, modes, outputs, margins, events, 0)
        if good == INTERVALS:
            return window
        if good < 0 or length / INTERVALS < FINEST_WINDOW:
            return self._settled(window, good + 1, p, pieces, part)
        inner = part(grid[good], grid[good + 1], states[:, good], modes[:, good])
        parts = [window.until(good), inner]
        if good + 1 < INTERVALS:
            parts.append(part(grid[good + 1], time + length, *inner.end))
        return join(parts)

    def _settled(self, window: Window, k: int, p: np.ndarray, pieces: list[Piece], part: Callable) -> Window:
        """A violation pinned down to point k: settle the modes there and go on."""
        time, x, m = window.time[k], window.states[:, k], window.modes[:, k]
        u = np.array([piece(time - window.time[0]) for piece in pieces])
        state, modes = self.settle(time, x, m, u, p)
        if np.array_equal(modes, m):
            raise self._inconsistent(time, modes)
        head = window.until(k)._replace(events=[*window.events, (time, tuple(int(mode) for mode in modes))], settled=1)
        return join([head, part(time, window.time[-1], state, modes)])

    def _logged(
        self, time: float, length: float, times: np.ndarray, codes: np.ndarray
    ) -> list[tuple[float, tuple[int, ...]]]:
        """Events of one output interval, oldest first."""
        found = []
        for tau, packed in reversed(list(zip(times, codes.reshape(-1, self.code.size), strict=False))):
            modes = self.code.words(packed)
            if tau < 0:  # a fault, with its time below minus one
                raise self._inconsistent(time + length * (-1 - tau), np.array(modes))
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
            f"{', '.join(f'{name} = {mode}' for name, mode in named.items())}. Does friction jam the train?",
            time,
            named,
        )
