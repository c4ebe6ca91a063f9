"""Why it hunts: the energy each element gives per cycle, and the same run with one cause removed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

from actuator.actuator import Actuator
from actuator.diagnosis.cycle_energy import CycleEnergy, changed_parameters, energy_per_cycle
from actuator.parts.sensors import Sensors
from actuator.simulation.run import Run
from actuator.simulation.signals import Signal
from actuator.system.hybrid import HybridSystem
from actuator.system.parameters import Parameter, breakaway_floor, motion_integrals
from actuator.verdict.verdict import REST, Hunting, classify, decide
from gear.quantities.roles import Breakaway, Gap, Limit, Resolution

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FAR = 1e3  # factor on a limit that is never reached
NEARLY_NONE = 1e-9  # factor on a gain that must not be zero


class Cause(StrEnum):
    """What may let an actuator hunt, and can be removed."""

    STATIC = "breakaway above sliding friction"
    BACKLASH = "backlash"
    INTEGRAL = "integral action"
    LIMITS = "limits"
    SAMPLING = "sampling"
    COUNTS = "counts of the sensors"


STATIC, BACKLASH, INTEGRAL, LIMITS, SAMPLING, COUNTS = Cause


class Removal(NamedTuple):
    """An actuator with one cause removed: other parameters, or another actuator."""

    plant: Actuator
    parameters: dict[str, float]
    text: str


@dataclass(frozen=True, kw_only=True)
class Counterfactual:
    """The same run with one cause removed.

    Attributes
    ----------
    cause : Cause
        What was removed.
    change : str
        How.
    hunting : Hunting
        What it does without.
    """

    cause: Cause
    change: str
    hunting: Hunting

    @property
    def needed(self) -> bool:
        """Whether it comes to rest without this cause."""
        return self.hunting.verdict == REST


@dataclass(frozen=True, kw_only=True)
class Causes:
    """Why an actuator hunts.

    Attributes
    ----------
    hunting : Hunting
        What it does with all its causes.
    energy : CycleEnergy or None
        None without a cycle.
    counterfactuals : tuple of Counterfactual
        One per cause that it has.
    """

    hunting: Hunting
    energy: CycleEnergy | None
    counterfactuals: tuple[Counterfactual, ...]

    def sentence(self) -> str:
        """What it needs to hunt and what not."""
        if not self.hunting.cycles:
            return f"There is no cycle to explain: {self.hunting.verdict}."
        needed = [each.cause for each in self.counterfactuals if each.needed]
        still = [each.cause for each in self.counterfactuals if each.hunting.cycles]
        told = f"Removing {' or '.join(needed)} stops the hunting" if needed else ""
        if needed and still:
            told += f"; removing {' or '.join(still)} does not"
        elif still:
            told = f"Removing {' or '.join(still)} does not stop the hunting"
        driven = "" if self.energy is None else f" The {self.energy.drives} supplies the energy."
        return f"{told or 'No cause was found'}.{driven}"

    def table(self) -> str:
        """What it does with each cause removed, and the energies, as lines of text."""
        width = max(map(len, ["cause removed", *(each.cause for each in self.counterfactuals)]))
        rows = [f"{'cause removed':{width}}  {'verdict':28}  {'amplitude':>11}  {'period':>9}"]
        rows += [
            f"{each.cause:{width}}  {each.hunting.verdict:28}  {_cycle(each.hunting)}" for each in self.counterfactuals
        ]
        rows.insert(1, f"{'none':{width}}  {self.hunting.verdict:28}  {_cycle(self.hunting)}")
        return "\n".join(rows) + (f"\n\n{self.energy.table()}" if self.energy else "")

    def plot(self) -> "Figure":
        """The energies, and the amplitude with each cause removed."""
        from actuator.plots.diagnosis import plot_causes

        return plot_causes(self)


def find_causes(  # noqa: PLR0913 - what is simulated
    plant: Actuator,
    run: Run,
    *,
    inputs: Mapping[str, Signal | float] | None = None,
    start: Mapping[str, float] | None = None,
    resolution: float | None = None,
    compiled: bool | None = None,
    progress: Callable[[float], None] | None = None,
) -> Causes:
    """Energy per cycle, and the run again with one cause removed at a time.

    Parameters
    ----------
    plant : Actuator
        Of the run.
    run : Run
        What is to be explained.
    inputs, start, resolution
        As they were for the run.
    compiled : bool or None
        As for `simulate`.
    progress : callable or None
        Called with the share of the reruns that is done.
    """
    verdict = classify(run)
    found, causes = [], removals(plant, changed_parameters(run)) if verdict.cycles else {}
    for k, (cause, removal) in enumerate(causes.items()):
        again = decide(
            removal.plant,
            float(run.t[-1]),
            inputs=inputs,
            start=_known(start, removal.plant),
            parameters=removal.parameters,
            resolution=resolution,
            compiled=compiled,
        )
        found.append(Counterfactual(cause=cause, change=removal.text, hunting=again.hunting))
        if progress is not None:
            progress((k + 1) / len(causes))
    energy = energy_per_cycle(plant, run, compiled=compiled) if verdict.cycles else None
    return Causes(hunting=verdict, energy=energy, counterfactuals=tuple(found))


def removals(plant: Actuator, parameters: Mapping[str, float] | None = None) -> dict[Cause, Removal]:
    """The actuator with each of its possible causes of hunting removed, by cause; `parameters` differ from defaults."""
    given, system = dict(parameters or {}), plant.system()
    values = {quantity.name: float(quantity.default) for quantity in system.parameters} | given
    floors = {each.name: breakaway_floor(each, values) for each in system.parameters_having(Breakaway)}
    gaps = {each.name: 0.0 for each in system.parameters_having(Gap) if values[each.name] > 0}
    gains = {each.name: _none_of(system, each) for each in motion_integrals(system.parameters) if values[each.name] > 0}
    limits = {each.name: FAR * values[each.name] for each in system.parameters_having(Limit)}
    changes = {
        STATIC: (
            {name: floor for name, floor in floors.items() if floor is not None and floor < values[name]},
            "breakaway friction as low as sliding friction",
        ),
        BACKLASH: (gaps, "all gaps closed"),
        INTEGRAL: (gains, "integral gains zero"),
        LIMITS: (limits, f"limits {FAR:g} times as far"),
    }
    found = {cause: Removal(plant, given | changed, text) for cause, (changed, text) in changes.items() if changed}
    if plant.sampling is not None and plant.controller is not None:
        ideal = replace(plant, sampling=None, sensors=Sensors(), controller=plant.controller.in_continuous_time())
        found[SAMPLING] = Removal(ideal, _kept(given, ideal), "controller in continuous time, sensors ideal")
    if system.parameters_having(Resolution):
        smooth = replace(plant, sensors=plant.sensors.with_each(resolution=None))
        found[COUNTS] = Removal(smooth, _kept(given, smooth), "sensors without resolution")
    return found


def _none_of(system: HybridSystem, gain: Parameter) -> float:
    """Zero, or next to it where a gain must be positive."""
    try:
        system.parameter_values({gain.name: 0.0})
    except ValueError:
        return NEARLY_NONE * gain.default
    return 0.0


def _kept(parameters: Mapping[str, float], plant: Actuator) -> dict[str, float]:
    """Parameters that another actuator has, too."""
    names = {quantity.name for quantity in plant.system().parameters}
    return {name: value for name, value in parameters.items() if name in names}


def _known(start: Mapping[str, float] | None, plant: Actuator) -> dict[str, float]:
    names = {quantity.name for quantity in plant.system().states}
    return {name: value for name, value in (start or {}).items() if name in names}


def _cycle(hunting: Hunting) -> str:
    if not hunting.cycles:
        return f"{'-':>11}  {'-':>9}"
    return f"{1e3 * hunting.amplitude_rad:6.4g} mrad  {hunting.period_s:7.4g} s"
