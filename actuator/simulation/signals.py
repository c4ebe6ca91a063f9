"""Inputs over time. Between their break points all of them are a line plus sines."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from actuator.engine.pieces import Piece, Wave
from gear.quantities.registry import part


class Signal(Protocol):
    """An input over time."""

    def pieces(self) -> Sequence[tuple[float, Piece]]:
        """Start times (ascending, the first is minus infinity) and what holds from there on."""
        ...


def piece_at(signal: "Signal", time: float) -> Piece:
    """The piece that holds just after `time`, with tau counted from `time`."""
    start, piece = [(start, piece) for start, piece in signal.pieces() if start <= time][-1]
    return piece.after(time - start) if math.isfinite(start) else piece


def values_at(signal: "Signal", times: np.ndarray) -> np.ndarray:
    """Values at ascending times (n,), just after each of them."""
    pieces = signal.pieces()
    found, belongs = np.empty_like(times), np.searchsorted([start for start, _ in pieces], times, side="right") - 1
    for k in np.unique(belongs):
        start, piece = pieces[k]
        here = belongs == k
        found[here] = piece(times[here] - start if math.isfinite(start) else np.zeros(here.sum()))
    return found


def break_points(signal: "Signal") -> list[float]:
    """Times at which the signal is not smooth."""
    return [start for start, _ in signal.pieces() if math.isfinite(start)]


def bounds(signal: "Signal", end: float) -> tuple[float, float]:
    """Values between which a signal stays from time zero to `end` [s]; waves count with their whole amplitude."""
    starts = [0.0, *(time for time in break_points(signal) if 0 < time < end)]
    low, high = math.inf, -math.inf
    for start, stop in zip(starts, [*starts[1:], end], strict=True):
        piece = piece_at(signal, start)
        swing = sum(abs(wave.amplitude) for wave in piece.waves)
        ends = (piece.offset, piece.offset + piece.slope * (stop - start))
        low, high = min(low, min(ends) - swing), max(high, max(ends) + swing)
    return low, high


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Constant:
    """The same value for ever."""

    value: float

    def pieces(self) -> list[tuple[float, Piece]]:
        """One piece."""
        return [(-math.inf, Piece(self.value))]


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Step:
    """`before` until `time` [s], `after` from then on."""

    time: float = 0.0
    before: float = 0.0
    after: float

    def pieces(self) -> list[tuple[float, Piece]]:
        """Two constant pieces."""
        return [(-math.inf, Piece(self.before)), (self.time, Piece(self.after))]


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Ramp:
    """`start` until `time` [s], then `slope` per second, for ever or until `end` [s]."""

    time: float = 0.0
    start: float = 0.0
    slope: float
    end: float = math.inf

    def __post_init__(self) -> None:
        if self.end < self.time:
            raise ValueError(f"Ramp.end must be >= Ramp.time, got end={self.end:g} s and time={self.time:g} s")

    def pieces(self) -> list[tuple[float, Piece]]:
        """Constant, line, constant."""
        found = [(-math.inf, Piece(self.start)), (self.time, Piece(self.start, self.slope))]
        if math.isfinite(self.end):
            found.append((self.end, Piece(self.start + self.slope * (self.end - self.time))))
        return found


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Sine:
    """`offset` until `time` [s], then offset + amplitude sin(2 pi frequency (t - time) + phase), frequency in Hz."""

    amplitude: float
    frequency: float
    time: float = 0.0
    offset: float = 0.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        if self.frequency <= 0:
            raise ValueError(f"Sine.frequency must be > 0 Hz, got {self.frequency:g} Hz")

    def pieces(self) -> list[tuple[float, Piece]]:
        """Constant, then one wave."""
        wave = Wave(self.amplitude, self.phase, 2 * math.pi * self.frequency)
        return [(-math.inf, Piece(self.offset)), (self.time, Piece(self.offset, waves=(wave,)))]


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Chirp:
    """`offset` until `time` [s], then a sine whose frequency runs linearly from one value [Hz] to another."""

    amplitude: float
    first_frequency: float
    last_frequency: float
    duration: float
    time: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if self.duration <= 0:
            raise ValueError(f"Chirp.duration must be > 0 s, got {self.duration:g} s")

    def pieces(self) -> list[tuple[float, Piece]]:
        """Constant, one wave, constant."""
        rate = 2 * math.pi * (self.last_frequency - self.first_frequency) / self.duration
        wave = Wave(self.amplitude, 0.0, 2 * math.pi * self.first_frequency, rate)
        return [
            (-math.inf, Piece(self.offset)),
            (self.time, Piece(self.offset, waves=(wave,))),
            (self.time + self.duration, Piece(self.offset)),
        ]


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Gust:
    """One-minus-cosine gust: `offset`, and from `time` [s] a single hump that lasts `duration` [s].

        offset + amplitude/2 (1 - cos(2 pi (t - time) / duration))

    A discrete gust of gradient distance H, flown through at speed V, lasts 2 H / V; its amplitude is the
    hinge moment (or force) at the design gust velocity.

    References
    ----------
    EASA CS-25, 25.341(a), the shape of the discrete gust.
    """

    amplitude: float
    duration: float
    time: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if self.duration <= 0:
            raise ValueError(f"Gust.duration must be > 0 s, got {self.duration:g} s")

    def pieces(self) -> list[tuple[float, Piece]]:
        """Constant, one wave about half the amplitude, constant."""
        wave = Wave(self.amplitude / 2, -math.pi / 2, 2 * math.pi / self.duration)
        return [
            (-math.inf, Piece(self.offset)),
            (self.time, Piece(self.offset + self.amplitude / 2, waves=(wave,))),
            (self.time + self.duration, Piece(self.offset)),
        ]


def _require_points(signal: "Table | Staircase") -> None:
    name, times, values = type(signal).__name__, signal.times, signal.values
    if len(times) != len(values) or not times:
        raise ValueError(f"{name} needs as many values as times, got {len(values)} and {len(times)}")
    if any(late <= early for early, late in pairwise(times)):
        raise ValueError(f"{name}.times must increase from point to point, got {times}")


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Table:
    """Straight lines through the points (times [s], values); constant before the first and after the last."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        _require_points(self)

    def pieces(self) -> list[tuple[float, Piece]]:
        """A constant, a line per interval, a constant."""
        points = list(zip(self.times, self.values, strict=True))
        found = [(-math.inf, Piece(self.values[0]))]
        for (t0, v0), (t1, v1) in zip(points, points[1:], strict=False):
            found.append((t0, Piece(v0, (v1 - v0) / (t1 - t0))))
        found.append((self.times[-1], Piece(self.values[-1])))
        return found


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Staircase:
    """Each value from its time [s] until the next one, the last for ever; the first also before."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        _require_points(self)

    def pieces(self) -> list[tuple[float, Piece]]:
        """Constants."""
        return self._constants

    @cached_property
    def _constants(self) -> list[tuple[float, Piece]]:
        starts = (-math.inf, *self.times[1:])
        return [(start, Piece(value)) for start, value in zip(starts, self.values, strict=True)]


@part(Signal)
@dataclass(frozen=True, kw_only=True)
class Sum:
    """Several signals on one input."""

    parts: tuple[Signal, ...]

    def pieces(self) -> list[tuple[float, Piece]]:
        """A piece between every two break points of the parts."""
        starts = [-math.inf, *sorted({time for part in self.parts for time in break_points(part)})]
        found = []
        for start in starts:
            pieces = [part.pieces()[0][1] if start == -math.inf else piece_at(part, start) for part in self.parts]
            found.append(
                (
                    start,
                    Piece(
                        sum(piece.offset for piece in pieces),
                        sum(piece.slope for piece in pieces),
                        tuple(wave for piece in pieces for wave in piece.waves),
                    ),
                )
            )
        return found
