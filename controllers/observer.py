"""Observers: the torque nobody measures, and speed from position.

All take the exact step for inputs that are held over a sample, so their poles are exp(-bandwidth period).
"""

from dataclasses import dataclass
from typing import Annotated, Protocol

import casadi as ca

from controllers.memory import LawWithMemory, Memory
from controllers.shapes import closing_rate
from controllers.units import Frequency, Inertia, Time
from gear.quantities import Scalar, check
from gear.quantities.registry import part
from gear.quantities.roles import IntegralGain


@dataclass(frozen=True, kw_only=True)
class DisturbanceObserver:
    """First-order observer of the torque on a motor that is not its own, from motor torque and speed.

        inertia w' = torque + d
        d_hat      = z + g inertia w,     z' = -g (d_hat + torque)      so that     d_hat' = g (d - d_hat)

    with g = bandwidth, and (1 - exp(-bandwidth period))/period for the sampled form. Subtracted from the torque
    demand, the estimate makes the drive one of the nominal inertia below the bandwidth.

    Parameters
    ----------
    inertia : float
        Nominal inertia seen by the motor [kg m^2].
    bandwidth : float
        Of the estimate [rad/s].

    References
    ----------
    K. Ohnishi, M. Shibata, T. Murakami, "Motion control for advanced mechatronics", IEEE/ASME Transactions on
    Mechatronics 1 (1996) 56-67.
    """

    inertia: Inertia
    bandwidth: Annotated[Frequency, IntegralGain()]

    def __post_init__(self) -> None:
        check(self)

    def memory(self, nominal: float = 1.0) -> tuple[Memory, ...]:
        """The estimate less the momentum part; at speed w and rest of the estimate, -g inertia w."""
        return (Memory("disturbance", "N m", nominal),)

    def output(self, memory: list[Scalar], torque: Scalar, speed: Scalar, period: Scalar | None = None) -> Scalar:
        """Estimated torque [N m] of load and friction on the motor; the present motor torque is not needed."""
        return memory[0] + closing_rate(self.bandwidth, period) * self.inertia * speed

    def rates(self, memory: list[Scalar], torque: Scalar, speed: Scalar) -> list[Scalar]:
        """Continuous form, from the realized motor torque [N m] and the motor speed [rad/s]."""
        return [-self.bandwidth * (self.output(memory, torque, speed) + torque)]

    def advance(self, memory: list[Scalar], torque: Scalar, speed: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form; `torque` [N m] is the one realized until the next sample."""
        share = closing_rate(self.bandwidth, period) * period
        return [memory[0] - share * (self.output(memory, torque, speed, period) + torque)]


class SpeedEstimator(LawWithMemory, Protocol):
    """Speed of the motor [rad/s] from its measured angle [rad]: memory of a unit and a usual size, one input."""


@part(SpeedEstimator)
@dataclass(frozen=True, kw_only=True)
class FilteredDerivative:
    """Speed from position by a derivative with one lag.

        speed = g (y - x),     x' = speed,     g = 1/time, sampled (1 - exp(-period/time))/period

    Parameters
    ----------
    time : float
        Lag [s].
    """

    time: Time

    def __post_init__(self) -> None:
        check(self)

    def memory(self, unit: str = "rad", nominal: float = 1e-3) -> tuple[Memory, ...]:
        """The position that lags behind."""
        return (Memory("filtered_position", unit, nominal),)

    def output(self, memory: list[Scalar], position: Scalar, period: Scalar | None = None) -> Scalar:
        """Speed."""
        return closing_rate(1 / self.time, period) * (position - memory[0])

    def rates(self, memory: list[Scalar], position: Scalar) -> list[Scalar]:
        """Continuous form."""
        return [self.output(memory, position)]

    def advance(self, memory: list[Scalar], position: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        return [memory[0] + period * self.output(memory, position, period)]


@part(SpeedEstimator)
@dataclass(frozen=True, kw_only=True)
class PositionObserver:
    """Speed from position by second-order tracking, without lag at constant speed.

        e = y - x,     x' = w + 2 bandwidth e,     w' = bandwidth^2 e

    Sampled, with p = exp(-bandwidth period), both poles at p:

        x <- x + period w + 2 (1 - p) e,     w <- w + (1 - p)^2/period e

    Parameters
    ----------
    bandwidth : float
        Both poles [rad/s].

    References
    ----------
    L. Harnefors, H.-P. Nee, "A general algorithm for speed and position estimation of AC motors", IEEE
    Transactions on Industrial Electronics 47 (2000) 77-83.
    """

    bandwidth: Frequency

    def __post_init__(self) -> None:
        check(self)

    def memory(self, unit: str = "rad", nominal: float = 1e-3) -> tuple[Memory, ...]:
        """Estimated position and speed."""
        return (Memory("estimated_position", unit, nominal), Memory("estimated_speed", f"{unit}/s", 1.0))

    def output(self, memory: list[Scalar], position: Scalar, period: Scalar | None = None) -> Scalar:
        """Speed."""
        return memory[1]

    def rates(self, memory: list[Scalar], position: Scalar) -> list[Scalar]:
        """Continuous form."""
        error = position - memory[0]
        return [memory[1] + 2 * self.bandwidth * error, self.bandwidth**2 * error]

    def advance(self, memory: list[Scalar], position: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        error, share = position - memory[0], 1 - ca.exp(-self.bandwidth * period)
        return [memory[0] + period * memory[1] + 2 * share * error, memory[1] + share**2 / period * error]
