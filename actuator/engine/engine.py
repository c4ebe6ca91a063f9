"""A system made ready to run: tables for its runs, and the loop around the kernel that hears of progress and Ctrl-C."""

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from actuator.engine import layout as at
from actuator.engine.advance import (
    CHATTERS,
    CONTINUE,
    DONE,
    ON_TIME,
    PAUSED,
    RESTART,
    START,
    run,
)
from actuator.engine.memory import COMPILED
from actuator.engine.model import Model, model
from actuator.engine.pieces import Piece
from actuator.system.hybrid import HybridSystem

LONGEST = 16.0  # s, of a step without ticks
PART_OF_WAVE = 8  # of a sine wave of an input that one step may have: more could pass for a line
SLICE = 20_000 if COMPILED else 50  # steps after which Python is asked: below a tenth of a second
REPORTS = 50  # of progress, at least
ROOM = 512  # events between two looks of Python
RELATIVE, ROUNDING = (
    1e-3,
    1e-14,
)  # part of a state's size that counts like its nominal size; part of it that is rounding


class Trace(NamedTuple):
    """What a run leaves behind; states, modes and events in rows."""

    status: int  # how it ended: DONE, or JAMMED, CHATTERS, GROWN, STALLED of `advance`
    time: float  # s, at which it ended; where it chatters, at which that began
    times: np.ndarray  # output points that were reached
    states: np.ndarray
    modes: np.ndarray
    end: tuple[np.ndarray, np.ndarray]  # state and modes at the end, before what a tick or a step of inputs does there
    event_times: np.ndarray  # s
    event_fired: np.ndarray  # which margin; -1 at a tick or a step of an input
    event_before: np.ndarray  # states
    event_after: np.ndarray
    event_modes: np.ndarray  # after it
    counts: dict[str, int]
    worst: int  # the state that left all bounds, where one did


@lru_cache(maxsize=64)
def engine(system: HybridSystem) -> "Engine":
    """The engine of a system, built once."""
    return Engine(system)


class Engine:
    """Runs one system; threads may share it."""

    def __init__(self, system: HybridSystem) -> None:
        self.system, self.model = system, model(system)
        self._idle: list[_Table] = []
        self._lock = threading.Lock()

    def run(  # noqa: PLR0913 - where from, where to, and what is wanted
        self,
        pieces: Sequence[tuple[float, list[Piece]]],
        end: float,
        x: np.ndarray,
        m: np.ndarray,
        p: np.ndarray,
        times: np.ndarray,
        *,
        tolerance: float,
        settled: bool = False,
        progress: Callable[[float], None] | None = None,
    ) -> Trace:
        """From the start of the first piece of the inputs to `end`.

        Parameters
        ----------
        pieces : sequence of (float, list of Piece)
            Start of each [s], and what holds from there for each input, counted from there.
        x, m : ndarray
            State and modes at the start.
        times : ndarray
            Output points, ascending [s]; at an event or a tick what is after it is shown.
        tolerance : float
            Local error of each state over its nominal size.
        settled : bool
            Whether the modes at the start are decided already.
        progress : callable or None
            Called with the simulated time [s].
        """
        waves = max(sum(len(piece.waves) for piece in inputs) for _, inputs in pieces)
        with self._table(waves) as table:
            return table.run(pieces, end, x, m, p, times, tolerance, settled, progress)

    @contextmanager
    def _table(self, waves: int) -> Iterator["_Table"]:
        """A table that no other thread uses, kept for the next run."""
        with self._lock:
            fitting = [table for table in self._idle if table.sizes.nw == waves]
            table = fitting[0] if fitting else None
            if table is not None:
                self._idle.remove(table)
        table = table or _Table(self.model, waves)
        try:
            yield table
        finally:
            with self._lock:
                self._idle.append(table)


class _Table:
    """The table of a run and the arrays it points to."""

    def __init__(self, ready: Model, waves: int) -> None:
        self.model, self.sizes = ready, ready.sizes._replace(nw=waves)
        self.w = np.zeros(at.LENGTH, np.int64)
        self.w[: at.COUNTS] = ready.addresses
        self.w[at.MOVING], self.w[at.ROOM] = self.sizes.n, ROOM
        self.kept: dict[int, np.ndarray] = {}
        lengths = at.lengths(self.sizes, ROOM)
        room = np.zeros(sum(lengths.values()) + 1)
        place = 0
        for k, length in lengths.items():
            self._put(k, room[place : place + length])
            place += length
        self.kept[at.NOMINAL][:] = ready.nominal
        self.kept[at.EVERY][:] = [clock.every for clock in ready.system.clocks]
        self.kept[at.SLIP_MOTION][:], self.kept[at.SLIP_FLANK][:] = ready.slip_modes
        self._slip_of = np.array([math.nan])

    def _put(self, k: int, array: np.ndarray) -> None:
        self.kept[k] = array
        self.w[k], self.w[k + 1] = array.ctypes.data, array.size

    def run(  # noqa: PLR0913, PLR0917 - as `Engine.run`
        self,
        pieces: Sequence[tuple[float, list[Piece]]],
        end: float,
        x: np.ndarray,
        m: np.ndarray,
        p: np.ndarray,
        times: np.ndarray,
        tolerance: float,
        settled: bool,
        progress: Callable[[float], None] | None,
    ) -> Trace:
        w, kept, sizes = self.w, self.kept, self.sizes
        begin = pieces[0][0]
        states, modes = np.empty((times.size, sizes.n + sizes.nh)), np.empty((times.size, sizes.nm))
        self._put(at.OUT_TIMES, times)
        self._put(at.OUT_STATES, states.ravel())
        self._put(at.OUT_MODES, modes.ravel())
        self._begin(x, m, p, tolerance, begin)
        log: list[list[np.ndarray]] = []
        status, real = DONE, kept[at.NUMBERS]
        for number, (first, inputs) in enumerate(pieces):
            last = pieces[number + 1][0] if number + 1 < len(pieces) else end
            self._inputs(inputs, last - first)
            real[at.TIME], real[at.BEGIN], real[at.END] = 0.0, first, last - first
            real[at.EVENT_TIME] = math.nan
            stage = RESTART if settled and number == 0 else START
            while True:
                w[at.PAUSE] = w[at.STEPS] + SLICE
                real[at.HALT] = math.inf if progress is None else real[at.TIME] + (end - begin) / REPORTS
                status = run(w, stage)
                stage = CONTINUE
                self._read_log(log)
                if progress is not None:
                    progress(real[at.BEGIN] + real[at.TIME])
                if status != PAUSED:
                    break
            if status != DONE:
                break
        reached = int(w[at.SEEN])
        if status == DONE and reached < times.size:  # the very end
            states[reached, : sizes.n], states[reached, sizes.n :] = kept[at.X], kept[at.H]
            modes[reached] = kept[at.M]
            reached += 1
        return self._trace(status, log, times[:reached], states[:reached], modes[:reached], begin)

    def _begin(self, x: np.ndarray, m: np.ndarray, p: np.ndarray, tolerance: float, time: float) -> None:
        """Everything as before the first step."""
        w, kept, n, system = self.w, self.kept, self.sizes.n, self.model.system
        w[at.COUNTS + 1 : at.VECTORS] = 0
        w[at.ROOM] = ROOM
        kept[at.X][:], kept[at.H][:], kept[at.M][:], kept[at.P][:] = x[:n], x[n:], m, p
        if not np.array_equal(p, self._slip_of):
            kept[at.SLIP][:] = self.model.slip(p).ravel()
            self._slip_of = p.copy()
        period = system.tick_period(p)
        real = kept[at.NUMBERS]
        real[at.TOLERANCE], real[at.RELATIVE] = tolerance, RELATIVE + ROUNDING / tolerance
        real[at.PERIOD], real[at.CROWD_TIME] = period, -math.inf
        kept[at.SIZES][:] = np.ldexp(LONGEST if math.isinf(period) else period, -np.arange(at.DEEPEST + 1))
        w[at.NEXT] = 1 if math.isinf(period) else math.ceil(time / period - ON_TIME)

    def _inputs(self, inputs: list[Piece], length: float) -> None:
        """The inputs of one piece."""
        kept = self.kept
        kept[at.OFFSETS][:] = [piece.offset for piece in inputs]
        kept[at.SLOPES][:] = [piece.slope for piece in inputs]
        waves = [(k, wave) for k, piece in enumerate(inputs) for wave in piece.waves]
        table = np.zeros((5, self.sizes.nw))
        for k, (which, wave) in enumerate(waves):
            table[:, k] = which, wave.amplitude, wave.phase, wave.frequency, wave.rate
        for k, values in zip(
            (at.WAVE_INPUT, at.WAVE_AMPLITUDE, at.WAVE_PHASE, at.WAVE_FREQUENCY, at.WAVE_RATE), table, strict=True
        ):
            kept[k][:] = values
        fastest = max((max(abs(v.frequency), abs(v.frequency + v.rate * length)) for _, v in waves), default=0.0)
        longest = 2 * math.pi / fastest / PART_OF_WAVE if fastest else math.inf
        self.w[at.TOP] = int(np.argmax(kept[at.SIZES] <= longest))
        self.w[at.STEADY] = not waves and not kept[at.SLOPES].any()

    def _read_log(self, log: list[list[np.ndarray]]) -> None:
        count, kept = int(self.w[at.EVENTS]), self.kept
        if count:
            vectors = at.LOG_TIMES, at.LOG_FIRED, at.LOG_BEFORE, at.LOG_AFTER, at.LOG_MODES
            log.append([kept[k].reshape(ROOM, -1)[:count].copy() for k in vectors])
            self.w[at.EVENTS] = 0

    def _trace(  # noqa: PLR0913, PLR0917
        self,
        status: int,
        log: list[list[np.ndarray]],
        times: np.ndarray,
        states: np.ndarray,
        modes: np.ndarray,
        begin: float,
    ) -> Trace:
        w, kept, s = self.w, self.kept, self.sizes
        whole = s.n + s.nh
        widths = (1, 1, whole, whole, s.nm)
        parts = [np.concatenate(part) for part in zip(*log, strict=True)] if log else [np.empty((0, k)) for k in widths]
        event_times, fired = parts[0][:, 0], parts[1][:, 0].astype(int)
        if event_times.size and fired[0] < 0 and event_times[0] == begin:  # the first decision is no event
            parts, event_times, fired = [part[1:] for part in parts], event_times[1:], fired[1:]
        real = kept[at.NUMBERS]
        counts = {"steps": at.STEPS, "flows": at.EVALUATED, "modes": at.ENTERED, "ladders": at.BUILT, "again": at.AGAIN}
        return Trace(
            status=status,
            time=float(real[at.CROWD_TIME] if status == CHATTERS else real[at.BEGIN] + real[at.TIME]),
            times=times,
            states=states,
            modes=modes,
            end=(np.concatenate([kept[at.X], kept[at.H]]), kept[at.M].copy()),
            event_times=event_times,
            event_fired=fired,
            event_before=parts[2],
            event_after=parts[3],
            event_modes=parts[4],
            counts={name: int(w[k]) for name, k in counts.items()},
            worst=int(w[at.CHANGED]),
        )
