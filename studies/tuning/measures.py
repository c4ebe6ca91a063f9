"""What a design is measured by in the linear models of corners and contact modes, with exact derivatives by the gains.

The loops and responses are those of sliding contacts with the integral at work, and for the margins also those of a
mesh in its gap. What dry friction does to them is taken in by two closed forms:

    at the amplitude A of the load where the output has fallen by 3 dB, its first harmonic is that of a
    viscous friction, so with T reference -> load angle, P load torque -> load angle and F the dry friction at the load

        Q = T/(1 + j 4 sqrt(2) F/(pi A) P),    bandwidth: |Q| = 1/sqrt(2)

    a slip that begins at rest with breakaway torque begins with a step of torque H = breakaway - sliding friction, and
    from any error moves at most

        D = H max_t b(t),    b the step response motor torque -> load angle

    beyond its reference. Where the dead band of the integral is at least as wide, it then stays there: no hunting.

References
----------
B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and compensation methods for
the control of machines with friction", Automatica 30 (1994), section 4; A. Gelb, W. E. Vander Velde, "Multiple-Input
Describing Functions and Nonlinear System Design" (1968), section 2.3.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from actuator.linear.derivatives.continuous import Value
from actuator.linear.operating_point import OperatingPoint
from studies.specification import Demand
from studies.tuning.loops import Curves, curves_at, gain_margin, phase_and_delay_margin
from studies.tuning.modes import CornerModes, in_flight, moved
from studies.tuning.plant import (
    Effort,
    efforts_of,
    loops_of,
)

POINTS = 300  # of a step response
FINER, FINE = 2, 11  # times that the least stiffness is sought on a finer grid, of so many points; odd: best included
PERIODS = 4.0  # of the demanded bandwidth, which a step response is looked at for
AMPLE = 1e6  # delay margin over its limit where no delay makes the loop unstable
EFFORT_STEP = 2.5e-4  # s, between the points at which current or torque are looked at


class Measure(NamedTuple):
    """A number that is demanded to be at least, or at most, a limit.

    `slack` is how far inside the limit it is, the logarithm of a ratio (of phases [rad] and overshoots the difference),
    `slopes` its derivatives by the logarithms of the gains.
    """

    name: str
    corner: str
    mode: str
    value: float
    limit: float
    unit: str
    slack: float
    slopes: np.ndarray

    @property
    def met(self) -> bool:
        """Whether the demand is met, but for rounding."""
        return self.slack >= -1e-6  # noqa: PLR2004


def measures(
    modes: CornerModes,
    gains: Mapping[str, float],
    demand: Demand,
    tightening: Mapping[str, float],
    only: str | None = None,
) -> list[Measure]:
    """Every measure in every mode of a corner, or in only one of them.

    Parameters
    ----------
    modes : CornerModes
        From `corner_modes`.
    gains : mapping of str to float
        Values by name, all positive.
    demand : Demand
        The limits.
    tightening : mapping of str to float
        Factors, by the name of a measure, on what is demanded, so that the simulation shows it as well.
    only : str or None
        Name of a mode.
    """
    found = []
    wanted = [only] if only else list(modes.points)
    sliding_of = {name: name.split(",")[0] for name in wanted}
    points = {name: moved(modes.points[name], gains) for name in dict.fromkeys(sliding_of.values())}
    for name, sliding in sliding_of.items():
        point = modes.points[name]
        here = points[name] if name == sliding else in_flight(point, points[sliding])
        curves = curves_at(here, gains, points[sliding])
        view = _View(curves, modes, name, gains, demand, tightening, here)
        found += view.margins()
        if name == sliding:
            found += view.responses()
    return found


class _View(NamedTuple):
    """One mode of one corner at certain gains."""

    curves: Curves
    modes: CornerModes
    mode: str
    gains: Mapping[str, float]
    demand: Demand
    tightening: Mapping[str, float]
    point: OperatingPoint

    def _measure(  # noqa: PLR0913, PLR0917 - a row of the table
        self, name: str, value: float, limit: float, unit: str, slack: float, slopes: np.ndarray
    ) -> Measure:
        sizes = np.array(list(self.gains.values()))  # from derivatives by gains to those by their logarithms
        return Measure(name, self.modes.corner.name, self.mode, value, limit, unit, slack, np.real(slopes) * sizes)

    def _tighter(self, name: str) -> float:
        return self.tightening.get(name, 1.0)

    def margins(self) -> list[Measure]:
        """Gain, phase and delay margin of each loop."""
        found, demand = [], self.demand
        sign = 1.0 if self.curves.model.stable else -1.0
        for at in loops_of(self.point.system):
            words = at.replace("_", " ")
            size, slopes = gain_margin(self.curves, at)
            value, slack = math.exp(sign * size), sign * size - math.log(demand.gain_margin)
            found.append(self._measure(f"gain margin at {words}", value, demand.gain_margin, "-", slack, sign * slopes))
            (phase, slopes), (delay, by_gains) = phase_and_delay_margin(self.curves, at)
            limit = demand.phase_margin
            found.append(self._measure(f"phase margin at {words}", phase, limit, "rad", phase - limit, slopes))
            limit = demand.delay_margin
            slack = min(delay / limit, AMPLE) - 1
            found.append(self._measure(f"delay margin at {words}", delay, limit, "s", slack, by_gains / limit))
        return found

    def responses(self) -> list[Measure]:
        """Bandwidth, overshoot, stiffness, current or torque, and slip."""
        efforts = [self._effort(each) for each in efforts_of(self.demand, self.point.system)]
        return [self._bandwidth(), self._overshoot(), self._stiffness(), *efforts, self._slip()]

    def _bandwidth(self) -> Measure:
        model, w = self.curves.model, [2 * math.pi * self.demand.bandwidth]
        follows, yields = (model.response(given, "load_angle", w) for given in ("reference", "load_torque"))
        k = 4 * math.sqrt(2) * self.modes.friction / (math.pi * self.demand.sine)
        opposed = 1 + 1j * k * yields.value[0]
        value = follows.value[0] / opposed
        change = follows.slopes[0] / opposed - value * 1j * k * yields.slopes[0] / opposed
        limit = self._tighter("bandwidth") / math.sqrt(2)
        return self._measure("bandwidth", abs(value), limit, "-", math.log(abs(value) / limit), np.real(change / value))

    def _largest_step(self, given: str, seen: str, step: float, size: Callable[[np.ndarray], np.ndarray]) -> Value:
        """The step response where it is largest, with its derivatives."""
        model, step = self.curves.model, self.curves.spacing(step)
        steps = model.steps(given, seen, step, POINTS)
        return model.step_at(given, seen, step * int(np.argmax(size(steps))))

    def _overshoot(self) -> Measure:
        found = self._largest_step("reference", "load_angle", PERIODS / self.demand.bandwidth / POINTS, lambda y: y)
        over, limit = float(found.value) - 1, self.demand.overshoot / self._tighter("overshoot")
        return self._measure("overshoot", over, limit, "-", limit - over, -found.slopes)

    def _stiffness(self) -> Measure:
        grid, yields = self.curves.frequencies(), self.curves.response("load_torque", "load_angle")
        for _ in range(FINER):
            best = int(np.argmax(abs(yields)))
            grid = np.geomspace(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)], FINE)
            yields = self.curves.model.response("load_torque", "load_angle", grid).value
        found = self.curves.model.response("load_torque", "load_angle", [grid[int(np.argmax(abs(yields)))]])
        value, limit = 1 / abs(found.value[0]), self.demand.stiffness
        slopes = -np.real(found.slopes[0] / found.value[0])
        return self._measure("stiffness", value, limit, "N m/rad", math.log(value / limit), slopes)

    def _effort(self, effort: Effort) -> Measure:
        steady = self.point.outputs[effort.output]
        found = self._largest_step("reference", effort.output, EFFORT_STEP, abs)
        value = abs(steady) + self.demand.sine * abs(float(found.value))
        limit = effort.limit / self._tighter(effort.name)
        slopes = self.demand.sine * math.copysign(1.0, float(found.value)) * found.slopes / value
        return self._measure(effort.name, value, limit, effort.unit, math.log(limit / value), -slopes)

    def _slip(self) -> Measure:
        step = PERIODS / self.demand.bandwidth / POINTS
        found = self._largest_step("inject.torque_reference", "load_angle", step, abs)
        released = self.modes.released[self.mode] * self._tighter("slip")
        value, limit = released * abs(float(found.value)), self.demand.standing_error
        return self._measure("slip", value, limit, "rad", math.log(limit / value), -found.slopes / float(found.value))


def worst(found: Sequence[Measure]) -> dict[str, Measure]:
    """The one with the least slack of each name."""
    return {
        name: min((m for m in found if m.name == name), key=lambda m: m.slack)
        for name in dict.fromkeys(m.name for m in found)
    }
