"""Measures of a design in the linear models of corners and contact modes, with exact derivatives by the gains.

The loops and responses are those of sliding contacts with the integral active, and for the margins also those with
separated teeth. Dry friction is included by two closed forms:

    at the amplitude A of the load where the output has fallen by 3 dB, its first harmonic is that of a
    viscous friction, so with T reference -> load angle, P load torque -> load angle and F the dry friction at the load

        Q = T/(1 + j 4 sqrt(2) F/(pi A) P),    bandwidth: |Q| = 1/sqrt(2)

    a slip from rest at breakaway torque starts with a step of torque H = breakaway - sliding friction, and from any
    error moves at most

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
from studies.specification import Criterion, Demand
from studies.tuning.loops import Curves, curves_at, gain_margin, phase_and_delay_margin
from studies.tuning.modes import CornerModes, move_point, separate
from studies.tuning.plant import (
    Effort,
    efforts_of,
    loops_of,
)

STEP_POINTS = 300  # of a step response
REFINEMENTS, REFINED = 2, 11  # of the grid for the least stiffness, and points of each; odd to include the best
STEP_PERIODS = 4.0  # of the demanded bandwidth: length of a step response
AMPLE = 1e6  # delay margin over its limit where no delay makes the loop unstable
EFFORT_STEP = 2.5e-4  # s, spacing of points for current or torque


class Measure(NamedTuple):
    """A number with its limit.

    `slack` is its distance inside the limit, the logarithm of a ratio (for phases [rad] and overshoots the difference),
    `slopes` its derivatives by the logarithms of the gains.
    """

    criterion: Criterion
    name: str  # the criterion, for margins with the loop
    corner: str
    mode: str
    value: float
    limit: float
    unit: str
    slack: float
    slopes: np.ndarray

    @property
    def met(self) -> bool:
        """Whether the demand is met, within rounding."""
        return self.slack >= -1e-6  # noqa: PLR2004


def measures(
    modes: CornerModes,
    gains: Mapping[str, float],
    demand: Demand,
    tightening: Mapping[Criterion, float],
    only: str | None = None,
) -> list[Measure]:
    """All measures in every mode of a corner, or in one of them.

    Parameters
    ----------
    modes : CornerModes
        From `corner_modes`.
    gains : mapping of str to float
        Values by name, all positive.
    demand : Demand
        The limits.
    tightening : mapping of Criterion to float
        Factors on demands, so that the simulations meet them as well.
    only : str or None
        Name of a mode.
    """
    found = []
    wanted = [only] if only else list(modes.points)
    sliding_modes = {name: modes.sliding[name] for name in wanted}
    points = {name: move_point(modes.points[name], gains) for name in dict.fromkeys(sliding_modes.values())}
    for name, sliding in sliding_modes.items():
        point = modes.points[name]
        here = points[name] if name == sliding else separate(point, points[sliding])
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
    tightening: Mapping[Criterion, float]
    point: OperatingPoint

    def _measure(  # noqa: PLR0913, PLR0917 - a row of the table
        self,
        criterion: Criterion,
        value: float,
        limit: float,
        unit: str,
        slack: float,
        slopes: np.ndarray,
        at: str = "",
    ) -> Measure:
        sizes = np.array(list(self.gains.values()))  # from derivatives by gains to those by their logarithms
        name, corner = f"{criterion} at {at}" if at else str(criterion), self.modes.corner.name
        return Measure(criterion, name, corner, self.mode, value, limit, unit, slack, np.real(slopes) * sizes)

    def _tighter(self, criterion: Criterion) -> float:
        return self.tightening.get(criterion, 1.0)

    def margins(self) -> list[Measure]:
        """Gain, phase and delay margins of each loop."""
        found, demand = [], self.demand
        sign = 1.0 if self.curves.model.stable else -1.0
        for at in loops_of(self.point.system):
            loop = at.replace("_", " ")
            size, slopes = gain_margin(self.curves, at)
            value, slack = math.exp(sign * size), sign * size - math.log(demand.gain_margin)
            limit = demand.gain_margin
            found.append(self._measure(Criterion.GAIN_MARGIN, value, limit, "-", slack, sign * slopes, loop))
            (phase, slopes), (delay, by_gains) = phase_and_delay_margin(self.curves, at)
            limit = demand.phase_margin
            found.append(self._measure(Criterion.PHASE_MARGIN, phase, limit, "rad", phase - limit, slopes, loop))
            limit = demand.delay_margin
            slack = min(delay / limit, AMPLE) - 1
            found.append(self._measure(Criterion.DELAY_MARGIN, delay, limit, "s", slack, by_gains / limit, loop))
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
        limit = self._tighter(Criterion.BANDWIDTH) / math.sqrt(2)
        return self._measure(
            Criterion.BANDWIDTH, abs(value), limit, "-", math.log(abs(value) / limit), np.real(change / value)
        )

    def _largest_step(self, given: str, seen: str, step: float, size: Callable[[np.ndarray], np.ndarray]) -> Value:
        """The step response at its largest point, with its derivatives."""
        model, step = self.curves.model, self.curves.spacing(step)
        steps = model.steps(given, seen, step, STEP_POINTS)
        return model.step_at(given, seen, step * int(np.argmax(size(steps))))

    def _overshoot(self) -> Measure:
        found = self._largest_step(
            "reference", "load_angle", STEP_PERIODS / self.demand.bandwidth / STEP_POINTS, lambda y: y
        )
        over, limit = float(found.value) - 1, self.demand.overshoot / self._tighter(Criterion.OVERSHOOT)
        return self._measure(Criterion.OVERSHOOT, over, limit, "-", limit - over, -found.slopes)

    def _stiffness(self) -> Measure:
        grid, yields = self.curves.frequencies(), self.curves.response("load_torque", "load_angle")
        for _ in range(REFINEMENTS):
            best = int(np.argmax(abs(yields)))
            grid = np.geomspace(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)], REFINED)
            yields = self.curves.model.response("load_torque", "load_angle", grid).value
        found = self.curves.model.response("load_torque", "load_angle", [grid[int(np.argmax(abs(yields)))]])
        value, limit = 1 / abs(found.value[0]), self.demand.stiffness
        slopes = -np.real(found.slopes[0] / found.value[0])
        return self._measure(Criterion.STIFFNESS, value, limit, "N m/rad", math.log(value / limit), slopes)

    def _effort(self, effort: Effort) -> Measure:
        steady = self.point.outputs[effort.output]
        found = self._largest_step("reference", effort.output, EFFORT_STEP, abs)
        value = abs(steady) + self.demand.sine * abs(float(found.value))
        limit = effort.limit / self._tighter(effort.criterion)
        slopes = self.demand.sine * math.copysign(1.0, float(found.value)) * found.slopes / value
        return self._measure(effort.criterion, value, limit, effort.unit, math.log(limit / value), -slopes)

    def _slip(self) -> Measure:
        step = STEP_PERIODS / self.demand.bandwidth / STEP_POINTS
        found = self._largest_step("inject.torque_reference", "load_angle", step, abs)
        released = self.modes.released[self.mode] * self._tighter(Criterion.SLIP)
        value, limit = released * abs(float(found.value)), self.demand.standing_error
        return self._measure(
            Criterion.SLIP, value, limit, "rad", math.log(limit / value), -found.slopes / float(found.value)
        )


def worst(found: Sequence[Measure]) -> dict[str, Measure]:
    """By name, the measure with the least slack."""
    return {
        name: min((m for m in found if m.name == name), key=lambda m: m.slack)
        for name in dict.fromkeys(m.name for m in found)
    }
