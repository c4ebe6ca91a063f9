"""Turning points of a signal, and whether its swings repeat, shrink or grow."""

import itertools
import math
from typing import NamedTuple

import numpy as np

FLAT = 0.01  # part of the least swing within which a plateau is level
REFINED = 0.02  # part of a period by which passages may correct it
LONGEST_PATTERN = 6  # swings after which a cycle must repeat
TREND = 4  # periods from which a trend can be seen
STEADY = 1e-3  # relative change from period to period below which there is none to speak of
DECAYED = 0.3  # part of the last swing that may be left for ever on the way to rest


class Pattern(NamedTuple):
    """Swings that repeat."""

    swings: int  # after which they repeat; even
    sizes: np.ndarray  # mean swing of each period, the last one last


def find_turning_points(signal: np.ndarray, least: float) -> list[int]:
    """Indices at which the signal turns, each swing at least `least`; a plateau counts at its first point."""
    found, low, high, rising = [], 0, 0, None
    flat = FLAT * least
    for k, value in enumerate(signal.tolist()):
        if value > signal[high] + flat:
            high = k
        if value < signal[low] - flat:
            low = k
        if rising is not False and value < signal[high] - least:
            found.append(high)
            low, rising = k, False
        elif rising is not True and value > signal[low] + least:
            found.append(low)
            high, rising = k, True
        if rising is True:
            low = k
        elif rising is False:
            high = k
    return found


def time_swings(time: np.ndarray, signal: np.ndarray, turns: list[int]) -> np.ndarray:
    """When each swing between two turning points happens: the mean of its time over its way, (turns - 1,).

    Standing adds no way: the first point of a plateau may be a matter of noise, this moment is not.
    """
    found = []
    for first, last in itertools.pairwise(turns):
        middle = (time[first:last] + time[first + 1 : last + 1]) / 2
        found.append(float(middle @ np.diff(signal[first : last + 1])) / float(signal[last] - signal[first]))
    return np.array(found)


def measure_period(time: np.ndarray, load: np.ndarray, start: float, end: float) -> float:
    """Period from upward passages of mid-swing, of about one period from `start` to `end`; that, where there are none.

    A passage is exact; the time of a swing depends on where its turning points are taken to be.
    """
    rough = end - start
    window = (time >= start) & (time <= end)
    middle = (load[window].max() + load[window].min()) / 2
    above = load > middle
    rises = np.flatnonzero(above[1:] & ~above[:-1])
    at = time[rises] + (middle - load[rises]) / (load[rises + 1] - load[rises]) * (time[rises + 1] - time[rises])
    lengths = [last - first for last in at[-1:] for first in at[:-1]]
    near = min(lengths, key=lambda length: abs(length - rough), default=rough)
    return float(near) if abs(near - rough) < REFINED * rough else rough


def follow_behind_play(signal: np.ndarray, play: float) -> np.ndarray:
    """What follows a signal behind a total play: still wherever the signal moves by less than it."""
    if play <= 0:
        return signal
    found, at, half = np.empty_like(signal), float(signal[0]), play / 2
    for k, value in enumerate(signal.tolist()):
        at = min(max(at, value - half), value + half)
        found[k] = at
    return found


def find_pattern(swings: np.ndarray, times: np.ndarray, step: float, same: float) -> Pattern | None:
    """Smallest even number of swings after which sizes and times repeat, twice over; None where they do not.

    `times` are those between two swings, known to `step`, the distance of the output points; sizes and times may
    differ by the part `same`.
    """
    for count in range(2, LONGEST_PATTERN + 1, 2):
        if len(swings) < 2 * count + 1:
            return None
        pairs = [(row[-count:], row[-2 * count : -count]) for row in (swings, times)]
        whole = times[-count:].sum()
        sizes_repeat = np.allclose(*pairs[0], rtol=same, atol=same * swings[-count:].max())
        times_repeat = np.allclose(*pairs[1], rtol=same, atol=same * whole + 2 * step)
        if sizes_repeat and times_repeat:
            periods = len(swings) // count
            return Pattern(count, swings[-periods * count :].reshape(periods, count).mean(axis=1))
    return None


def find_trend(sizes: np.ndarray) -> float:
    """Factor per period by which swings go on shrinking or growing as a geometric row does; 1 where they do not.

    A transient into a cycle changes by less and less. With early and late the logarithms of the changes over the two
    halves, what is still to come is late/(early/late - 1), and the swings vanish where that is much.
    """
    half = (len(sizes) - 1) // 2
    if half < TREND // 2:
        return 1.0
    early, late = np.log(sizes[[-1 - half, -1]] / sizes[[-1 - 2 * half, -1 - half]])
    if abs(late) < STEADY * half or early * late <= 0:
        return 1.0
    left = late / (early / late - 1) if early / late > 1 else math.copysign(math.inf, late)
    return float(np.exp(late / half)) if left < math.log(DECAYED) or left > -math.log(DECAYED) else 1.0


def extrapolate_limit(sizes: np.ndarray) -> float:
    """Where a row of sizes is going, by Aitken's rule on its last three; infinity for equal steps."""
    early, late = sizes[-2] - sizes[-3], sizes[-1] - sizes[-2]
    return float(abs(sizes[-1] - late**2 / (late - early))) if late != early else float("inf")
