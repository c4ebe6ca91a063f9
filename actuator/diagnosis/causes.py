"""Why it hunts: the energy each element gives per cycle, and the same run with one cause removed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from actuator.actuator import Actuator
from actuator.diagnosis.cycle_energy import CycleEnergy, changed_parameters, energy_per_cycle
from actuator.parts.sensors import AngleSensor, CurrentSensor, Sensors
from actuator.simulation.run import Run
from actuator.simulation.signals import Signal
from actuator.verdict.verdict import REST, Hunting, classify, decide

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STATIC, BACKLASH, INTEGRAL = "breakaway above sliding friction", "backlash", "integral action"
LIMITS, SAMPLING, COUNTS = "limits", "sampling", "counts of the sensors"
SLIDING = {".breakaway": (".coulomb",), ".static": (".sliding", ".coulomb")}  # what breakaway is compared with
INTEGRALS = ("controller.integral", "controller.speed.integral", "controller.position.integral")
LIMITED = (
    "motor.torque_limit",
    "controller.limit",
    "controller.speed_limit",
    "controller.speed.limit",
    "controller.position.limit",
    "inverter.current_limit",
    "inverter.dc_voltage",
)
FAR = 1e3  # factor on a limit that is never reached


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
    cause, change : str
        What was removed, and how.
    hunting : Hunting
        What it does without.
    """

    cause: str
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
        parts = [f"without {name} it comes to rest" for name in needed]
        parts += [f"without {name} it goes on" for name in still]
        driven = "" if self.energy is None else f"; the {self.energy.drives} gives the energy"
        return f"{'; '.join(parts) or 'no cause was found to remove'}{driven}.".capitalize()

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


def removals(plant: Actuator, parameters: Mapping[str, float] | None = None) -> dict[str, Removal]:
    """The actuator with each of its possible causes of hunting removed, by cause; `parameters` differ from defaults."""
    given = dict(parameters or {})
    values = {quantity.name: float(quantity.default) for quantity in plant.system().parameters} | given
    changes = {
        STATIC: (_without_static(values), "breakaway friction as low as sliding friction"),
        BACKLASH: ({n: 0.0 for n, value in values.items() if n.endswith(".gap") and value > 0}, "all gaps closed"),
        INTEGRAL: ({n: 0.0 for n in INTEGRALS if values.get(n, 0) > 0}, "integral gains of speed and position zero"),
        LIMITS: ({n: FAR * values[n] for n in LIMITED if n in values}, f"limits {FAR:g} times as far"),
    }
    found = {cause: Removal(plant, given | changed, text) for cause, (changed, text) in changes.items() if changed}
    if plant.sampling is not None and plant.controller is not None:
        ideal = replace(plant, sampling=None, sensors=Sensors(), controller=plant.controller.in_continuous_time())
        found[SAMPLING] = Removal(ideal, _kept(given, ideal), "controller in continuous time, sensors ideal")
    if any(getattr(getattr(plant.sensors, name), "resolution", None) for name in ("motor", "load", "current")):
        smooth = replace(plant, sensors=_without_counts(plant.sensors))
        found[COUNTS] = Removal(smooth, _kept(given, smooth), "sensors without resolution")
    return found


def _without_static(values: Mapping[str, float]) -> dict[str, float]:
    found = {}
    for name, value in values.items():
        for ending, others in SLIDING.items():
            partner = next((p for p in (name.removesuffix(ending) + other for other in others) if p in values), None)
            if name.endswith(ending) and partner is not None and values[partner] < value:
                found[name] = values[partner]
    return found


def _without_counts(sensors: Sensors) -> Sensors:
    def smooth(sensor: AngleSensor | CurrentSensor | None) -> object:
        return None if sensor is None else replace(sensor, resolution=None)

    return replace(sensors, **{name: smooth(getattr(sensors, name)) for name in ("motor", "load", "current")})


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
