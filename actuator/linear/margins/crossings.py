"""Stability margins of a loop, in continuous or in discrete time: every crossing, and the disk around one."""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import control
import numpy as np

from actuator.linear.bode import CUT, SLOW, to_db
from actuator.linear.margins.disk import DiskMargin, disk_margin, disk_of, peak_of
from actuator.linear.margins.response import GRID, NOTHING, LoopResponse


@dataclass(frozen=True)
class PhaseCrossing:
    """Where the loop is real and negative."""

    frequency: float  # rad/s; infinite for what passes at once
    gain: float  # factor on the loop gain that brings it to -1


@dataclass(frozen=True)
class GainCrossing:
    """Where the loop gain is one."""

    frequency: float  # rad/s
    phase_rad: float  # lag (lead, where negative) that brings it to -1
    delay_s: float  # the smallest that does


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
        return to_db(self.gain)

    @property
    def range_db(self) -> tuple[float, ...]:
        """Gain margins that belong together [dB]: the one nearest to zero."""
        return (self.gain_db,)

    def rows(self) -> Iterator[tuple[str, float | None, float, str]]:
        """Every margin: what it is, at which frequency [rad/s] (None: at none of its own), its value and its unit."""
        for gain in self.gain_crossings:
            yield "phase margin", gain.frequency, math.degrees(gain.phase_rad), "deg"
            yield "delay margin", gain.frequency, gain.delay_s, "s"
        for phase in self.phase_crossings:
            yield "gain margin", phase.frequency, to_db(phase.gain), "dB"
        yield "disk size", self.disk.frequency, self.disk.size, "-"

    def numbers(self) -> dict[str, Any]:
        """All of it for machines."""
        return {"gain_db": self.gain_db, **asdict(self)}

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


def margins(loop: control.StateSpace, frequencies: np.ndarray = GRID) -> Margins:
    """Gain, phase, delay and disk margins from the exact frequency response.

    Crossings are bracketed on the grid and refined on the response itself: the polynomials of a loop with
    eigenvalues from 1 to 1e6 1/s, on which the usual formulas rest, have no correct digits. What is called a crossing
    has a sign on either side that is beyond the doubt of double precision, as `LoopResponse` has it.

    Raises
    ------
    ValueError
        For a loop with several inputs or outputs.
    """
    response = LoopResponse(loop)
    frequencies = response.grid(frequencies)
    values, doubts = response.values(frequencies)
    if np.abs(values[frequencies > SLOW]).max() < CUT:
        # a stuck gear passes nothing on; the double integrators of what is locked hold nothing but rounding
        return _cut_through()
    phase_crossings = _phase_crossings(response, frequencies, values, doubts)
    gain_crossings = _gain_crossings(response, frequencies, values, doubts)
    stable = response.stable()
    nothing = (math.inf, math.nan)
    gains = [(crossing.gain, crossing.frequency) for crossing in phase_crossings]
    signed = [(crossing.phase_rad, crossing.frequency) for crossing in gain_crossings]
    delays = [(crossing.delay_s, crossing.frequency) for crossing in gain_crossings] if stable else [(0.0, math.nan)]
    gain = min(gains, key=lambda pair: abs(math.log(pair[0])), default=nothing)
    phase = min(signed, key=lambda pair: abs(pair[0]), default=nothing)
    delay = min(delays, default=nothing)
    peak, at_peak = peak_of(lambda w: abs(1 / (1 + response(w))), frequencies, abs(1 / (1 + values)))
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
        disk=disk_of(2.0, math.nan, 0.0),
    )


def _phase_crossings(
    response: LoopResponse, frequencies: np.ndarray, values: np.ndarray, doubts: np.ndarray
) -> list[PhaseCrossing]:
    # on the negative real axis the imaginary part changes sign, away from it the branch at 0 deg does too
    real = [(w, response(w).real) for w in response.roots(np.imag, frequencies, values, doubts)]
    found = sorted(real + response.at_ends())
    return [PhaseCrossing(w, -1 / value) for w, value in found if -1 / NOTHING < value < -NOTHING]


def _gain_crossings(
    response: LoopResponse, frequencies: np.ndarray, values: np.ndarray, doubts: np.ndarray
) -> list[GainCrossing]:
    found = []
    for w in response.roots(lambda value: np.abs(value) - 1, frequencies, values, doubts):
        lag = (math.pi + float(np.angle(response(w)))) % (2 * math.pi)
        found.append(GainCrossing(w, lag - 2 * math.pi if lag > math.pi else lag, lag / w))
    return found
