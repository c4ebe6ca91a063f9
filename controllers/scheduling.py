"""Gain scheduling: gains that follow a measured quantity."""

import copy
from dataclasses import dataclass, fields
from typing import Any

import casadi as ca

from gear.quantities import Scalar, annotations, is_number
from gear.quantities.roles import IntegralGain, LoopGain


@dataclass(frozen=True, kw_only=True)
class ScheduledGain:
    """Factor on the gains of a law, by straight lines over one quantity; constant beyond the table.

    Parameters
    ----------
    over : str
        Name of the quantity, "temperature" or "load" for instance.
    points : tuple of float
        Its values, increasing, in its own unit ([K], [N m]).
    values : tuple of float
        Factor at each of them [-], positive.

    Raises
    ------
    ValueError
        Where the table is none.
    """

    over: str
    points: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.points) != len(self.values) or not self.points:
            raise ValueError(
                f"ScheduledGain over {self.over} needs as many values as points, at least one, "
                f"got {len(self.values)} values and {len(self.points)} points"
            )
        for name in ("points", "values"):
            for value in getattr(self, name):
                if not is_number(value):
                    raise ValueError(f"ScheduledGain over {self.over}: {name} must be finite numbers, got {value!r}")
        for low, high in zip(self.points, self.points[1:], strict=False):
            if low >= high:
                raise ValueError(
                    f"ScheduledGain over {self.over}: points must increase, got {low:.6g} before {high:.6g}"
                )
        for value in self.values:
            if value <= 0:
                raise ValueError(f"ScheduledGain over {self.over}: values must be > 0, got {value:.6g}")

    def factor(self, value: Scalar) -> Scalar:
        """Factor [-] at a value of the quantity."""
        result = self.values[0]
        for k in range(len(self.points) - 1):
            width = self.points[k + 1] - self.points[k]
            passed = ca.fmin(ca.fmax(value - self.points[k], 0), width)
            result = result + (self.values[k + 1] - self.values[k]) * passed / width
        return result

    def scale(self, law: Any, value: Scalar) -> Any:
        """`law` (P, PI, PID) with all its gains times the factor, for this evaluation.

        The copy is not checked again, as its gains may be expressions. The integral state is an output
        already, so a change of the factor does not step the integral part.
        """
        scaled, factor, notes = copy.copy(law), self.factor(value), annotations(law)
        for field in fields(law):
            if any(isinstance(note, LoopGain | IntegralGain) for note in notes[field.name]):
                object.__setattr__(scaled, field.name, getattr(law, field.name) * factor)
        return scaled
