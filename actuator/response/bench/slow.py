"""Slow bench tests: a triangle for hysteresis and lost motion, a staircase for resolution and threshold."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from actuator.response.bench.bench import Bench, Numbers
from actuator.simulation.run import Run
from actuator.simulation.signals import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOVES = 0.1  # part of an increment that counts as motion


@dataclass(frozen=True, kw_only=True)
class TriangleTest:
    """The load over a slow triangle of the reference.

    Attributes
    ----------
    hysteresis_rad : float
        Largest width of the loop of load angle over reference; the lag at this slope is part of it.
    lost_motion_rad : float
        Largest width of the loop of load angle over motor angle, at the load: what the gear loses at a reversal.
    run : Run
        Of it; the last period counts.
    period_s : float
        Of the triangle.
    """

    hysteresis_rad: float
    lost_motion_rad: float
    run: Run = field(repr=False)
    period_s: float

    @property
    def numbers(self) -> Numbers:
        """By name, with their units."""
        return {
            "hysteresis": (self.hysteresis_rad, "rad"),
            "lost motion of the gear": (self.lost_motion_rad, "rad"),
        }

    def plot(self) -> "Figure":
        """Both loops."""
        from actuator.plots.bench import plot_triangle

        return plot_triangle(self)


def triangle_test(bench: Bench, *, size: float = 0.02, period: float = 20.0, points: int = 4000) -> TriangleTest:
    """Two periods of a triangle with peaks at plus and minus `size` parts of the stroke; the second counts."""
    peak = size * bench.stroke
    times = tuple(period * k / 4 for k in (0, 1, 3, 5, 7, 8))
    run = bench.run(Table(times=times, values=(0.0, peak, -peak, peak, -peak, 0.0)), times[-1], period / points)
    last = run.t >= 0.75 * period
    reference, load, motor = (run[name][last] for name in ("reference", "load_angle", "motor_angle_at_load"))
    return TriangleTest(
        hysteresis_rad=_width(reference, load, run.t[last]),
        lost_motion_rad=_width(motor, load, run.t[last]),
        run=run,
        period_s=period,
    )


def _width(across: np.ndarray, values: np.ndarray, time: np.ndarray) -> float:
    """Largest distance between the ways up and down of a loop, in its middle half, away from the turns."""
    up = np.gradient(across, time) > 0
    down = np.gradient(across, time) < 0
    inner = np.linspace((3 * across.min() + across.max()) / 4, (across.min() + 3 * across.max()) / 4, 400)
    ways = []
    for way in (up, down):
        order = np.argsort(across[way], kind="stable")
        ways.append(np.interp(inner, across[way][order], values[way][order]))
    return float(abs(ways[0] - ways[1]).max())


@dataclass(frozen=True, kw_only=True)
class StaircaseTest:
    """The load on a staircase of the reference, up and down again.

    Attributes
    ----------
    increment_rad : float
        Of the reference.
    resolution_rad : float
        Largest change of the reference in one direction until the load follows, without the first; infinite where it
        never does.
    threshold_rad : float
        Change of the reference after the reversal until the load follows.
    run : Run
        Of it.
    """

    increment_rad: float
    resolution_rad: float
    threshold_rad: float
    run: Run = field(repr=False)

    @property
    def numbers(self) -> Numbers:
        """By name, with their units."""
        return {
            "increment": (self.increment_rad, "rad"),
            "resolution": (self.resolution_rad, "rad"),
            "threshold": (self.threshold_rad, "rad"),
        }

    def plot(self) -> "Figure":
        """Reference and load over time."""
        from actuator.plots.bench import plot_staircase

        return plot_staircase(self)


def staircase_test(
    bench: Bench, *, increment: float, count: int = 20, dwell: float = 0.5, points: int = 50
) -> StaircaseTest:
    """`count` steps of `increment` [rad] up and as many down, `dwell` [s] each, looked at at their ends.

    An integrator moves a load on any reference in the end: what is found belongs to the dwell.
    """
    levels = [min(k, 2 * count - k) * increment for k in range(2 * count + 1)]
    rise = 1e-6 * dwell  # a table has no jumps
    times, values = [0.0], [0.0]
    for k, level in enumerate(levels[1:]):
        times += [(k + 1) * dwell, (k + 1) * dwell + rise]
        values += [values[-1], level]
    reference = Table(times=tuple(times), values=tuple(values))
    run = bench.run(reference, (2 * count + 1) * dwell, dwell / points)
    ends = np.interp((np.arange(2 * count + 1) + 1) * dwell - 2 * rise, run.t, run["load_angle"])
    up, down = np.diff(ends[: count + 1]), -np.diff(ends[count:])
    return StaircaseTest(
        increment_rad=increment,
        resolution_rad=_largest_wait(up, increment),
        threshold_rad=_first_wait(down, increment),
        run=run,
    )


def _first_wait(moved: np.ndarray, increment: float) -> float:
    """Reference until the first motion."""
    follows = np.flatnonzero(moved > MOVES * increment)
    return float((follows[0] + 1) * increment) if follows.size else math.inf


def _largest_wait(moved: np.ndarray, increment: float) -> float:
    """Largest change of the reference from one motion to the next."""
    follows = np.flatnonzero(moved > MOVES * increment)
    return float(np.diff(follows).max() * increment) if follows.size > 1 else math.inf
