"""References that a drive can follow: limited in rate, and in rate and acceleration."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import casadi as ca

from controllers.memory import LawWithMemory, Memory
from controllers.shapes import saturate
from controllers.units import SignalAcceleration, SignalRate, Time
from gear.quantities import Scalar, check
from gear.quantities.registry import part

TINY = 1e-300  # keeps a division finite whose result is multiplied by zero


class Motion(NamedTuple):
    """A reference with its derivatives, for feed-forward."""

    value: Scalar  # [signal]
    rate: Scalar  # [signal/s]
    acceleration: Scalar  # [signal/s^2]


class ReferenceLimit(LawWithMemory, Protocol):
    """A reference that a drive can follow: memory of a unit and a usual size, one input."""

    def motion(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Motion:
        """Limited signal with its derivatives."""
        ...


@part(ReferenceLimit)
@dataclass(frozen=True, kw_only=True)
class RateLimit:
    """Follows its input no faster than a rate.

        continuous:  y' = (u - y)/time within +-rate,     sampled:  y <- y + (u - y within +-rate period)

    Parameters
    ----------
    rate : float
        [signal/s].
    time : float
        Lag of the continuous form [s]; the sampled one reaches a slow input at once.

    References
    ----------
    Modelica Standard Library, Modelica.Blocks.Nonlinear.SlewRateLimiter.
    """

    rate: SignalRate
    time: Time = 1e-3

    def __post_init__(self) -> None:
        check(self)

    def memory(self, unit: str = "signal", nominal: float = 1.0) -> tuple[Memory, ...]:
        """The limited signal."""
        return (Memory("limited", unit, nominal),)

    def motion(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Motion:
        """Limited signal and its rate; the acceleration is left at zero."""
        if period is None:
            return Motion(memory[0], saturate((signal - memory[0]) / self.time, self.rate), 0.0)
        step = saturate(signal - memory[0], self.rate * period)
        return Motion(memory[0] + step, step / period, 0.0)

    def output(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Scalar:
        """Limited signal."""
        return self.motion(memory, signal, period).value

    def rates(self, memory: list[Scalar], signal: Scalar) -> list[Scalar]:
        """Continuous form."""
        return [self.motion(memory, signal).rate]

    def advance(self, memory: list[Scalar], signal: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        return [self.motion(memory, signal, period).value]


@part(ReferenceLimit)
@dataclass(frozen=True, kw_only=True)
class RateAndAccelerationLimit:
    """Follows its input within a rate and an acceleration, and stops on it without overshoot.

    With d = u - y, the rate v approaches from below the braking curve w(d), from which the acceleration
    brings it to rest just at the input; near the input the curve is a straight line:

        w(d) = d/time                                               |d| < acceleration time^2
        w(d) = sign(d) sqrt(acceleration (2 |d| - acceleration time^2))    beyond, within +-rate
        y' = v,     v' = -w'(d) v + (w(d) - v)/time, within +-acceleration

    As (w - v)' = -(w - v)/time below the limit, v never crosses the curve, nor y a constant input.

    Sampled, v falls by at most acceleration period in each sample. The largest v that still stops on the input
    does so after m samples, the smallest m with acceleration period^2 m (m + 1)/2 >= |d|:

        w(d) = sign(d) (|d|/(m period) + acceleration period (m - 1)/2) within +-rate
        v <- v + (w(d) - v within +-acceleration period),     y <- y + period v

    A moving input is followed at the distance that braking takes. One that comes closer than that while y brakes
    is passed, as nothing within the limits stops earlier.

    Parameters
    ----------
    rate : float
        [signal/s].
    acceleration : float
        [signal/s^2].
    time : float
        Lag of the continuous form [s].

    References
    ----------
    R. Zanasi, C. Guarino Lo Bianco, A. Tonielli, "Nonlinear filters for the generation of smooth trajectories",
    Automatica 36 (2000) 439-448.
    """

    rate: SignalRate
    acceleration: SignalAcceleration
    time: Time = 1e-3

    def __post_init__(self) -> None:
        check(self)

    def memory(self, unit: str = "signal", nominal: float = 1.0) -> tuple[Memory, ...]:
        """The limited signal and its rate."""
        return (Memory("limited", unit, nominal), Memory("limited_rate", f"{unit}/s", nominal))

    def motion(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Motion:
        """Limited signal, its rate and its acceleration."""
        value, rate = memory
        if period is None:
            return Motion(value, rate, self._braking(signal - value, rate))
        change = saturate(self._stopping_rate(signal - value, period) - rate, self.acceleration * period)
        return Motion(value + period * (rate + change), rate + change, change / period)

    def output(self, memory: list[Scalar], signal: Scalar, period: Scalar | None = None) -> Scalar:
        """Limited signal."""
        return self.motion(memory, signal, period).value

    def rates(self, memory: list[Scalar], signal: Scalar) -> list[Scalar]:
        """Continuous form."""
        motion = self.motion(memory, signal)
        return [motion.rate, motion.acceleration]

    def advance(self, memory: list[Scalar], signal: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        motion = self.motion(memory, signal, period)
        return [motion.value, motion.rate]

    def _braking(self, distance: Scalar, rate: Scalar) -> Scalar:
        straight = self.acceleration * self.time**2
        root = ca.sqrt(self.acceleration * (2 * ca.fmax(ca.fabs(distance), straight) - straight))
        curve = saturate(distance, straight) * root / straight
        slope = self.acceleration / root * (ca.fabs(curve) < self.rate)
        return saturate((saturate(curve, self.rate) - rate) / self.time - slope * rate, self.acceleration)

    def _stopping_rate(self, distance: Scalar, period: Scalar) -> Scalar:
        step = self.acceleration * period  # of the rate in a sample
        count = ca.fmax(1, ca.ceil((ca.sqrt(1 + 8 * ca.fabs(distance) / (step * period)) - 1) / 2))
        size = ca.fabs(distance) / (count * period) + step * (count - 1) / 2
        return saturate(size, self.rate) * distance / ca.fmax(ca.fabs(distance), TINY)
