"""Energy per period of a cycle: what each element gives to the mechanics, and what it takes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator.actuator import Actuator
from actuator.simulation.run import Run
from actuator.simulation.simulate import simulate
from actuator.system.parameters import with_values
from actuator.verdict.verdict import classify
from controllers.controller import Controller
from gear.quantities.roles import FrictionHeat

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 20_000  # in a period
CHANGED = 1e-12  # relative difference from a default
SHOWN = 1e-3  # part of the largest share from which one is shown


@dataclass(frozen=True, kw_only=True)
class CycleEnergy:
    """Energy that elements give to the mechanics in one period; negative where they take it.

        sum of all elements = change of the mechanical energy, zero on a periodic orbit

    Attributes
    ----------
    period_s : float
        [s].
    elements : dict of str to float
        Parts of the motor torque by the law they come from, the load, the friction of each contact, all damping [J].
    change : float
        Of the mechanical energy over the period [J].
    """

    period_s: float
    elements: dict[str, float]
    change: float

    @property
    def unexplained(self) -> float:
        """What the elements do not add up to [J]; the error to be expected in each."""
        return sum(self.elements.values()) - self.change

    @property
    def drives(self) -> str:
        """The element that gives most."""
        return max(self.elements, key=lambda name: self.elements[name])

    def shown(self) -> dict[str, float]:
        """Elements that matter, the largest giver first."""
        least = SHOWN * max(map(abs, self.elements.values()))
        kept = {name: value for name, value in self.elements.items() if abs(value) >= least}
        return dict(sorted(kept.items(), key=lambda pair: -pair[1]))

    def table(self) -> str:
        """Elements and their energy as lines of text."""
        shown = self.shown()
        width = max(map(len, shown))
        rows = [f"{name:{width}}  {1e3 * value:+10.4g} mJ" for name, value in shown.items()]
        return "\n".join(
            [f"Energy given to the mechanics in a period of {self.period_s:.4g} s:", *rows,
             f"{'unexplained':{width}}  {1e3 * self.unexplained:+10.4g} mJ"]
        )  # fmt: skip

    def plot(self) -> "Figure":
        """Bars, the largest giver on top."""
        from actuator.plots.diagnosis import plot_energy

        return plot_energy(self)


def energy_per_cycle(plant: Actuator, run: Run, *, compiled: bool | None = None) -> CycleEnergy:
    """Energy balance of one more period of the cycle that a run ends in, on a fine grid.

    Parameters
    ----------
    plant : Actuator
        Of the run.
    run : Run
        It must end in a cycle (`classify` says so).
    compiled : bool or None
        As for `simulate`.

    Raises
    ------
    ValueError
        Where the run does not end in a cycle.
    """
    verdict = classify(run)
    if not verdict.cycles:
        raise ValueError(f"{plant.name}: no energy per cycle: {verdict.verdict}, {verdict.reason}")
    parameters = changed_parameters(run)
    cycle = simulate(
        plant,
        verdict.period_s,
        inputs={quantity.name: float(run[quantity.name][-1]) for quantity in run.system.inputs},
        start=run.state(),
        parameters=parameters,
        resolution=verdict.period_s / POINTS,
        compiled=compiled,
    )
    powers = {name: torque * cycle["motor_speed"] for name, torque in _torques(plant, cycle, parameters).items()}
    powers["load"] = cycle["total_load_torque"] * cycle["load_speed"]
    for output in cycle.system.outputs:
        if (heat := output.role(FrictionHeat)) is not None:
            powers[f"friction of {heat.contact}"] = -cycle[output.name]
    powers["damping"] = -cycle["damping_loss"]
    energy = cycle["mechanical_energy"]
    return CycleEnergy(
        period_s=verdict.period_s,
        elements={name: float(np.trapezoid(power, cycle.t)) for name, power in powers.items()},
        change=float(energy[-1] - energy[0]),
    )


def changed_parameters(run: Run) -> dict[str, float]:
    """Parameters of a run that are not the defaults of its system."""
    pairs = zip(run.system.parameters, run.parameters, strict=True)
    return {q.name: float(value) for q, value in pairs if abs(value - q.default) > CHANGED * abs(q.default)}


def _torques(plant: Actuator, cycle: Run, given: dict[str, float]) -> dict[str, np.ndarray]:
    """Motor torque by the part of the control law it comes from [N m]; what is left is named by what is between."""
    total = cycle["motor_torque"]
    if plant.controller is None:
        return {"motor torque": total}
    law: Controller = with_values(plant.controller, "controller", given)
    found = law.contributions(cycle.signals, plant.gear.ratio())
    return found | {law.remainder: total - sum(found.values())}
