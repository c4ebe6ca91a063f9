"""Filters: low-pass, notch, lead-lag, in continuous time and by Tustin's rule exact at one frequency.

Tustin's rule integrates x' = f(x, u) by trapezoids. Between the samples the memory z stands half a step
behind, which makes the rule explicit in z and leaves z = x at rest:

    x = z + a f(x, u),     z <- x + a f(x, u) = 2 x - z,     a = tan(frequency period/2) / frequency

With that half step a (period/2 for low frequencies) the sampled filter has exactly the gain and phase of the
continuous one at `frequency`.

References
----------
K. J. Astrom, B. Wittenmark, "Computer-Controlled Systems" (1997), section 8.2.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import casadi as ca

from controllers.memory import LawWithMemory, Memory
from controllers.units import DampingRatio, Frequency, ShareBelowOne
from gear.quantities import Scalar, check, is_number
from gear.quantities.registry import part


def half_step(frequency: Scalar, period: Scalar) -> Scalar:
    """Half step [s] of Tustin's rule that is exact at `frequency` [rad/s].

    Raises
    ------
    ValueError
        Where numbers are given and the samples are too slow for that frequency.
    """
    if is_number(frequency) and is_number(period) and not 0 < frequency * period < math.pi:
        raise ValueError(
            f"filter: {frequency:.6g} rad/s needs more than two samples a cycle, a period below "
            f"{math.pi / frequency:.6g} s, got {period:.6g} s; sample faster or set prewarp to a lower frequency"
        )
    return ca.tan(frequency * period / 2) / frequency


class Filter(LawWithMemory, Protocol):
    """What shapes a signal in a loop: memory of a unit and a usual size, one input."""


@part(Filter)
@dataclass(frozen=True, kw_only=True)
class LowPass:
    """First-order low-pass.

        y = x,     x' = frequency (u - x)

    Parameters
    ----------
    frequency : float
        Corner, where the gain is 1/sqrt(2) [rad/s].
    prewarp : float or None
        Frequency [rad/s] at which the sampled form is exact; None for the corner.
    """

    frequency: Frequency
    prewarp: Frequency | None = None

    def __post_init__(self) -> None:
        check(self)

    def memory(self, unit: str = "signal", nominal: float = 1.0) -> tuple[Memory, ...]:
        """The filtered signal."""
        return (Memory("filtered", unit, nominal),)

    def output(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Scalar:
        """Filtered signal."""
        if period is None:
            return memory[0]
        step = self.frequency * half_step(self.frequency if self.prewarp is None else self.prewarp, period)
        return (memory[0] + step * signal) / (1 + step)

    def rates(self, memory: list[Scalar], signal: Scalar) -> list[Scalar]:
        """Continuous form."""
        return [self.frequency * (signal - memory[0])]

    def advance(self, memory: list[Scalar], signal: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        return [2 * self.output(memory, signal, period) - memory[0]]


@part(Filter)
@dataclass(frozen=True, kw_only=True)
class LeadLag:
    """Lead (zero below pole) or lag (pole below zero) with gain 1 at low frequency.

        y = (s/zero + 1) / (s/pole + 1) u:     y = x + pole/zero (u - x),     x' = pole (u - x)

    Parameters
    ----------
    zero, pole : float
        [rad/s].
    prewarp : float or None
        Frequency [rad/s] at which the sampled form is exact; None for sqrt(zero pole), where the phase is
        largest.
    """

    zero: Frequency
    pole: Frequency
    prewarp: Frequency | None = None

    def __post_init__(self) -> None:
        check(self)

    def _lag(self, memory: list[Scalar], signal: Scalar, period: Scalar | None) -> Scalar:
        if period is None:
            return memory[0]
        step = self.pole * half_step(ca.sqrt(self.zero * self.pole) if self.prewarp is None else self.prewarp, period)
        return (memory[0] + step * signal) / (1 + step)

    def memory(self, unit: str = "signal", nominal: float = 1.0) -> tuple[Memory, ...]:
        """The signal behind the pole."""
        return (Memory("lagged", unit, nominal),)

    def output(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Scalar:
        """Filtered signal."""
        lag = self._lag(memory, signal, period)
        return lag + self.pole / self.zero * (signal - lag)

    def rates(self, memory: list[Scalar], signal: Scalar) -> list[Scalar]:
        """Continuous form."""
        return [self.pole * (signal - memory[0])]

    def advance(self, memory: list[Scalar], signal: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        return [2 * self._lag(memory, signal, period) - memory[0]]


@part(Filter)
@dataclass(frozen=True, kw_only=True)
class SecondOrderLowPass:
    """Second-order low-pass.

        y = x,     x' = frequency v,     v' = frequency (u - x - 2 damping v)

    Parameters
    ----------
    frequency : float
        Natural frequency [rad/s].
    damping : float
        Damping ratio [-]; 1/sqrt(2) is the Butterworth filter.
    prewarp : float or None
        Frequency [rad/s] at which the sampled form is exact; None for the natural frequency.
    """

    frequency: Frequency
    damping: DampingRatio = math.sqrt(0.5)
    prewarp: Frequency | None = None

    def __post_init__(self) -> None:
        check(self)

    def memory(self, unit: str = "signal", nominal: float = 1.0) -> tuple[Memory, ...]:
        """The filtered signal and its scaled rate."""
        return (Memory("filtered", unit, nominal), Memory("filtered_rate", unit, nominal))

    def output(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Scalar:
        """Filtered signal."""
        return _resonator(self, memory, signal, period)[0]

    def rates(self, memory: list[Scalar], signal: Scalar) -> list[Scalar]:
        """Continuous form."""
        return _resonator_rates(self, memory, signal)

    def advance(self, memory: list[Scalar], signal: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        return [2 * x - z for x, z in zip(_resonator(self, memory, signal, period), memory, strict=True)]


@part(Filter)
@dataclass(frozen=True, kw_only=True)
class Notch:
    """Notch: takes out one frequency and leaves those far from it.

        y = (s^2 + 2 depth damping frequency s + frequency^2) / (s^2 + 2 damping frequency s + frequency^2) u

    Parameters
    ----------
    frequency : float
        Of the notch [rad/s].
    damping : float
        Of the poles [-]; the notch is 2 damping frequency wide.
    depth : float
        Gain that is left at the notch [-], 0 for none, below 1.
    prewarp : float or None
        Frequency [rad/s] at which the sampled form is exact; None for the notch.
    """

    frequency: Frequency
    damping: DampingRatio
    depth: ShareBelowOne = 0.0
    prewarp: Frequency | None = None

    def __post_init__(self) -> None:
        check(self)

    def memory(self, unit: str = "signal", nominal: float = 1.0) -> tuple[Memory, ...]:
        """The low-passed signal and its scaled rate."""
        return (Memory("filtered", unit, nominal), Memory("filtered_rate", unit, nominal))

    def output(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Scalar:
        """Filtered signal: what passes the band round the notch is taken from it."""
        return signal - 2 * self.damping * (1 - self.depth) * _resonator(self, memory, signal, period)[1]

    def rates(self, memory: list[Scalar], signal: Scalar) -> list[Scalar]:
        """Continuous form."""
        return _resonator_rates(self, memory, signal)

    def advance(self, memory: list[Scalar], signal: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        return [2 * x - z for x, z in zip(_resonator(self, memory, signal, period), memory, strict=True)]


def _resonator_rates(law: SecondOrderLowPass | Notch, memory: list[Scalar], signal: Scalar) -> list[Scalar]:
    x, v = memory
    return [law.frequency * v, law.frequency * (signal - x - 2 * law.damping * v)]


def _resonator(
    law: SecondOrderLowPass | Notch, memory: list[Scalar], signal: Scalar, period: Scalar | None
) -> list[Scalar]:
    """State now: x = z + a f(x, u) solved for the two of them."""
    if period is None:
        return memory
    step = law.frequency * half_step(law.frequency if law.prewarp is None else law.prewarp, period)
    right_x, right_v = memory[0], memory[1] + step * signal
    loss = 1 + 2 * law.damping * step
    determinant = loss + step**2
    return [(loss * right_x + step * right_v) / determinant, (right_v - step * right_x) / determinant]
