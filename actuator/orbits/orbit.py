"""A cycle of stick, slip and impact as an exact periodic orbit: its segments, events, motion and stability.

Floquet multipliers are the eigenvalues of the product of all transition and saltation matrices of one period. One of
them belongs to a shift in time and is exactly 1; what is found instead tells how exact all of them are.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import brentq

from actuator.orbits.flow import FlowMap
from actuator.orbits.segments import Segment
from actuator.system.contact_modes import contact_labels, find_standstill, label_rows
from actuator.system.hybrid import HybridSystem, require_sticking

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STILL = 1e-8  # part of the largest speed that is rounding


class OrbitEvent(NamedTuple):
    """One contact going over from one mode to another, once every period."""

    time: float  # s, after the start of the period
    contact: str
    before: str
    after: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Orbit:
    """A periodic orbit of a system at constant inputs.

    Attributes
    ----------
    system : HybridSystem
        To which it belongs.
    u, p : ndarray
        Inputs and parameters.
    period : float
        [s].
    x0 : ndarray
        State at its start, just after an event.
    segments : tuple of Segment
        Smooth pieces: modes, durations and the margins that end them, switching surfaces included.
    starts : tuple of ndarray
        State at the start of each segment.
    residual : float
        Largest difference of a state after one period from the start, over its nominal size.
    multipliers : ndarray of complex
        Floquet multipliers without the trivial one, largest first.
    trivial : complex
        The multiplier that belongs to a shift in time; 1 but for numerical errors.
    """

    system: HybridSystem = field(repr=False)
    u: np.ndarray = field(repr=False)
    p: np.ndarray = field(repr=False)
    period: float
    x0: np.ndarray = field(repr=False)
    segments: tuple[Segment, ...] = field(repr=False)
    starts: tuple[np.ndarray, ...] = field(repr=False)
    residual: float
    multipliers: np.ndarray
    trivial: complex
    map: FlowMap = field(repr=False)

    @property
    def trivial_error(self) -> float:
        """|mu - 1| of the trivial multiplier: the error to be expected in the others."""
        return abs(self.trivial - 1)

    @property
    def stable(self) -> bool:
        """Whether all multipliers but the trivial one lie inside the unit circle."""
        return bool((abs(self.multipliers) < 1).all())

    @property
    def modes(self) -> tuple[int, ...]:
        """Mode variables at the start."""
        return self.segments[0].modes

    @cached_property
    def sequence(self) -> tuple[tuple[int, ...], ...]:
        """Mode variables in the order of the period, each once for the whole time it lasts."""
        return tuple(modes for modes, _ in itertools.groupby(segment.modes for segment in self.segments))

    @cached_property
    def events(self) -> tuple[OrbitEvent, ...]:
        """Mode changes of the contacts in one period."""
        found, time = [], 0.0
        following = [*self.segments[1:], self.segments[0]]
        for segment, after in zip(self.segments, following, strict=True):
            time += segment.duration
            labels = (contact_labels(self.system, part.modes) for part in (segment, after))
            old, new = labels
            found += [OrbitEvent(time, name, old[name], new[name]) for name in old if old[name] != new[name]]
        return tuple(found)

    @cached_property
    def stick_fraction(self) -> float:
        """Part of the period in which everything is at rest; ValueError where a friction law never sticks."""
        require_sticking(self.system, "the stuck share of an orbit")
        segments = self.segments
        resting = find_standstill(label_rows(self.system, np.array([segment.modes for segment in segments]).T))
        return float(np.array([segment.duration for segment in segments])[resting].sum() / self.period)

    @cached_property
    def load_amplitude(self) -> float:
        """Half of peak to peak at the load [rad]."""
        return self._amplitude("load")

    @cached_property
    def motor_amplitude(self) -> float:
        """Half of peak to peak at the motor [rad]."""
        return self._amplitude("motor")

    @cached_property
    def path(self) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """Times (n,), states (nx, n) and the segment of each column, dense in every segment."""
        times, states, owners, began = [], [], [], 0.0
        for k, (segment, start) in enumerate(zip(self.segments, self.starts, strict=True)):
            grid = self.map.grid * segment.duration
            times.append(began + grid)
            states.append(self.map.path(start, segment.modes, self.u, self.p, segment.duration))
            owners += [k] * len(grid)
            began += segment.duration
        return np.concatenate(times), np.hstack(states), owners

    @property
    def times(self) -> np.ndarray:
        """Of `path` and `signals` [s]."""
        return self.path[0]

    def signals(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Outputs by name at `times`."""
        _, states, owners = self.path
        index = [quantity.name for quantity in self.system.outputs]
        modes = np.array([self.segments[k].modes for k in owners], float).T
        given = (np.tile(value[:, None], len(owners)) for value in (self.u, self.p))
        values = self.system.outputs_function.map(len(owners))(states, modes, *given).full()
        return {name: values[index.index(name)] for name in names}

    def plot(self, names: Sequence[str] = ("motor_angle_at_load", "load_angle", "motor_torque")) -> "Figure":
        """Signals over one period above a ribbon of the contact modes, and the multipliers in the unit circle."""
        from actuator.plots.orbits import plot_orbit

        return plot_orbit(self, names)

    def _amplitude(self, side: str) -> float:
        """Half of peak to peak, turning points found on the motion itself."""
        position, speed = (f"{side}_{what}" for what in ("angle", "speed"))
        signals = self.signals([position, speed])
        owners = np.array(self.path[2])
        found = [signals[position].min(), signals[position].max()]
        still = STILL * abs(signals[speed]).max()
        index = {quantity.name: k for k, quantity in enumerate(self.system.outputs)}
        for k, (segment, start) in enumerate(zip(self.segments, self.starts, strict=True)):
            inside = np.where(abs(signals[speed]) > still, signals[speed], 0)[owners == k]
            for j in np.flatnonzero(inside[1:] * inside[:-1] < 0):

                def output(time: float, name: str, segment: Segment = segment, start: np.ndarray = start) -> float:
                    x = self.map.advance(start, segment.held, self.u, self.p, time) if time > 0 else start
                    return float(self.system.outputs_function(x, segment.modes, self.u, self.p)[index[name]])

                low, high = (segment.duration * self.map.grid[j + step] for step in (0, 1))
                if output(low, speed) * output(high, speed) < 0:
                    root = brentq(lambda time: output(time, speed), low, high, full_output=True)[1].root
                    found.append(output(root, position))
        return float(max(found) - min(found)) / 2
