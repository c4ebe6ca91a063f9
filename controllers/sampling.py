"""Periods of the loops of a sampled controller."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from controllers.units import Time
from gear.quantities import Scalar, check

SERVO_LOOPS = ("current", "speed", "position")  # those with a field of their own, from the inside out
SAME_PERIOD = 1e-9  # relative: periods such as 1/3 ms are not whole multiples to the last bit


@dataclass(frozen=True, kw_only=True)
class LoopPeriod:
    """Period of a loop that only its controller knows.

    Parameters
    ----------
    period : float
        [s].
    """

    period: Time

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """Periods of the loops of a controller, each a whole multiple of the next faster one.

    Every `every(loop)` ticks of the base period a loop takes its samples, and holds its output until the next
    time. A period decides when clocks tick, so it is part of the structure of a model and no parameter to vary.

    Parameters
    ----------
    current, speed, position : float or None
        Periods [s]; None for a loop that is not there: a single PID has a position period only.
    others : mapping of str to LoopPeriod
        Of loops by other names, outside of those, from the inside out.
    delay : int
        Time for computing, in periods of the fastest loop: 0 or 1.

    Raises
    ------
    ValueError
        Where the periods do not nest.
    """

    current: Time | None = None
    speed: Time | None = None
    position: Time | None = None
    others: Mapping[str, LoopPeriod] = field(default_factory=dict)
    delay: int = 1

    def __post_init__(self) -> None:
        check(self)
        if isinstance(self.delay, bool) or self.delay not in (0, 1):
            raise ValueError(f"Sampling.delay must be 0 or 1 periods of the fastest loop, got {self.delay!r}")
        for name in SERVO_LOOPS:
            if name in self.others:
                raise ValueError(f"Sampling.others.{name} is the field {name} of Sampling; give it there")
        periods = {name: self.period(name) for name in self.loops()}
        if not periods:
            raise ValueError("Sampling needs the period of at least one loop [s]: current, speed or position")
        for (inner, fast), (outer, slow) in zip(periods.items(), list(periods.items())[1:], strict=False):
            multiple = slow / fast
            if abs(multiple - round(multiple)) > SAME_PERIOD * multiple:
                raise ValueError(
                    f"Sampling: periods must nest: {outer} {slow:.6g} s is {multiple:.6g} times {inner} {fast:.6g} s; "
                    "make it a whole multiple"
                )

    def loops(self) -> tuple[str, ...]:
        """Names of the loops that have a period, from the inside out."""
        return (*(name for name in SERVO_LOOPS if getattr(self, name) is not None), *self.others)

    def period(self, loop: str) -> Scalar:
        """Period of a loop [s].

        Raises
        ------
        ValueError
            For a loop without a period.
        """
        if loop not in self.loops():
            raise ValueError(f"Sampling has no period for {loop!r}, only for {', '.join(self.loops())}")
        return self.others[loop].period if loop in self.others else getattr(self, loop)

    @property
    def base(self) -> Scalar:
        """Period of the fastest loop [s]."""
        return self.period(self.loops()[0])

    def every(self, loop: str) -> int:
        """How many base periods lie between two samples of a loop."""
        return round(self.period(loop) / self.base)
