"""Stability margins of a loop, in continuous or in discrete time: every crossing, and the disk around one."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import control
import numpy as np
from scipy.optimize import brentq, minimize_scalar

CUT, SLOW = 1e-6, 1e-2  # a loop whose gain is below CUT above SLOW rad/s is cut
UNSTABLE = 1e-9  # part of the fastest pole that a pole may lie beyond the boundary by rounding
NOTHING = 1e-9  # loop gain of a loop that is not there: a stuck gear passes nothing on, but for rounding
GRID = np.logspace(-6, 6, 6001)  # rad/s, on which crossings are bracketed
NYQUIST = 1 - 1e-9  # part of half the sampling rate up to which a loop in discrete time is looked at
PEAK = 1e-10  # relative, of a frequency


@dataclass(frozen=True)
class PhaseCrossing:
    """Where the loop is real and negative."""

    frequency: float  # rad/s
    gain: float  # factor on the loop gain that brings it to -1


@dataclass(frozen=True)
class GainCrossing:
    """Where the loop gain is one."""

    frequency: float  # rad/s
    phase_rad: float  # lag (lead, where negative) that brings it to -1
    delay_s: float  # the smallest that does


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


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Stability margins of a loop; infinite, with frequency nan, where the loop has no such crossing.

    Attributes
    ----------
    stable : bool
        Whether the closed loop is; where it is not, the delay margin is zero.
    gain : float
        Factor on the loop gain to instability [-], the nearest to one; above one unless the loop is
        conditionally stable.
    phase_rad, delay_s : float
        Phase lag and smallest delay to instability; the phase is negative where the closed loop is unstable.
    gain_frequency, phase_frequency, delay_frequency : float
        Where they are [rad/s].
    peak_sensitivity, sensitivity_frequency : float
        Largest |1/(1 + L)| [-] and where [rad/s].
    phase_crossings : tuple of PhaseCrossing
        Every one, in order of frequency.
    gain_crossings : tuple of GainCrossing
        Every one, in order of frequency.
    disk : DiskMargin
        Without skew: changes in both directions weigh the same. Of size zero where the closed loop is unstable.
    """

    stable: bool
    gain: float
    gain_frequency: float
    phase_rad: float
    phase_frequency: float
    delay_s: float
    delay_frequency: float
    peak_sensitivity: float
    sensitivity_frequency: float
    phase_crossings: tuple[PhaseCrossing, ...]
    gain_crossings: tuple[GainCrossing, ...]
    disk: DiskMargin

    @property
    def gain_db(self) -> float:
        """Gain margin [dB]."""
        return 20 * math.log10(self.gain)

    @property
    def phase_deg(self) -> float:
        """Phase margin [deg]."""
        return math.degrees(self.phase_rad)

    @property
    def upper_gain(self) -> float:
        """The smallest factor above one on the loop gain that brings it to -1 [-]; infinite where there is none."""
        return min((crossing.gain for crossing in self.phase_crossings if crossing.gain > 1), default=math.inf)

    @property
    def lower_gain(self) -> float:
        """The largest factor below one on the loop gain that brings it to -1 [-]; zero where there is none."""
        return max((crossing.gain for crossing in self.phase_crossings if crossing.gain < 1), default=0.0)


class _Response:
    """The frequency response of a loop with one input and one output."""

    def __init__(self, loop: control.StateSpace) -> None:
        if loop.ninputs != 1 or loop.noutputs != 1:
            raise ValueError(
                f"margins: the loop has {loop.ninputs} inputs and {loop.noutputs} outputs: its signal is renewed "
                "several times in the period of the slowest clock; `lifted_margins` is for that"
            )
        self.loop, self.step = loop, float(loop.dt or 0)

    def point(self, frequency: np.ndarray | float) -> np.ndarray:
        """Value of s, or of z."""
        return np.exp(1j * np.asarray(frequency) * self.step) if self.step else 1j * np.asarray(frequency)

    def __call__(self, frequency: float) -> complex:
        return complex(self.loop(complex(self.point(frequency))))

    def grid(self, frequencies: np.ndarray) -> np.ndarray:
        """The frequencies at which the loop has a response of its own."""
        if not self.step:
            return frequencies
        end = NYQUIST * math.pi / self.step
        return np.append(frequencies[frequencies < end], end)

    def closed_poles(self) -> np.ndarray:
        """Of 1/(1 + L)."""
        a, b, c, d = (np.asarray(part) for part in (self.loop.A, self.loop.B, self.loop.C, self.loop.D))
        return np.linalg.eigvals(a - b @ c / (1 + d.item()))

    def stable(self) -> bool:
        """Whether the closed loop is."""
        poles = self.closed_poles()
        if self.step:
            return bool((abs(poles) <= 1 + UNSTABLE).all())
        return bool((np.real(poles) <= UNSTABLE * np.abs(poles).max(initial=1.0)).all())


def margins(loop: control.StateSpace, frequencies: np.ndarray = GRID) -> Margins:
    """Gain, phase, delay and disk margins from the exact frequency response.

    Crossings are bracketed on the grid and refined on the response itself: the polynomials of a loop with
    eigenvalues from 1 to 1e6 1/s, on which the usual formulas rest, have no correct digits.

    Raises
    ------
    ValueError
        For a loop with several inputs or outputs.
    """
    response = _Response(loop)
    frequencies = response.grid(frequencies)
    values = np.asarray(loop(response.point(frequencies)))
    if np.abs(values[frequencies > SLOW]).max() < CUT:
        # a stuck gear passes nothing on; the double integrators of what is locked hold nothing but rounding
        return _cut_through()
    phase_crossings = _phase_crossings(response, frequencies, values)
    gain_crossings = _gain_crossings(response, frequencies, values)
    stable = response.stable()
    nothing = (math.inf, math.nan)
    gains = [(crossing.gain, crossing.frequency) for crossing in phase_crossings]
    signed = [(crossing.phase_rad, crossing.frequency) for crossing in gain_crossings]
    delays = [(crossing.delay_s, crossing.frequency) for crossing in gain_crossings] if stable else [(0.0, math.nan)]
    gain = min(gains, key=lambda pair: abs(math.log(pair[0])), default=nothing)
    phase = min(signed, key=lambda pair: abs(pair[0]), default=nothing)
    delay = min(delays, default=nothing)
    peak, at_peak = _peak(lambda w: abs(1 / (1 + response(w))), frequencies, abs(1 / (1 + values)))
    return Margins(
        stable=stable,
        gain=gain[0],
        gain_frequency=gain[1],
        phase_rad=phase[0],
        phase_frequency=phase[1],
        delay_s=delay[0],
        delay_frequency=delay[1],
        peak_sensitivity=peak,
        sensitivity_frequency=at_peak,
        phase_crossings=tuple(phase_crossings),
        gain_crossings=tuple(gain_crossings),
        disk=disk_margin(loop, frequencies=frequencies),
    )


def _cut_through() -> Margins:
    """Margins of a loop through which nothing passes."""
    return Margins(
        stable=True,
        gain=math.inf,
        gain_frequency=math.nan,
        phase_rad=math.inf,
        phase_frequency=math.nan,
        delay_s=math.inf,
        delay_frequency=math.nan,
        peak_sensitivity=1.0,
        sensitivity_frequency=math.nan,
        phase_crossings=(),
        gain_crossings=(),
        disk=_disk(2.0, math.nan, 0.0),
    )


def _phase_crossings(response: _Response, frequencies: np.ndarray, values: np.ndarray) -> list[PhaseCrossing]:
    # on the negative real axis the imaginary part changes sign, away from it the branch at 0 deg does too
    real = [(w, response(w).real) for w in _roots(lambda w: response(w).imag, frequencies, np.imag(values))]
    standing = complex(response.loop(1.0 if response.step else 0.0, warn_infinite=False))  # infinite with an integrator
    if math.isfinite(abs(standing)):
        real.insert(0, (0.0, standing.real))
    if response.step:  # the response at half the sampling rate is real
        real.append((math.pi / response.step, response(math.pi / response.step).real))
    return [PhaseCrossing(w, -1 / value) for w, value in real if value < -NOTHING]


def _gain_crossings(response: _Response, frequencies: np.ndarray, values: np.ndarray) -> list[GainCrossing]:
    found = []
    for w in _roots(lambda w: abs(response(w)) - 1, frequencies, abs(values) - 1):
        lag = (math.pi + float(np.angle(response(w)))) % (2 * math.pi)
        found.append(GainCrossing(w, lag - 2 * math.pi if lag > math.pi else lag, lag / w))
    return found


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
    response = _Response(loop)
    frequencies = response.grid(frequencies)
    if not response.stable():
        return _disk(0.0, math.nan, skew)
    values = np.asarray(loop(response.point(frequencies)))

    def size(value: complex) -> float:
        return abs(1 / (1 + value) + (skew - 1) / 2)

    peak, at_peak = _peak(lambda w: size(response(w)), frequencies, abs(1 / (1 + values) + (skew - 1) / 2))
    return _disk(1 / peak if peak > 0 else math.inf, at_peak, skew)


def _disk(size: float, frequency: float, skew: float) -> DiskMargin:
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


def _peak(function: Callable[[float], float], grid: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """The largest value, refined between the neighbors of the best point of the grid, and where it is."""
    best = int(values.argmax())
    low, high = np.log(grid[max(best - 1, 0)]), np.log(grid[min(best + 1, len(grid) - 1)])
    found = minimize_scalar(
        lambda x: -function(math.exp(x)), bounds=(low, high), method="bounded", options={"xatol": PEAK}
    )
    if -found.fun > values[best]:
        return float(-found.fun), math.exp(found.x)
    return float(values[best]), float(grid[best])


def _roots(function: Callable[[float], float], grid: np.ndarray, values: np.ndarray) -> list[float]:
    above = values >= 0
    return [_root(function, float(grid[k]), float(grid[k + 1])) for k in np.flatnonzero(above[:-1] != above[1:])]


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """The root between two frequencies; one of them, where rounding has it there."""
    ends = function(low), function(high)
    if ends[0] * ends[1] >= 0:
        return low if abs(ends[0]) < abs(ends[1]) else high
    return float(brentq(function, low, high, xtol=1e-12 * low, full_output=True)[1].root)
