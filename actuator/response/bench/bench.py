"""The bench for virtual tests: what a test engineer does to an actuator and writes down.

Every test returns a frozen `BenchTest`: its numbers with units by name, the runs behind them, and a picture.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from actuator.actuator import Actuator
from actuator.simulation.run import Run
from actuator.simulation.signals import Constant, Signal
from actuator.simulation.simulate import simulate
from actuator.stiction.standstill import rest_state
from actuator.system.hybrid import HybridSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Numbers = dict[str, tuple[float, str]]


class BenchTest(Protocol):
    """What every bench test returns."""

    @property
    def numbers(self) -> Numbers:
        """By name, with their units; nan or infinite where there is none."""
        ...

    def plot(self) -> "Figure":
        """What was measured."""
        ...


@dataclass(frozen=True, kw_only=True)
class Bench:
    """An actuator on the bench, with what stays the same in all tests.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        With a position controller.
    stroke : float
        From end to end [rad].
    inputs : mapping of str to float
        Other inputs, constant: a bias load, say.
    parameters : mapping of str to float
        That differ from the defaults: those of a temperature, say.
    compiled : bool or None
        As for `simulate`.
    """

    plant: Actuator | HybridSystem
    stroke: float
    inputs: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    compiled: bool | None = None

    def __post_init__(self) -> None:
        if not self.stroke > 0:
            raise ValueError(f"Bench.stroke must be > 0 rad, got {self.stroke:g} rad")

    def run(
        self, reference: Signal, duration: float, resolution: float, more: Mapping[str, Signal] | None = None
    ) -> Run:
        """From rest at the reference's first value."""
        first = reference.pieces()[0][1].offset
        start = rest_state(self.plant, {**self.inputs, "reference": first}, self.parameters)
        signals: dict[str, Signal] = {name: Constant(value=value) for name, value in self.inputs.items()}
        return simulate(
            self.plant,
            duration,
            inputs={**signals, "reference": reference, **(more or {})},
            start=start,
            parameters=self.parameters,
            resolution=resolution,
            compiled=self.compiled,
        )
