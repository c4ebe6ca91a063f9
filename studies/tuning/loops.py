"""Loops and responses for tuning, in continuous time or sampled, and margins with their derivatives by the gains."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from actuator.linear.derivatives.build_sampled import sampled_gain_model
from actuator.linear.derivatives.continuous import GainModel, Response, gain_model
from actuator.linear.derivatives.sampled import SampledGainModel
from actuator.linear.operating_point import OperatingPoint
from controllers.loop import PREFIX
from studies.tuning.plant import loops_of

FREQUENCIES = 2 * np.pi * np.logspace(-1.5, 3.5, 240)  # rad/s
NYQUIST = 1 - 1e-3  # part of the Nyquist frequency, the end of the grid of a sampled loop


@dataclass(frozen=True, eq=False)
class Curves:
    """A linear model over a grid of frequencies.

    Attributes
    ----------
    model : GainModel or SampledGainModel
        With its derivatives by the gains.
    """

    model: GainModel | SampledGainModel = field(repr=False)

    @property
    def sampled(self) -> bool:
        """Whether the model ends at a Nyquist frequency."""
        return math.isfinite(self.model.highest())

    def frequencies(self, at: str | None = None) -> np.ndarray:
        """The grid [rad/s]: with a sampled controller up to the Nyquist frequency of a signal, or of all signals."""
        end = self.model.highest(at) * NYQUIST
        return FREQUENCIES if end > FREQUENCIES[-1] else np.append(FREQUENCIES[end > FREQUENCIES], end)

    def loop(self, at: str) -> np.ndarray:
        """Loop transfer on its grid, opened at a signal."""
        return self.model.loops(at, self.frequencies(at))

    def response(self, given: str, seen: str) -> np.ndarray:
        """Response of an output to an input, on the common grid."""
        return self.model.responses(given, seen, self.frequencies())

    def spacing(self, step: float) -> float:
        """The time step [s] next to this one for which there is a step response."""
        return self.model.spacing(step)


def curves_at(point: OperatingPoint, gains: Mapping[str, float], resting: OperatingPoint | None = None) -> Curves:
    """The linear model of a point with its derivatives by gains; `resting` as for `gain_model`."""
    system = point.system
    loops = loops_of(system)
    inputs = ("reference", "load_torque", *(PREFIX + name for name in loops))
    known = [quantity.name for quantity in system.outputs]
    outputs = tuple(name for name in ("load_angle", "motor_torque", "current", *loops) if name in known)
    make = sampled_gain_model if system.clocks else gain_model
    return Curves(make(point, tuple(gains), inputs, outputs, resting=resting))


# -- margins ----------------------------------------------------------------------------------------------

NO_CROSSING = math.log(100.0)  # |ln| of a gain margin without a crossing
ZERO_GAIN = 1e-6  # a smaller loop gain is zero
NEWTON_STEPS = 30  # where one leaves its interval, that is bisected instead
CROSSING_ERROR = 1e-6  # a larger one is a jump between loci, not a crossing


class Distance(NamedTuple):
    """Distance of a loop from instability in one respect, with its derivatives by the gains."""

    size: float
    slopes: np.ndarray


def gain_margin(curves: Curves, at: str) -> Distance:
    """|ln| of the nearest factor on the gain, up or down, that makes the loop unstable."""
    frequencies, values = curves.frequencies(at), curves.loop(at)
    best = Distance(NO_CROSSING, np.zeros(len(curves.model.gains)))
    crosses = (np.imag(values[:-1]) * np.imag(values[1:]) < 0) & (np.real(values[:-1]) < -ZERO_GAIN)
    found = [_refine(curves, at, frequencies[k : k + 2], _real)[1] for k in np.flatnonzero(crosses).tolist()]
    crossings = [(each, False) for each in found if abs(_real(each)[0]) < CROSSING_ERROR * abs(each.value[0])]
    if curves.sampled:  # the loop is real at the Nyquist frequency of its signal, and mirrored beyond
        crossings.append((curves.model.loop(at, [frequencies[-1]]), True))
    for response, fixed in crossings:
        level = np.real(response.value[0])
        if level > -ZERO_GAIN:
            continue
        along = 0.0 if fixed else np.imag(response.slopes[0]) / np.imag(response.by_frequency[0])
        slopes = (np.real(response.slopes[0]) - np.real(response.by_frequency[0]) * along) / level
        size = math.log(-level)
        if abs(size) < best.size:
            best = Distance(abs(size), math.copysign(1.0, size) * slopes)
    return best


def phase_and_delay_margin(curves: Curves, at: str) -> tuple[Distance, Distance]:
    """The smallest lag or lead [rad], and the smallest delay [s], that make the loop unstable.

    Both are negative for an unstable loop, at the nearest crossing. Without a crossing the phase is pi and the delay
    infinite; for an unstable loop the delay is zero, as no delay makes it stable.
    """
    frequencies, values, stable = curves.frequencies(at), curves.loop(at), curves.model.stable
    sign, none = (1.0 if stable else -1.0), np.zeros(len(curves.model.gains))
    phase, delay = Distance(sign * math.pi, none), Distance(math.inf if stable else -math.inf, none)
    for k in np.flatnonzero((abs(values[:-1]) - 1) * (abs(values[1:]) - 1) < 0).tolist():
        w, found = _refine(curves, at, frequencies[k : k + 2], _unity)
        value = found.value[0]
        if abs(abs(value) - 1) > CROSSING_ERROR:
            continue
        lag = (math.pi + float(np.angle(value)) + math.pi) % (2 * math.pi) - math.pi
        change, by_frequency = found.slopes[0] / value, found.by_frequency[0] / value
        shift = -np.real(change) / np.real(by_frequency)  # of the crossing
        slopes = np.imag(change) + np.imag(by_frequency) * shift
        if abs(lag) < abs(phase.size):
            phase = Distance(sign * abs(lag), sign * math.copysign(1.0, lag) * slopes)
        # a delay only lags: where a lead is nearest, it takes the rest of the turn
        later = lag % (2 * math.pi) if stable else -abs(lag)
        turn = slopes if stable else -math.copysign(1.0, lag) * slopes
        if abs(later / w) < abs(delay.size):
            delay = Distance(later / w, (turn - later / w * shift) / w)
    return phase, delay if math.isfinite(delay.size) or stable else Distance(0.0, none)


def _real(response: Response) -> tuple[float, float]:
    return np.imag(response.value[0]), np.imag(response.by_frequency[0])


def _unity(response: Response) -> tuple[float, float]:
    value = response.value[0]
    return abs(value) - 1, np.real(response.by_frequency[0] * value.conj()) / abs(value)


def _refine(
    curves: Curves, at: str, interval: np.ndarray, crossing: Callable[[Response], tuple[float, float]]
) -> tuple[float, Response]:
    """The frequency in an interval where a function of the loop crosses zero, and the loop there (Newton's method)."""
    low, high = map(float, interval)
    start = crossing(curves.model.loop(at, [low]))[0]
    w = math.sqrt(low * high)
    for _ in range(NEWTON_STEPS):
        value, slope = crossing(curves.model.loop(at, [w]))
        low, high = (w, high) if value * start > 0 else (low, w)
        after = w - value / slope if slope else w
        w, before = (after if low <= after <= high else (low + high) / 2), w
        if abs(w - before) < 1e-12 * w:  # noqa: PLR2004 - rounding
            break
    return w, curves.model.loop(at, [w])
