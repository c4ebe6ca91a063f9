"""The engine: runs a HybridSystem window by window, and trusts no event it has not checked.

It knows no physics. With sampled controllers a window is a number of ticks; where anything is amiss behind one of
them, the time up to the next tick is run again by a window without ticks, which is looked at more closely.
"""

import itertools
import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from actuator.simulation.checked_ticks import ticks_that_hold
from actuator.simulation.checked_window import checked_window
from actuator.simulation.prepared import EngineOptions, Prepared
from actuator.simulation.signals import Piece
from actuator.simulation.window import INTERVALS
from actuator.simulation.window_points import Window
from actuator.system.hybrid import HybridSystem

ON_TIME = 1e-9  # part of a period within which an instant is that of a tick


@lru_cache(maxsize=32)
def engine(system: HybridSystem, options: EngineOptions) -> "Engine":
    """The engine of a system, built once per system and options."""
    return Engine(system, options)


class Engine:
    """A system made ready to run."""

    def __init__(self, system: HybridSystem, options: EngineOptions) -> None:
        self.system, self.prepared = system, Prepared(system, options)
        functions = self.prepared.ticks if system.clocks else self.prepared.window
        self.compiled = functions.compiled is not None

    def settle(
        self, time: float, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """State and modes after a consistent decision of all modes; raises InconsistentModes where there is none."""
        return self.prepared.settle(time, x, m, u, p)

    def run(
        self, time: float, length: float, x: np.ndarray, m: np.ndarray, p: np.ndarray, pieces: list[Piece]
    ) -> Window:
        """From `time` over `length` without ticks, in at least INTERVALS output intervals."""
        return checked_window(self.prepared, time, length, x, m, p, pieces)

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
            good, window = ticks_that_hold(
                self.prepared, first + done, min(self.prepared.count, count - done), x, m, p, now
            )
            if good:
                done += good
                yield window
                x, m = window.end
                continue
            # these periods again one by one, looked at more closely
            for _ in range(min(self.prepared.options.stride, count - done)):
                begin = (first + done) * period
                now = [piece.after(done * period) for piece in pieces]
                x, m = self.tick(first + done, begin, x, m, np.array([piece(0.0) for piece in now]), p)
                window = self.run(begin, period, x, m, p, now)
                done += 1
                yield window
                x, m = window.end


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
