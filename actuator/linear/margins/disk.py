"""Disk margins: gain and phase changed at once; and peaks of a frequency response."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import control
import numpy as np
from scipy.optimize import minimize_scalar

from actuator.linear.margins.response import GRID, LoopResponse

PEAK = 1e-10  # relative, of a frequency


@dataclass(frozen=True)
class DiskMargin:
    """The largest disk of changes of the loop that leaves it stable, gain and phase at once.

        loop (1 + (1 - skew)/2 z) / (1 - (1 + skew)/2 z)  stays stable for all complex z with |z| < size

    References
    ----------
    Seiler, Packard, Gahinet, "An introduction to disk margins", IEEE Control Systems Magazine 40(5), 2020.
    """

    size: float
    frequency: float  # rad/s, of the first loss of stability
    gain_low: float  # factors on the gain between which all is well at phase zero
    gain_high: float
    phase_rad: float  # change of phase that is well at gain one


def disk_margin(loop: control.StateSpace, *, skew: float = 0.0, frequencies: np.ndarray = GRID) -> DiskMargin:
    """Disk margin of a loop: 1/size = max |S + (skew - 1)/2|.

    Parameters
    ----------
    loop : control.StateSpace
        In continuous or in discrete time.
    skew : float
        0 weighs gains and their inverses the same, 1 is about S (more gain), -1 about 1 - S (less).
    frequencies : ndarray
        On which the peak is bracketed [rad/s].

    Raises
    ------
    ValueError
        For a loop with several inputs or outputs.
    """
    response = LoopResponse(loop)
    frequencies = response.grid(frequencies)
    if not response.stable():
        return disk_of(0.0, math.nan, skew)
    values, _ = response.values(frequencies)

    def size(value: complex) -> float:
        return abs(1 / (1 + value) + (skew - 1) / 2)

    peak, at_peak = peak_of(lambda w: size(response(w)), frequencies, abs(1 / (1 + values) + (skew - 1) / 2))
    return disk_of(1 / peak if peak > 0 else math.inf, at_peak, skew)


def disk_of(size: float, frequency: float, skew: float) -> DiskMargin:
    """Gains and phase of a disk."""
    if not math.isfinite(size):
        return DiskMargin(size, frequency, 0.0, math.inf, math.inf)
    below, above = size * (1 - skew) / 2, size * (1 + skew) / 2
    low = (1 - below) / (1 + above)
    high = (1 + below) / (1 - above) if above != 1 else math.inf
    # the circle through low and high on the real axis meets the unit circle at this angle
    cosine = (1 + low * high) / (low + high) if math.isfinite(high) else low
    phase = math.acos(cosine) if abs(cosine) < 1 else (0.0 if size == 0 else math.inf)
    return DiskMargin(size, frequency, max(low, 0.0), high if above < 1 else math.inf, phase)


def peak_of(function: Callable[[float], float], grid: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """The largest value, refined between the neighbors of the best point of the grid, and where it is."""
    best = int(values.argmax())
    low, high = np.log(grid[max(best - 1, 0)]), np.log(grid[min(best + 1, len(grid) - 1)])
    found = minimize_scalar(
        lambda x: -function(math.exp(x)), bounds=(low, high), method="bounded", options={"xatol": PEAK}
    )
    if -found.fun > values[best]:
        return float(-found.fun), math.exp(found.x)
    return float(values[best]), float(grid[best])
