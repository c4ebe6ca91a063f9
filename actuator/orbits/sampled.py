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

import contextlib
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from actuator.orbits.flow import NoOrbit
from actuator.orbits.orbit import Orbit
from actuator.simulation.compiled import compiled_where_wanted
from actuator.simulation.input_form import InputForm
from actuator.simulation.mode_code import ModeCode
from actuator.simulation.run import ModeChange, Run
from actuator.simulation.signals import Piece
from actuator.simulation.simulate import simulate
from actuator.simulation.window import VIOLATION, ticks_function
from actuator.system.hybrid import HybridSystem, require_sticking

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOLERANCE = 1e-11  # local error of each state over its nominal size
CHUNK, STRIDE = 200, 20  # ticks run at once, and between two points at which margins are checked
BLOCK = 4  # directions differentiated at once


@lru_cache(maxsize=8)
def tick_map(system: HybridSystem, compiled: bool | None = None) -> "TickMap":
    """The tick map of a system, built once."""
    return TickMap(system, compiled)


class TickMap:
    """The motion over a number of ticks, with its derivatives with respect to the state before the first."""

    def __init__(self, system: HybridSystem, compiled: bool | None) -> None:
        if not system.clocks:
            raise ValueError(f"{system.name} has no clock: its orbits are found by find_orbit")
        self.system = system
        self.scale = np.array([state.nominal for state in system.states])
        self._form = InputForm(len(system.inputs), 0)
        function = ticks_function(system, self._form, ModeCode(len(system.modes)), TOLERANCE, CHUNK, 1, STRIDE)
        with contextlib.redirect_stderr(io.StringIO()):  # "Event support is experimental", once per integrator
            tangent = function.forward(BLOCK)
        self._ticks, self._tangent = (compiled_where_wanted(part, compiled) or part for part in (function, tangent))

    def passage(  # noqa: PLR0913, PLR0917 - from where, with what, how far
        self, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray, ticks: int, *, derivatives: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State and modes before the tick that follows, and the derivative of the state, (nx, nx).

        Raises
        ------
        NoOrbit
            Where the engine loses an event on the way.
        """
        system, count = self.system, CHUNK
        wave = self._form.coefficients([Piece(float(value)) for value in u])
        period, moved, done = system.tick_period(p), np.eye(x.size), 0
        while done < ticks:
            n = min(count, ticks - done)
            due = system.due(done + np.arange(count))
            due[:, n:] = -1  # passed over
            known = [x, m, p, due, period, wave]
            results = self._ticks(*known)
            margins, faults, ends, end_modes = (results[k].full() for k in (3, 5, 6, 7))
            seen = math.ceil(n / STRIDE)
            if faults[0, :n].any() or (margins.size and margins[:, :seen].min() < -VIOLATION):
                raise NoOrbit(f"an event was lost {done * period:.6g} s after the start")
            if derivatives:
                moved = self._moved(known, list(results), moved, n)
            x, m, done = ends[:, n - 1], end_modes[:, n - 1], done + n
        return x, np.round(m), moved

    def _moved(self, known: list, results: list, seeds: np.ndarray, n: int) -> np.ndarray:
        """Derivatives after n ticks in the directions `seeds`, BLOCK of them at a time."""
        count, found = seeds.shape[1], []
        none = [np.zeros((np.shape(value)[0] if np.ndim(value) else 1, BLOCK)) for value in known]
        none[3] = np.zeros((known[3].shape[0], CHUNK * BLOCK))
        for k in range(0, count, BLOCK):
            part = np.pad(seeds[:, k : k + BLOCK], ((0, 0), (0, max(0, k + BLOCK - count))))
            tangents = self._tangent(*known, *results, part, *none[1:])[6].full()
            found.append(tangents[:, [j * CHUNK + n - 1 for j in range(BLOCK)]])
        return np.hstack(found)[:, :count]


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
        return continue_run(self.system, start, self.u, self.p, self.period, None)

    @property
    def events(self) -> tuple[ModeChange, ...]:
        """Mode changes of the contacts in one period, with their times after its start [s]."""
        return self.run.changes

    @property
    def stick_fraction(self) -> float:
        """Part of the period in which everything is at rest; ValueError where a friction law never sticks."""
        require_sticking(self.system, "the stuck share of an orbit")
        return self.run.stuck_share(0.0, self.period)

    @property
    def load_amplitude(self) -> float:
        """Half of peak to peak at the load [rad]."""
        return float(np.ptp(self.run["load_angle"]) / 2)

    @property
    def times(self) -> np.ndarray:
        """Of `signals`, after the start [s]."""
        return self.run.t

    def signals(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Outputs by name at `times`."""
        return {name: self.run[name] for name in names}

    @property
    def trivial_error(self) -> None:
        """None: a shift in time is no symmetry where a clock goes on ticking."""
        return

    def plot(self, names: Sequence[str] = ("motor_angle_at_load", "load_angle", "motor_torque")) -> "Figure":
        """Signals over one period above a ribbon of the contact modes."""
        return self.run.plot(names)

    @property
    def motor_amplitude(self) -> float:
        """Half of peak to peak at the motor [rad]."""
        return float(np.ptp(self.run["motor_angle"]) / 2)


PeriodicOrbit = Orbit | SampledOrbit  # asked in one way: period, amplitudes, events, signals over `times`, plot


def continue_run(  # noqa: PLR0913, PLR0917 - from where, with what, how long
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
