"""A completed run: signals by name, the modes of every contact, and when they changed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from actuator.system.contact_modes import STUCK, contact_labels, is_at_rest, label_rows
from actuator.system.hybrid import HybridSystem
from gear.quantities import require_known

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from actuator.simulation.signals import Signal


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
    settled: int  # decisions that had to be taken again at once
    compiled: bool = True  # False where NUMBA_DISABLE_JIT is set


class Events(NamedTuple):
    """Every instant at which modes were decided, in order of time; in rows, of states all, the held ones too."""

    times: np.ndarray  # (k,) s
    fired: np.ndarray  # (k,) index of the margin that fell through zero, -1 at a tick or a break of an input
    before: np.ndarray  # (k, nx) states
    after: np.ndarray  # (k, nx)
    modes: np.ndarray  # (k, nm) after it


@dataclass(frozen=True, kw_only=True)
class Run:
    """Signals over time by name, `run["load_angle"]`, with their units, modes and mode changes.

    Attributes
    ----------
    t : ndarray, (n,)
        Time [s]; piecewise uniform. At an event, a tick or a break of an input it is what comes after that counts.
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
    events : Events or None
        With states before and after each; None for a run that no engine made.
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
    events: Events | None = field(default=None, repr=False)

    def __getitem__(self, name: str) -> np.ndarray:
        """A signal by name; KeyError with the nearest names where there is none."""
        require_known([name], self.signals, "signal")
        return self.signals[name]

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


class SimulatedRun(Run):
    """A run as the engine leaves it; what is derived of it is worked out when it is first asked for."""

    def __init__(  # noqa: PLR0913 - all there is of a run
        self,
        *,
        system: HybridSystem,
        t: np.ndarray,
        states: np.ndarray,
        mode_values: np.ndarray,
        events: Events,
        parameters: np.ndarray,
        inputs: tuple["Signal", ...],
        statistics: Statistics,
    ) -> None:
        given = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        self.__dict__.update(given)  # frozen

    @cached_property
    def signals(self) -> dict[str, np.ndarray]:
        """Inputs, states and outputs by name, each (n,)."""
        system = self.system
        values = [*self._inputs.T, *self.__dict__["states"], *self._observed("outputs").T]
        return {q.name: row for q, row in zip((*system.inputs, *system.states, *system.outputs), values, strict=True)}

    @cached_property
    def units(self) -> dict[str, str]:
        """Unit of each signal."""
        return {q.name: q.unit for q in (*self.system.inputs, *self.system.states, *self.system.outputs)}

    @cached_property
    def modes(self) -> dict[str, np.ndarray]:
        """Per contact: "stuck", "forward", "backward", "free", each (n,)."""
        return label_rows(self.system, self.mode_values)

    @cached_property
    def margins(self) -> np.ndarray:
        """Of the contacts, dimensionless, (margins, n); never negative beyond rounding."""
        return self._observed("margins").T

    @cached_property
    def changes(self) -> tuple[ModeChange, ...]:
        """Contacts going over from one mode to another, in order of time."""
        events: Events = self.__dict__["events"]
        before = contact_labels(self.system, self.mode_values[:, 0])
        found = []
        for time, values in zip(events.times, events.modes, strict=True):
            after = contact_labels(self.system, values)
            found += [
                ModeChange(float(time), name, before[name], mode)
                for name, mode in after.items()
                if mode != before[name]
            ]
            before = after
        return tuple(found)

    @cached_property
    def _inputs(self) -> np.ndarray:
        """Values of the inputs, (n, inputs)."""
        from actuator.simulation.signals import values_at

        columns = [values_at(signal, self.t) for signal in self.__dict__["inputs"]]
        return np.column_stack(columns) if columns else np.empty((self.t.size, 0))

    def _observed(self, what: str) -> np.ndarray:
        from actuator.engine.model import model

        return model(self.system).along(
            what, self.__dict__["states"].T, self.mode_values.T, self._inputs, self.parameters
        )
