"""Linear models for tuning, in continuous time or sampled: one way to ask both for loops and responses."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from actuator.linear.derivatives.build_sampled import sampled_gain_model
from actuator.linear.derivatives.continuous import GainModel, gain_model
from actuator.linear.derivatives.sampled import SampledGainModel
from actuator.linear.operating_point import OperatingPoint
from actuator.system.builder import PREFIX
from studies.tuning.plant import loops_of

FREQUENCIES = 2 * np.pi * np.logspace(-1.5, 3.5, 240)  # rad/s
NYQUIST = 1 - 1e-3  # part of half a rate up to which what is sampled is looked at


@dataclass(frozen=True, eq=False)
class Curves:
    """A linear model over a grid of frequencies.

    Attributes
    ----------
    model : GainModel or SampledGainModel
        With all derivatives.
    """

    model: GainModel | SampledGainModel = field(repr=False)

    @property
    def sampled(self) -> bool:
        """Whether the model is in discrete time."""
        return isinstance(self.model, SampledGainModel)

    def frequencies(self, at: str | None = None) -> np.ndarray:
        """The grid [rad/s]: of sampled control up to half the rate of a signal, or of all of them together."""
        end = self.model.highest(at) * NYQUIST if isinstance(self.model, SampledGainModel) else math.inf
        return FREQUENCIES if end > FREQUENCIES[-1] else np.append(FREQUENCIES[end > FREQUENCIES], end)

    def loop(self, at: str) -> np.ndarray:
        """Loop transfer, opened at a signal, on its grid."""
        if isinstance(self.model, SampledGainModel):
            return self.model.loops(at, self.frequencies(at))
        closed = self.response(PREFIX + at, at)
        return -closed / (1 + closed)

    def response(self, given: str, seen: str) -> np.ndarray:
        """Response of an output to an input, on the common grid."""
        if isinstance(self.model, SampledGainModel):
            return self.model.responses(given, seen, self.frequencies())
        return self._table[:, self.model.seen.index(seen), self.model.given.index(given)]

    def spacing(self, step: float) -> float:
        """The step of time next to this one at which there is a step response [s]."""
        return self.model.spacing(step) if isinstance(self.model, SampledGainModel) else step

    @cached_property
    def _table(self) -> np.ndarray:
        assert isinstance(self.model, GainModel)
        return self.model.table(FREQUENCIES)


def curves_at(point: OperatingPoint, gains: Mapping[str, float], resting: OperatingPoint | None = None) -> Curves:
    """The linear model of a point with its derivatives by gains; `resting` as for `gain_model`."""
    system = point.system
    loops = loops_of(system)
    inputs = ("reference", "load_torque", *(PREFIX + name for name in loops))
    known = [quantity.name for quantity in system.outputs]
    outputs = tuple(name for name in ("load_angle", "motor_torque", "current", *loops) if name in known)
    make = sampled_gain_model if system.clocks else gain_model
    return Curves(make(point, tuple(gains), inputs, outputs, resting=resting))
