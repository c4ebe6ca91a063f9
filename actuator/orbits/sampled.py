"""Periodic orbits under sampled control: fixed points of the map over a whole number of ticks.

A clock that goes on ticking belongs to the system, so an orbit closes only after a whole number of ticks, and a shift
in time is no symmetry any more:

    P(x) - x = 0,     P: from before one tick to before the tick N later

What would be the trivial multiplier 1 is now a number like the others, and tells something new: how the cycle moves
against the clock. Between the slips of a stiction cycle the integral grows in steps, so a slip begins up to one step
late, and the next one depends on how late. With that multiplier outside the unit circle the cycle goes on, but its
period jitters by about a tick; the other multipliers say whether the cycle itself is stable.

References
----------
M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, "Piecewise-smooth Dynamical Systems" (2008), chapter 2.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from actuator.orbits.tick_map import TOLERANCE
from actuator.simulation.run import ModeChange, Run
from actuator.simulation.simulate import simulate
from actuator.system.hybrid import HybridSystem


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledOrbit:
    """A periodic orbit of a system with sampled controllers at constant inputs.

    Attributes
    ----------
    system : HybridSystem
        To which it belongs.
    u, p : ndarray
        Inputs and parameters.
    ticks : int
        Of the fastest clock in one period.
    x0, m0 : ndarray
        State and modes before the tick at which it starts.
    residual : float
        Largest difference of a state after one period from the start, over its nominal size.
    multipliers : ndarray of complex
        Of the map over one period, without the one that belongs to the clock, largest first.
    clock_multiplier : complex
        What becomes of a shift against the clock in one period.
    """

    system: HybridSystem = field(repr=False)
    u: np.ndarray = field(repr=False)
    p: np.ndarray = field(repr=False)
    ticks: int
    x0: np.ndarray = field(repr=False)
    m0: np.ndarray = field(repr=False)
    residual: float
    multipliers: np.ndarray
    clock_multiplier: complex

    @property
    def period(self) -> float:
        """[s]."""
        return self.ticks * self.system.tick_period(self.p)

    @property
    def stable(self) -> bool:
        """Whether the cycle persists: all multipliers but that of the clock lie inside the unit circle."""
        return bool((abs(self.multipliers) < 1).all())

    @property
    def jitters(self) -> bool:
        """Whether it moves against the clock, so that its period changes from cycle to cycle by about a tick."""
        return abs(self.clock_multiplier) > 1

    @cached_property
    def run(self) -> Run:
        """One period from its start."""
        start = {q.name: float(value) for q, value in zip(self.system.states, self.x0, strict=True)}
        return continued(self.system, start, self.u, self.p, self.period, None)

    @property
    def events(self) -> tuple[ModeChange, ...]:
        """Mode changes of the contacts in one period, with their times after its start [s]."""
        return self.run.changes

    @property
    def stick_fraction(self) -> float:
        """Part of the period in which every contact is stuck."""
        return self.run.stuck_share(0.0, self.period)

    @property
    def load_amplitude(self) -> float:
        """Half of peak to peak at the load [rad]."""
        return float(np.ptp(self.run["load_angle"]) / 2)

    @property
    def motor_amplitude(self) -> float:
        """Half of peak to peak at the motor [rad]."""
        return float(np.ptp(self.run["motor_angle"]) / 2)


def continued(  # noqa: PLR0913, PLR0917 - from where, with what, how long
    system: HybridSystem,
    start: Mapping[str, float],
    u: np.ndarray,
    p: np.ndarray,
    duration: float,
    compiled: bool | None,
) -> Run:
    """A run with an output point at every tick."""
    changed = {q.name: float(value) for q, value in zip(system.parameters, p, strict=True) if value != q.default}
    return simulate(
        system,
        duration,
        inputs={quantity.name: float(value) for quantity, value in zip(system.inputs, u, strict=True)},
        start=start,
        parameters=changed,
        resolution=system.tick_period(p),
        tolerance=TOLERANCE,
        compiled=compiled,
    )
