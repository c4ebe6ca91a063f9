"""A completed run: signals by name, the modes of every contact, and when they changed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from actuator.system.contact_modes import STUCK, contact_labels, is_at_rest, label_rows
from actuator.system.hybrid import HybridSystem
from gear.quantities import require_known

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from actuator.simulation.signals import Signal
    from actuator.simulation.window_points import Window


class ModeChange(NamedTuple):
    """One contact going over from one mode to another."""

    time: float  # s
    contact: str  # "gear.meshes.first"
    before: str
    after: str


class Statistics(NamedTuple):
    """What a run cost and went through."""

    wall_s: float
    simulated_s: float
    events: int  # instants at which modes were decided
    settled: int  # events the integrator missed and the check after it found
    compiled: bool


@dataclass(frozen=True, kw_only=True)
class Run:
    """Signals over time by name, `run["load_angle"]`, with their units, modes and mode changes.

    Attributes
    ----------
    t : ndarray, (n,)
        Time [s]; piecewise uniform, denser where events crowd.
    signals : dict of str to ndarray, (n,)
        Inputs, states and outputs.
    units : dict of str to str
        Unit of each signal.
    modes : dict of str to ndarray of str, (n,)
        Per contact: "stuck", "forward", "backward", "free".
    changes : tuple of ModeChange
        In order of time.
    margins : ndarray, (margins, n)
        Of the contacts, dimensionless; never negative beyond rounding.
    statistics : Statistics
        Times and counts.
    """

    system: HybridSystem = field(repr=False)
    t: np.ndarray = field(repr=False)
    signals: dict[str, np.ndarray] = field(repr=False)
    units: dict[str, str] = field(repr=False)
    modes: dict[str, np.ndarray] = field(repr=False)
    mode_values: np.ndarray = field(repr=False)
    changes: tuple[ModeChange, ...] = field(repr=False)
    margins: np.ndarray = field(repr=False)
    parameters: np.ndarray = field(repr=False)
    statistics: Statistics

    def __getitem__(self, name: str) -> np.ndarray:
        """A signal by name; KeyError with the nearest names where there is none."""
        require_known([name], self.signals, "signal")
        return self.signals[name]

    @classmethod
    def from_window(
        cls,
        system: HybridSystem,
        window: "Window",
        statistics: Statistics,
        parameters: np.ndarray,
        inputs: Sequence["Signal"],
    ) -> "Run":
        """Name what the engine returned."""
        from actuator.simulation.signals import values_at

        signals = {
            quantity.name: values_at(signal, window.time)
            for quantity, signal in zip(system.inputs, inputs, strict=True)
        }
        signals |= {quantity.name: row for quantity, row in zip(system.states, window.states, strict=True)}
        signals |= {quantity.name: row for quantity, row in zip(system.outputs, window.outputs, strict=True)}
        named = [*system.inputs, *system.states, *system.outputs]
        before = contact_labels(system, window.modes[:, 0])
        changes = []
        for time, values in window.events:
            after = contact_labels(system, values)
            changes += [
                ModeChange(time, name, before[name], mode) for name, mode in after.items() if mode != before[name]
            ]
            before = after
        return cls(
            system=system,
            t=window.time,
            signals=signals,
            units={quantity.name: quantity.unit for quantity in named},
            modes=label_rows(system, window.modes),
            mode_values=window.modes,
            changes=tuple(changes),
            margins=window.margins,
            parameters=parameters,
            statistics=statistics,
        )

    def state(self, index: int = -1) -> dict[str, float]:
        """The states at an output point by name, to start another run from."""
        return {quantity.name: float(self[quantity.name][index]) for quantity in self.system.states}

    def stuck_share(self, start: float, end: float) -> float:
        """Part of the time from start to end [s] in which everything is at rest, from the times of the mode changes."""
        first = {name: row[0] for name, row in self.modes.items()}
        first |= {change.contact: change.before for change in reversed(self.changes)}
        # a contact that never sticks does not tell whether the others do
        first = {name: mode for name, mode in first.items() if (self.modes[name] == STUCK).any()}
        rows = [first]
        for change in self.changes:
            rows.append(rows[-1] | {change.contact: change.after} if change.contact in first else rows[-1])
        resting = is_at_rest(np.array([list(row.values()) for row in rows]).T) if first else np.zeros(len(rows), bool)
        edges = np.clip([start, *(change.time for change in self.changes), end], start, end)
        return float(np.diff(edges)[resting].sum() / (end - start))

    def plot(self, names: Sequence[str] = ("motor_angle", "load_angle", "motor_torque")) -> "Figure":
        """Signals above a ribbon of the contact modes."""
        from actuator.plots.runs import plot_run

        return plot_run(self, names)

    def to_xarray(self) -> "xarray.Dataset":
        """Signals and modes as a dataset over time, units in the attributes."""
        import xarray

        variables = {name: ("time", values, {"units": self.units[name]}) for name, values in self.signals.items()}
        variables |= {f"{name}.mode": ("time", values) for name, values in self.modes.items()}
        return xarray.Dataset(
            variables,
            coords={"time": ("time", self.t, {"units": "s"})},
            attrs={"system": self.system.name, **self.statistics._asdict()},
        )
