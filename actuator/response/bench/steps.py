"""Step responses of several sizes: overshoot, rise and settling time, error left."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from actuator.response.bench.bench import Bench, Numbers
from actuator.simulation.run import Run
from actuator.simulation.signals import Step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEP_SIZES = (0.005, 0.02, 0.1, 1.0)  # parts of the stroke
BAND = 0.02  # part of a step within which it has settled
LOW, HIGH = 0.1, 0.9  # parts of a step between which it rises
LEAD = 0.05  # s of rest before a step


@dataclass(frozen=True, kw_only=True)
class StepResponse:
    """What the load does after a step of the reference.

    Attributes
    ----------
    size_rad : float
        Of the step.
    overshoot : float
        Beyond the new reference, as part of the step [-].
    rise_s : float
        From a tenth to nine tenths of the step; infinite where it does not get there.
    settling_s : float
        Until the load stays within 2 % of the step; infinite where it does not within the run.
    error_rad : float
        Left at the end of the run.
    run : Run
        Of it.
    """

    size_rad: float
    overshoot: float
    rise_s: float
    settling_s: float
    error_rad: float
    run: Run = field(repr=False)

    @property
    def numbers(self) -> Numbers:
        """By name, with their units."""
        return {
            "size": (self.size_rad, "rad"),
            "overshoot": (self.overshoot, "-"),
            "rise time": (self.rise_s, "s"),
            "settling time": (self.settling_s, "s"),
            "error at the end": (self.error_rad, "rad"),
        }

    @classmethod
    def of(cls, run: Run, time: float, size: float) -> "StepResponse":
        """From a run in which the reference makes a step of that size [rad] at that time [s]."""
        after = run.t >= time
        t, moved = run.t[after] - time, (run["load_angle"][after] - run["load_angle"][after][0]) / size
        # where it began is not where it was asked to be, but for a steady error
        target = (run["reference"][after][-1] - run["load_angle"][after][0]) / size
        outside = np.flatnonzero(abs(moved - target) > BAND)
        times = [t[k[0]] if (k := np.flatnonzero(moved >= part * target)).size else math.inf for part in (LOW, HIGH)]
        if not outside.size:
            settled = 0.0
        else:
            settled = math.inf if outside[-1] == len(t) - 1 else float(t[outside[-1] + 1])
        return cls(
            size_rad=size,
            overshoot=float(max(0.0, moved.max() - target)),
            rise_s=float(times[1] - times[0]) if math.isfinite(times[1]) else math.inf,
            settling_s=settled,
            error_rad=float((target - moved[-1]) * size),
            run=run,
        )


@dataclass(frozen=True, kw_only=True)
class StepTest:
    """Steps of several sizes, each from rest.

    Attributes
    ----------
    steps : tuple of StepResponse
        In the order asked for.
    """

    steps: tuple[StepResponse, ...]

    @property
    def numbers(self) -> Numbers:
        """By step and name, with their units."""
        return {
            f"step {np.degrees(step.size_rad):.4g} deg, {name}": value
            for step in self.steps
            for name, value in step.numbers.items()
        }

    def plot(self) -> "Figure":
        """All steps over their sizes."""
        from actuator.plots.bench import plot_steps

        return plot_steps(self)


def step_test(
    bench: Bench, *, sizes: Sequence[float] = STEP_SIZES, duration: float = 2.0, resolution: float = 5e-4
) -> StepTest:
    """Steps from rest, `sizes` as parts of the stroke; the largest from one end, others from the middle."""
    found = []
    for size in sizes:
        step = size * bench.stroke
        before = -step / 2 if size > 1 / 2 else 0.0
        run = bench.run(Step(time=LEAD, before=before, after=before + step), LEAD + duration, resolution)
        found.append(StepResponse.of(run, LEAD, step))
    return StepTest(steps=tuple(found))
