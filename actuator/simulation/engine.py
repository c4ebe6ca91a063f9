"""The engine: runs a HybridSystem window by window, and trusts no event it has not checked.

It knows no physics. An event fires only where a margin falls from positive to negative; a margin that is
already negative is never seen again. So every margin is looked at on every output point, and where one is
negative the interval is run again in finer steps until the violation is pinned down, and the modes are
settled there. Intervals with more events than the log holds are run again in finer steps too.

With sampled controllers a window is a number of ticks; where anything is amiss behind one of them, the time up
to the next tick is run again by the means above.
"""

import contextlib
import io
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.hybrid import HybridSystem
from actuator.simulation.compiled import compile_function
from actuator.simulation.input_form import InputForm
from actuator.simulation.mode_code import LOG_SLOTS, ModeCode
from actuator.simulation.signals import Piece
from actuator.simulation.window import INTERVALS, VIOLATION, ticks_function, window_function

FINEST_WINDOW = 1e-7  # s; a window that fails at this length is a failure of the model
ON_TIME = 1e-9  # part of a period within which an instant is that of a tick


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
    fine, stride : int
        Output intervals between two ticks of sampled controllers, or ticks between two output points; one of them is 1.
    """

    tolerance: float = 1e-7
    compiled: bool | None = None
    waves: int = 0
    fine: int = 1
    stride: int = 1


def _called(window: ca.Function, arguments: tuple) -> tuple[list[np.ndarray], str]:
    """Results of a window, or why there are none."""
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):  # CasADi's own words
            raw = [array.full() for array in window(*arguments)]
    except RuntimeError as error:
        return [], str(error).strip().splitlines()[-1]
    return raw, "" if all(np.isfinite(array).all() for array in raw) else "the state is no longer finite"


def _stretches(time: float, end: float, period: float) -> list[tuple[float, float, int, int]]:
    """(begin, stop, index, whole): up to the first tick (index -1), `whole` periods from a tick, the rest after one."""
    if math.isinf(period):
        return [(time, end, -1, 0)]
    first, last = math.ceil(time / period - ON_TIME), math.floor(end / period + ON_TIME)
    if first > last:
        return [(time, end, -1, 0)]
    found = [
        (time, first * period, -1, 0),
        (first * period, last * period, first, last - first),
        (last * period, end, last, 0),
    ]
    return [stretch for stretch in found if stretch[1] - stretch[0] > ON_TIME * period]


@lru_cache(maxsize=32)
def engine(system: HybridSystem, options: EngineOptions = EngineOptions()) -> "Engine":
    """The engine of a system, built once per system and options."""
    return Engine(system, options)


class Engine:
    """A system made ready to run."""

    def __init__(self, system: HybridSystem, options: EngineOptions) -> None:
        self.system, self.options = system, options
        self.form, self.code = InputForm(len(system.inputs), options.waves), ModeCode(len(system.modes))
        # a window of ticks has about as many output points as one without
        self.count = max(1, INTERVALS // options.fine) * options.stride
        self.compiled = (self.ticks if system.clocks else self.window)[1] is not None

    @cached_property
    def window(self) -> tuple[ca.Function, ca.Function | None]:
        """A window without ticks, interpreted and compiled."""
        return self._built(window_function(self.system, self.form, self.code, self.options.tolerance))

    @cached_property
    def ticks(self) -> tuple[ca.Function, ca.Function | None]:
        """A window of `count` ticks, interpreted and compiled."""
        options = self.options
        return self._built(
            ticks_function(
                self.system, self.form, self.code, options.tolerance, self.count, options.fine, options.stride
            )
        )

    def _built(self, function: ca.Function) -> tuple[ca.Function, ca.Function | None]:
        loaded = None if self.options.compiled is False else compile_function(function)
        if loaded is None and self.options.compiled:
            raise RuntimeError("EngineOptions.compiled=True needs a C compiler (cc, gcc or $CC); none was found")
        return function, loaded

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

    def advance(  # noqa: PLR0913 - where from, where to, in which state, with which inputs
        self, time: float, end: float, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece], longest: float
    ) -> Iterator[Window]:
        """From `time` to `end` with the ticks between, window by window, output points at most `longest` apart.

        A tick at `time` is run, one at `end` is not.
        """
        period = self.system.tick_period(p)
        for begin, stop, index, whole in _stretches(time, end, period):
            now = [piece.after(begin - time) for piece in pieces]
            if whole:
                windows = self._many_ticks(index, whole, x, m, p, now)
            else:
                if index >= 0:
                    x, m = self.tick(index, begin, x, m, np.array([piece(0.0) for piece in now]), p)
                windows = self._smooth(begin, stop, x, m, p, now, longest)
            for window in windows:
                yield window
                x, m = window.end

    def tick(
        self, index: int, time: float, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """State and modes after all laws that are due have run once."""
        assert self.system.tick is not None
        after = self.system.tick(self.system.due(np.array([index])), x, m, u, p).full().ravel()
        margins = self.system.margins(after, m, u, p).full()
        return self.settle(time, after, m, u, p) if margins.size and margins.min() < 0 else (after, m)

    def _smooth(  # noqa: PLR0913 - as `advance`
        self, time: float, end: float, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece], longest: float
    ) -> Iterator[Window]:
        """Windows without ticks."""
        count = math.ceil((end - time) / (INTERVALS * longest) * (1 - 1e-12))
        edges = [time + (end - time) * k / count for k in range(count)] + [end]
        for first, last in itertools.pairwise(edges):
            window = self.run(first, last - first, x, m, p, [piece.after(first - time) for piece in pieces])
            yield window
            x, m = window.end

    def _many_ticks(
        self, first: int, count: int, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]
    ) -> Iterator[Window]:
        """Windows of ticks, `count` in all; the pieces begin at the first of them."""
        period = self.system.tick_period(p)
        done = 0
        while done < count:
            now = [piece.after(done * period) for piece in pieces]
            good, window = self._ticks_that_hold(first + done, min(self.count, count - done), x, m, p, now)
            if good:
                done += good
                yield window
                x, m = window.end
                continue
            # these periods again one by one, looked at more closely
            for _ in range(min(self.options.stride, count - done)):
                begin = (first + done) * period
                now = [piece.after(done * period) for piece in pieces]
                x, m = self.tick(first + done, begin, x, m, np.array([piece(0.0) for piece in now]), p)
                window = self.run(begin, period, x, m, p, now)
                done += 1
                yield window
                x, m = window.end

    def _ticks_that_hold(
        self, first: int, count: int, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]
    ) -> tuple[int, Window]:
        """As many of `count` ticks as went well, and their window."""
        fine, stride, period = self.options.fine, self.options.stride, self.system.tick_period(p)
        none = np.empty((0, 0))
        nothing = 0, Window(none, none, none, none, none, [], 0)
        due = self.system.due(first + np.arange(self.count))
        due[:, count:] = -1
        results, failure = _called(self._best(self.ticks), (x, m, p, due, period, self.form.coefficients(pieces)))
        if failure:
            return nothing
        *seen, log, faults, ends, end_modes = results
        counts, times, codes = np.split(log.reshape(-1, fine + 1, self.count, order="F"), [1, 1 + LOG_SLOTS])
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
            *(f(state, mode, u, p).full().ravel() for f in (self.system.outputs_function, self.system.margins)),
        ]
        if (end[-1] < -VIOLATION).any():
            return nothing
        present = codes[: self.code.size]
        before = np.concatenate([self.code.packed(m)[:, None], present[:, -1, : good - 1]], axis=1)
        # codes are whole numbers
        jumps = np.abs(present[:, 0, :good] - before).max(axis=0, initial=0.0) > 0.5  # noqa: PLR2004
        events: list[tuple[float, tuple[int, ...]]] = []
        for k in np.flatnonzero(jumps | happened[:, :good].any(axis=0)):
            if jumps[k]:
                events.append((starts[k], self.code.words(present[:, 0, k])))
            for i in np.flatnonzero(happened[:, k]):
                events += self._logged(starts[k], period, times[: happened[i, k], i + 1, k], codes[:, i + 1, k])
        grid = np.append((starts[::stride, None] + period * np.arange(fine) / fine).ravel(), (first + good) * period)
        state, mode, output, margin = (
            np.column_stack([array[:, :points], last]) for array, last in zip(seen, end, strict=True)
        )
        return good, Window(grid, state, mode, output, margin, events, 0)

    def _best(self, pair: tuple[ca.Function, ca.Function | None]) -> ca.Function:
        return pair[1] or pair[0]

    def run(
        self, time: float, length: float, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]
    ) -> Window:
        """From `time` over `length` in at least INTERVALS output intervals, modes checked on every point."""

        def part(start: float, end: float, x: np.ndarray, m: np.ndarray) -> Window:
            return self.run(start, end - start, x, m, p, [piece.after(start - time) for piece in pieces])

        arguments = x, m, p, length, self.form.coefficients(pieces)
        raw, failure = _called(self._best(self.window), arguments)
        if failure:
            if length / 2 < FINEST_WINDOW:
                # compiled code fails without a word; the interpreter knows why
                raise self._stopped(time, m, _called(self.window[0], arguments)[1] or failure)
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
