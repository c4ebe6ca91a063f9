"""Countermeasures against hunting that the controller of an actuator offers, as actuators with parameters to simulate.

Their settings rest on the cycle and on the torques that stiction holds; see `controllers.countermeasures`.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.diagnosis.cycle_energy import changed_parameters
from actuator.parts.sensors import Sensors
from actuator.simulation.run import Run
from actuator.stiction.breakaway import NotAtRest
from actuator.stiction.equilibrium_set import EquilibriumSet, find_equilibrium_set
from actuator.system.contact_modes import find_standstill
from actuator.system.drive import ANGLES
from actuator.system.parameters import with_values
from actuator.verdict.verdict import classify
from controllers.controller import Controller
from controllers.countermeasures import UNKNOWN, StickingCycle


class Candidate(NamedTuple):
    """A remedy with its setting, and what is predicted of it: the largest error at rest [rad], nan where nothing is.

    `period` is that [s] of a motion that the remedy itself makes.
    """

    name: str
    setting: str
    plant: Actuator
    parameters: dict[str, float]
    error: float
    period: float = UNKNOWN


def find_candidates(plant: Actuator, run: Run) -> list[Candidate]:
    """Remedies that suit the controller, with their settings.

    Raises
    ------
    ValueError
        Where there is no controller, or it offers none.
    """
    if plant.controller is None:
        raise ValueError(f"{plant.name}: countermeasures are offered by a controller, and there is none")
    given = changed_parameters(run)
    law: Controller = with_values(plant.controller, "controller", given)
    try:
        offered = law.countermeasures(_cycle(plant, run))
    except ValueError as error:
        raise ValueError(f"{plant.name}: {error}") from None
    plants = {id(each.controller): _with_controller(plant, each.controller) for each in offered}
    plants[id(law)] = plant
    return [
        Candidate(
            name=each.name,
            setting=each.setting,
            plant=plants[id(each.controller)],
            parameters=given | {f"controller.{path}": value for path, value in each.numbers.items()},
            error=each.error,
            period=each.period,
        )
        for each in offered
    ]


def _with_controller(plant: Actuator, controller: Any) -> Actuator:
    """The actuator with another controller, without the sensors that this one does not read."""
    unread = {name: None for name in ANGLES if name not in controller.reads()}
    return replace(plant, controller=controller, sensors=replace(plant.sensors, **unread))


def _cycle(plant: Actuator, run: Run) -> StickingCycle:
    verdict, held = classify(run), _held(plant, run)
    late = run.t >= run.t[-1] - verdict.period_s
    return StickingCycle(
        amplitude=verdict.amplitude_rad,
        half=(held.upper - held.lower) / 2,
        worst_error=lambda gain: max(abs(error) for error in held.static_errors(gain)),
        speed=float(abs(run["motor_speed"][late]).max()),
        lost=float(abs(run["motor_angle_at_load"] - run["load_angle"]).max()),
        ratio=plant.gear.ratio(),
        sampling=plant.sampling,
    )


def _held(plant: Actuator, run: Run) -> EquilibriumSet:
    """Motor torques that stiction holds in the last standstill of the run; what the motor went through without one."""
    for k in np.flatnonzero(find_standstill(run.modes))[-1:]:
        try:
            return find_equilibrium_set(
                replace(plant, sensors=Sensors()), run.state(int(k)), parameters=changed_parameters(run)
            )
        except NotAtRest:
            break
    late = run["motor_torque"][run.t >= run.t[-1] / 2]
    return EquilibriumSet(lower=float(late.min()), upper=float(late.max()))
