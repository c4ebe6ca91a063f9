"""Remedies against stiction at the output of a law: friction compensation, dither, knocker pulses.

Each gives an output (a torque, where the law's output is one) that is added to the demand.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import casadi as ca

from controllers.memory import Memory
from controllers.shapes import direction
from controllers.units import Amplitude, ErrorBand, ErrorWidth, Frequency, Level, Speed, Time
from gear.quantities import Scalar, check, check_choice
from gear.quantities.roles import Breakaway, Compensates

Shape = Literal["sine", "square"]
SHAPES: tuple[Shape, ...] = ("sine", "square")
SAME_PHASE = 1e-9  # of a cycle: phases that are summed up sample by sample still meet the edges of a pulse


@dataclass(frozen=True, kw_only=True)
class FrictionCompensation:
    """Dry friction compensated by its direction of motion, with a boost to break away.

        output = coulomb * d + breakaway * (1 - |d|) * direction(error),     d = speed/standstill within +-1

    Moving, the friction is that of the motion; at standstill it opposes what the error asks for. `direction`
    is zero within +-dead_band, so a drive near its target is left alone, and 1 from dead_band + width on.

    Parameters
    ----------
    coulomb : float
        Level while moving [output]; less than the true one, or the drive is pushed on by itself.
    breakaway : float
        Level at standstill [output].
    standstill : float
        Speed from which on the drive moves [rad/s].
    dead_band, width : float
        Of the error [error].
    """

    coulomb: Level
    breakaway: Annotated[Level, Compensates(Breakaway)]
    standstill: Speed
    width: ErrorWidth
    dead_band: ErrorBand = 0.0

    def __post_init__(self) -> None:
        check(self)

    def output(self, speed: Scalar, error: Scalar) -> Scalar:
        """Output to add, from the measured speed [rad/s] and the error."""
        moving = direction(speed, 0.0, self.standstill)
        boost = self.breakaway * (1 - ca.fabs(moving)) * direction(error, self.dead_band, self.width)
        return self.coulomb * moving + boost


@dataclass(frozen=True, kw_only=True)
class Dither:
    """A small fast oscillation that keeps contacts moving.

        output = amplitude sin(2 pi phase)    or    +-amplitude,     phase' = frequency / (2 pi)

    The edges of the square one are events that only a sampled controller has; in continuous time the
    integration meets them unprepared.

    Parameters
    ----------
    amplitude : float
        [output].
    frequency : float
        [rad/s].
    shape : "sine" or "square"
        Of the oscillation.
    """

    amplitude: Amplitude
    frequency: Frequency
    shape: Shape = "sine"

    def __post_init__(self) -> None:
        check(self)
        check_choice(self, "shape", SHAPES)

    def check_period(self, period: float) -> None:
        """Raise ValueError where samples [s] are too slow for the oscillation."""
        if not 0 < self.frequency * period <= math.pi:
            raise ValueError(
                f"Dither of {self.frequency:.6g} rad/s needs two samples a cycle, a period of at most "
                f"{math.pi / self.frequency:.6g} s, got {period:.6g} s"
            )

    def memory(self) -> tuple[Memory, ...]:
        """The phase, in cycles."""
        return (Memory("phase", "-", 1.0),)

    def output(self, memory: list[Scalar], period: Scalar | None = None) -> Scalar:
        """Output to add."""
        if self.shape == "sine":
            return self.amplitude * ca.sin(2 * math.pi * memory[0])
        cycle = _fraction(memory[0])
        return self.amplitude * (1 - 2 * (cycle >= 0.5 - SAME_PHASE))  # noqa: PLR2004 - half a cycle

    def rates(self, memory: list[Scalar]) -> list[Scalar]:
        """Continuous form."""
        return [self.frequency / (2 * math.pi)]

    def advance(self, memory: list[Scalar], period: Scalar) -> list[Scalar]:
        """Sampled form; the phase starts again with each cycle."""
        return [_fraction(memory[0] + self.frequency * period / (2 * math.pi))]


@dataclass(frozen=True, kw_only=True)
class Knocker:
    """Short pulses in the direction of the error that knock a stuck drive loose.

        output = amplitude * sign(error)    for the first `width` of every `interval`, 0 within +-dead_band

    Hagglund gives the pulses the direction in which the controller's output has moved since the last pulse;
    for a stuck drive under integral control that is the sign of the error. A pulse is shorter than the steps
    of a continuous integration, so knocking needs a sampled controller.

    Parameters
    ----------
    amplitude : float
        [output].
    width : float
        Of a pulse [s].
    interval : float
        From pulse to pulse [s].
    dead_band : float
        Of the error, within which there are no pulses [error].

    References
    ----------
    T. Hagglund, "A friction compensator for pneumatic control valves", Journal of Process Control 12 (2002)
    897-904.
    """

    amplitude: Amplitude
    width: Time
    interval: Time
    dead_band: ErrorBand = 0.0

    def __post_init__(self) -> None:
        check(self)
        if self.width >= self.interval:
            raise ValueError(
                f"Knocker needs width < interval, got width={self.width:.6g} s and interval={self.interval:.6g} s"
            )

    def check_period(self, period: float) -> None:
        """Raise ValueError where samples [s] are longer than a pulse."""
        if not 0 < period <= self.width * (1 + SAME_PHASE):
            raise ValueError(
                f"Knocker: a pulse of {self.width:.6g} s needs a period of at most that, got {period:.6g} s"
            )

    def memory(self) -> tuple[Memory, ...]:
        """The time since the last pulse began, in intervals."""
        return (Memory("phase", "-", 1.0),)

    def output(self, memory: list[Scalar], error: Scalar, period: Scalar | None = None) -> Scalar:
        """Output to add."""
        on = _fraction(memory[0]) < self.width / self.interval - SAME_PHASE
        return self.amplitude * on * ((error > self.dead_band) - 1.0 * (error < -self.dead_band))

    def rates(self, memory: list[Scalar], error: Scalar) -> list[Scalar]:
        """Not there: see Raises.

        Raises
        ------
        ValueError
            Always.
        """
        raise ValueError("Knocker needs a sampled controller: give it a sampling, or leave the knocker out")

    def advance(self, memory: list[Scalar], error: Scalar, period: Scalar) -> list[Scalar]:
        """Sampled form."""
        return [_fraction(memory[0] + period / self.interval)]


def _fraction(phase: Scalar) -> Scalar:
    """What a phase has beyond whole cycles; one that rounding keeps just below a cycle has ended it."""
    return phase - ca.floor(phase + SAME_PHASE)
