"""What describing functions predict of an actuator's hunting, beside its exact orbit, and why the two differ.

All sliding friction is lumped at the load, as a relay of the load's speed around the loop in which every contact
slides:

    friction = C sign(load speed),    2 C = torque at the load for sliding forward less that for sliding backward

The method knows nothing else of friction: breakaway beyond C, and standing still for most of a period, are what it
leaves out. The harmonics of the orbit's own load speed say how far that speed is from the sine that is assumed.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import control
import numpy as np

from actuator.actuator import Actuator
from actuator.describing.describing import (
    TRUSTED,
    PredictedCycle,
    coulomb_friction,
    harmonics_of,
    predict_cycles,
)
from actuator.linear.model import linearize
from actuator.linear.operating_point import OperatingPoint
from actuator.linear.trim import trim
from actuator.orbits.sampled import PeriodicOrbit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REACH, CELLS = 1e3, 40  # how far below and above those of the orbit amplitudes and frequencies are searched; per axis


@dataclass(frozen=True, kw_only=True, eq=False)
class DescribingCheck:
    """A prediction by describing functions beside the exact orbit.

    Attributes
    ----------
    orbit : Orbit or SampledOrbit
        The exact one.
    loop : control.StateSpace
        From a torque at the load to its speed, with all contacts sliding.
    coulomb : float
        Sliding friction of all contacts, at the load [N m].
    cycles : tuple of PredictedCycle
        Amplitudes are those of the load's speed [rad/s].
    harmonics : ndarray, (9,)
        Amplitudes of the orbit's load speed [rad/s], from the first harmonic on.
    """

    orbit: PeriodicOrbit = field(repr=False)
    loop: control.StateSpace = field(repr=False)
    coulomb: float
    cycles: tuple[PredictedCycle, ...]
    harmonics: np.ndarray = field(repr=False)

    @property
    def distortion(self) -> float:
        """Higher harmonics of the orbit's load speed over the first, root of the sum of squares."""
        return float(np.linalg.norm(self.harmonics[1:]) / self.harmonics[0])

    @property
    def stable_cycles(self) -> tuple[PredictedCycle, ...]:
        """The predicted cycles that would be seen."""
        return tuple(cycle for cycle in self.cycles if cycle.stable)

    @property
    def trusted(self) -> bool:
        """Whether the speed is nearly the sine that the method assumes, and a stable cycle is predicted for it."""
        return self.distortion < TRUSTED and any(cycle.trusted for cycle in self.stable_cycles)

    @property
    def reason(self) -> str:
        """What was predicted, what there is, and whether to trust the method, in a sentence."""
        found = ", ".join(f"a cycle of {cycle.period:.4g} s" for cycle in self.stable_cycles) or "no cycle"
        return (
            f"describing functions predict {found}, the exact orbit has {self.orbit.period:.4g} s; the load's speed "
            f"has {self.distortion:.0%} of higher harmonics, {'below' if self.distortion < TRUSTED else 'above'} the "
            f"{TRUSTED:.0%} up to which it is nearly a sine"
        )

    def plot(self) -> "Figure":
        """The loop and -1/N over the complex plane, and the harmonics of the orbit's load speed."""
        from actuator.plots.orbits import plot_describing_functions

        return plot_describing_functions(self)


def check_describing_function(plant: Actuator, orbit: PeriodicOrbit) -> DescribingCheck:
    """The prediction by describing functions for an actuator that is on a known orbit.

    Parameters
    ----------
    plant : Actuator
        It needs a controller that holds a reference; a sampled one is linearized as `linearize` does.
    orbit : Orbit or SampledOrbit
        Its exact orbit; inputs and parameters are taken from it.

    Raises
    ------
    NoEquilibrium
        Where the actuator has no equilibrium with all contacts sliding.
    """
    inputs = {q.name: float(value) for q, value in zip(orbit.system.inputs, orbit.u, strict=True)}
    parameters = {q.name: float(value) for q, value in zip(orbit.system.parameters, orbit.p, strict=True)}
    forward, backward = (trim(plant, mode, inputs=inputs, parameters=parameters) for mode in ("forward", "backward"))
    loop = linearize(forward, ["load_torque"], ["load_speed"])
    coulomb = abs(_at_load(forward) - _at_load(backward)) / 2
    harmonics = _harmonics(orbit)
    amplitudes = harmonics[0] * np.geomspace(1 / REACH, REACH, CELLS)
    frequencies = 2 * np.pi / orbit.period * np.geomspace(1 / REACH, REACH, CELLS + 1)
    cycles = predict_cycles(loop, coulomb_friction(coulomb), amplitudes, frequencies)
    return DescribingCheck(orbit=orbit, loop=loop, coulomb=coulomb, cycles=tuple(cycles), harmonics=harmonics)


def _at_load(point: OperatingPoint) -> float:
    """Motor torque of an operating point, at the load [N m]."""
    return point.outputs["motor_torque"] * point.outputs["motor_angle"] / point.outputs["motor_angle_at_load"]


def _harmonics(orbit: PeriodicOrbit) -> np.ndarray:
    """Amplitudes of the harmonics of the load's speed, (9,)."""
    speed = orbit.signals(["load_speed"])["load_speed"]
    return np.abs(harmonics_of(orbit.times, speed, 1 / orbit.period))
