"""Bench tests of what lasts: holding for a minute, rate and stall, and all of it at every temperature."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from actuator.response.bench.bench import Bench, Numbers
from actuator.response.bench.steps import LEAD, StepResponse, step_test
from actuator.simulation.run import Run
from actuator.simulation.signals import Ramp, Step
from actuator.verdict.verdict import Hunting, classify

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOVES = 0.1  # part of the stroke that counts as motion
STEADY = 0.95  # part of the samples below the rate that is called the rate
SLOWLY = 0.25  # part of the rate at which the way to the stall begins
STARTED = 0.05  # part of the commanded rate from which the load is under way
LATE = 0.98  # part of a run behind which nothing can be said of a stop


@dataclass(frozen=True, kw_only=True)
class HoldTest:
    """The load after a step, for a long time at a constant reference.

    Attributes
    ----------
    verdict : Hunting
        Whether it hunts, with period and amplitude.
    run : Run
        Of it.
    """

    verdict: Hunting
    run: Run = field(repr=False)

    @property
    def numbers(self) -> Numbers:
        """By name, with their units; nan without a cycle."""
        return {
            "period": (self.verdict.period_s, "s"),
            "amplitude": (self.verdict.amplitude_rad, "rad"),
            "stick fraction": (self.verdict.stick_fraction, "-"),
        }

    def plot(self) -> "Figure":
        """Position error, torque and the modes of the contacts."""
        return self.run.plot(("position_error", "motor_torque"))


def hold_test(bench: Bench, *, step: float = 0.02, duration: float = 60.0, resolution: float = 5e-3) -> HoldTest:
    """A step of `step` parts of the stroke, then hold."""
    run = bench.run(Step(time=LEAD, after=step * bench.stroke), duration, resolution)
    return HoldTest(verdict=classify(run), run=run)


@dataclass(frozen=True, kw_only=True)
class RateTest:
    """How fast the load moves, and against which torque it stops.

    Attributes
    ----------
    rate : float
        Reached in a step over the full stroke [rad/s].
    stall_torque : float
        All torque on the load at which it comes to a stop, opposing the motion [N m]; nan where it does not stop.
    rate_run, stall_run : Run
        The full step, and the way against a growing torque.
    """

    rate: float
    stall_torque: float
    rate_run: Run = field(repr=False)
    stall_run: Run = field(repr=False)

    @property
    def numbers(self) -> Numbers:
        """By name, with their units."""
        return {"rate": (self.rate, "rad/s"), "stall torque": (self.stall_torque, "N m")}

    def plot(self) -> "Figure":
        """Speed over time in the step, and over the torque on the way to the stall."""
        from actuator.plots.bench import plot_rate

        return plot_rate(self)


def rate_test(bench: Bench, *, highest: float, duration: float = 5.0, resolution: float = 1e-3) -> RateTest:
    """A step over the stroke; then a slower way against a torque that grows up to `highest` [N m].

    The slower the torque grows, the less the inertia carries the load beyond its stall.

    Raises
    ------
    ValueError
        Where the load does not move in the step.
    """
    half = bench.stroke / 2
    fast = bench.run(Step(time=LEAD, before=-half, after=half), duration, resolution)
    speed = fast["load_speed"]
    if np.ptp(fast["load_angle"]) < MOVES * bench.stroke:
        raise ValueError("rate_test: the load does not move over its stroke; check the load and the limits")
    rate = float(np.quantile(speed[speed > speed.max() / 2], STEADY))
    torque = Ramp(start=bench.inputs.get("load_torque", 0.0), slope=-highest / duration)
    slow = bench.run(Ramp(slope=SLOWLY * rate), duration, resolution, {"load_torque": torque})
    return RateTest(rate=rate, stall_torque=_stall(slow, SLOWLY * rate), rate_run=fast, stall_run=slow)


def _stall(run: Run, rate: float) -> float:
    """Torque against the load where it gets no farther; nan where it does until the end."""
    if run["load_speed"].max() < STARTED * rate:
        return math.nan
    farthest = int(run["load_angle"].argmax())
    if farthest >= LATE * len(run.t):
        return math.nan
    return -float(run["total_load_torque"][farthest])


@dataclass(frozen=True, kw_only=True)
class SoakPoint:
    """One temperature."""

    name: str
    step: StepResponse
    hold: HoldTest


@dataclass(frozen=True, kw_only=True)
class SoakTest:
    """Step and hold at every temperature.

    Attributes
    ----------
    points : tuple of SoakPoint
        In the order asked for.
    """

    points: tuple[SoakPoint, ...]

    @property
    def numbers(self) -> Numbers:
        """By temperature and name, with their units."""
        return {
            f"{point.name}, {name}": value
            for point in self.points
            for name, value in {**point.step.numbers, **point.hold.numbers}.items()
        }

    def plot(self) -> "Figure":
        """Steps of all temperatures, and what holds."""
        from actuator.plots.bench import plot_soak

        return plot_soak(self)


def soak_test(
    bench: Bench, sets: Mapping[str, Mapping[str, float]], *, step: float = 0.02, duration: float = 20.0
) -> SoakTest:
    """Step and hold with every set of parameters, soaked through before.

    Parameters
    ----------
    bench : Bench
        Its parameters are those of all sets.
    sets : mapping of str to mapping of str to float
        Parameters by the name of the temperature, as `temperature_sets(actuator, temperatures)` makes them.
    step : float
        Part of the stroke.
    duration : float
        Of the hold [s].

    Raises
    ------
    ValueError
        Without any set.
    """
    if not sets:
        raise ValueError("soak_test needs at least one temperature; temperature_sets makes them")
    points = []
    for name, changes in sets.items():
        there = Bench(
            plant=bench.plant,
            stroke=bench.stroke,
            inputs=bench.inputs,
            parameters={**bench.parameters, **changes},
            compiled=bench.compiled,
        )
        (response,) = step_test(there, sizes=[step]).steps
        points.append(SoakPoint(name=name, step=response, hold=hold_test(there, step=step, duration=duration)))
    return SoakTest(points=tuple(points))
