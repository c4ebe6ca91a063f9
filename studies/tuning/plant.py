"""What is tuned: gains that a controller declares, their start in closed form, the dead band of its integral."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

from actuator.actuator import Actuator
from actuator.linear.sampled import without_quantization
from actuator.system.hybrid import HybridSystem
from actuator.system.parameters import Parameter, with_values
from controllers.controller import Controller, integrating_law, prefix_of_integral
from controllers.countermeasures import with_integral
from controllers.integral import IntegralRemedies
from gear.quantities.roles import LoopSignal
from studies.files import StudyError
from studies.specification import Criterion, Demand

OWNER = "controller."  # of the gains, in the names of parameters
ROOM = 1.5  # bandwidth of the position loop at the start, over the demanded one


class NotTunable(StudyError):
    """No gains meet the demands, or the actuator cannot be tuned here."""


class Effort(NamedTuple):
    """A bound on an output in a step: the criterion, the output, the limit and its unit."""

    criterion: Criterion
    output: str
    limit: float
    unit: str


def tunable(plant: Actuator) -> Controller:
    """The controller of an actuator; NotTunable with the reason where it cannot be tuned."""
    controller = plant.controller
    if controller is None:
        raise NotTunable(f"{plant.name}: tuning needs a controller, and there is none")
    try:
        controller.tunable_gains()
    except ValueError as error:
        raise NotTunable(f"{plant.name}: {error}") from None
    return controller


def gains_of(plant: Actuator) -> tuple[str, ...]:
    """Gains that can be tuned."""
    return tuple(f"{OWNER}{name}" for name in tunable(plant).tunable_gains())


def dead_band_of(plant: Actuator) -> str:
    """Name of the dead band of the integral."""
    return f"{prefix_of_integral(tunable(plant))}remedies.dead_band"


def loops_of(system: HybridSystem) -> tuple[str, str]:
    """Signals at which margins are demanded: of the outer loop, and the torque reference."""
    signals = [role.signal for quantity in system.inputs if (role := quantity.role(LoopSignal))]
    return ("speed_reference" if "speed_reference" in signals else "position", "torque_reference")


def efforts_of(demand: Demand, system: HybridSystem) -> list[Effort]:
    """Demands on current and torque in a step.

    Raises
    ------
    NotTunable
        For a current demand on a motor without current.
    """
    found = []
    if demand.peak_current is not None:
        if "current" not in [quantity.name for quantity in system.outputs]:
            raise NotTunable(f"{system.name}: its motor has no current; demand a peak_torque instead of a peak_current")
        found.append(Effort(Criterion.PEAK_CURRENT, "current", demand.peak_current, "A"))
    if demand.peak_torque is not None:
        found.append(Effort(Criterion.PEAK_TORQUE, "motor_torque", demand.peak_torque, "N m"))
    return found


def inertia_at_motor(plant: Actuator) -> float:
    """Inertia of motor, gear and load at the motor [kg m^2]."""
    turns = {name: float(value) for name, value in plant.gear.speed_ratios().items()}
    own = turns[plant.gear.input]
    total = sum(shaft.inertia * (turns[name] / own) ** 2 for name, shaft in plant.gear.shafts.items())
    return total + plant.motor.rotor_inertia() + plant.load.inertia_at(0.0) * (turns[plant.gear.output] / own) ** 2


def initial_gains(plant: Actuator, demand: Demand) -> dict[str, float]:
    """Gains by loop shaping on the inertia at the motor."""
    bandwidth, inertia = 2 * math.pi * demand.bandwidth * ROOM, inertia_at_motor(plant)
    found = tunable(plant).gains_for_bandwidth(bandwidth, inertia, plant.gear.ratio())
    return {f"{OWNER}{name}": value for name, value in found.items()}


# -- the dead band ----------------------------------------------------------------------------------------


def prepare_linear(plant: Actuator) -> Actuator:
    """The actuator without dead band of its integral, and without quantization."""

    def changed(remedies: IntegralRemedies | None) -> IntegralRemedies | None:
        return None if remedies is None else replace(remedies, dead_band=None)

    return without_quantization(_with_remedies(plant, changed))


def add_dead_band(plant: Actuator) -> Actuator:
    """The actuator with a dead band of its integral, of width zero where it had none."""

    def changed(remedies: IntegralRemedies | None) -> IntegralRemedies:
        options = remedies or IntegralRemedies()
        return replace(options, dead_band=options.dead_band or 0.0)

    return _with_remedies(plant, changed)


def _with_remedies(plant: Actuator, changed: Callable[[IntegralRemedies | None], IntegralRemedies | None]) -> Actuator:
    controller = tunable(plant)
    return replace(plant, controller=with_integral(controller, remedies=changed(integrating_law(controller).remedies)))


def with_dead_band(plant: Actuator, gains: Mapping[str, float], error: float) -> dict[str, float]:
    """Gains with the dead band that allows this error [rad] at the load.

    A PID integrates the error itself, a cascade that of the motor speed [rad/s], ratio * position gain times as large.
    """
    law: Controller = with_values(tunable(plant), "controller", gains)
    return {**gains, dead_band_of(plant): error * abs(law.error_at_integral(plant.gear.ratio()))}


def defaults_of(parameters: tuple[Parameter, ...]) -> dict[str, float]:
    """Values by name."""
    return {parameter.name: float(parameter.default) for parameter in parameters}
