"""Periods of the loops of a sampled controller."""

from dataclasses import dataclass
from typing import Literal

from controllers.units import Time
from gear.quantities import check

Loop = Literal["current", "speed", "position"]
LOOPS: tuple[Loop, ...] = ("current", "speed", "position")  # from the inside out
SAME_PERIOD = 1e-9  # relative: periods such as 1/3 ms are not whole multiples to the last bit


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """Periods of the loops of a cascade, each a whole multiple of the next faster one.

    Every `every(loop)` ticks of the base period a loop takes its samples, and holds its output until the next
    time. A period decides when clocks tick, so it is part of the structure of a model and no parameter to vary.

    Parameters
    ----------
    current, speed, position : float or None
        Periods [s]; None for a loop that is not there: a single PID has a position period only.
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
    delay: int = 1

    def __post_init__(self) -> None:
        check(self)
        if isinstance(self.delay, bool) or self.delay not in (0, 1):
            raise ValueError(f"Sampling.delay must be 0 or 1 periods of the fastest loop, got {self.delay!r}")
        periods = self._periods()
        if not periods:
            raise ValueError("Sampling needs the period of at least one loop [s]: current, speed or position")
        for (inner, fast), (outer, slow) in zip(periods.items(), list(periods.items())[1:], strict=False):
            multiple = slow / fast
            if abs(multiple - round(multiple)) > SAME_PERIOD * multiple:
                raise ValueError(
                    f"Sampling: periods must nest: {outer} {slow:.6g} s is {multiple:.6g} times {inner} {fast:.6g} s; "
                    "make it a whole multiple"
                )

    def _periods(self) -> dict[Loop, float]:
        return {loop: getattr(self, loop) for loop in LOOPS if getattr(self, loop) is not None}

    @property
    def base(self) -> float:
        """Period of the fastest loop [s]."""
        return next(iter(self._periods().values()))

    def every(self, loop: Loop) -> int:
        """How many base periods lie between two samples of a loop.

        Raises
        ------
        ValueError
            For a loop without a period.
        """
        periods = self._periods()
        if loop not in periods:
            raise ValueError(f"Sampling has no period for {loop!r}, only for {', '.join(periods)}")
        return round(periods[loop] / self.base)
