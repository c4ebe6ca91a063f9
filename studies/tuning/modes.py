"""The corners of a tuning in the linear models: contact modes, operating points, and the friction there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from actuator.actuator import Actuator
from actuator.linear.jacobians import rates_function, rounding
from actuator.linear.modes import ModeModel, linearize_modes
from actuator.linear.operating_point import NoEquilibrium, OperatingPoint
from actuator.linear.trim import trim
from actuator.system.contact_modes import FREE, STUCK
from actuator.system.parameters import Parameter
from gear.quantities.roles import Breakaway
from studies.corners import Corner
from studies.tuning.plant import defaults_of


@dataclass(frozen=True, kw_only=True)
class CornerModes:
    """The contact modes of one corner, and the friction there; independent of the gains.

    Attributes
    ----------
    corner : Corner
        Name and parameters.
    points : dict of str to OperatingPoint
        By mode: "forward", "backward" and those with separated teeth.
    sliding : dict of str to str
        By mode, the sliding mode with all teeth in contact: itself, or the one that separated teeth leave.
    friction : float
        Dry friction at the load while sliding [N m]: half the difference between forward and backward.
    released : dict of str to float
        By direction, the motor torque [N m] by which breakaway with the stiction margin exceeds sliding friction.
    """

    corner: Corner
    points: dict[str, OperatingPoint] = field(repr=False)
    sliding: dict[str, str] = field(repr=False)
    friction: float
    released: dict[str, float]


def corner_modes(plant: Actuator, corner: Corner, stiction: float, start: Mapping[str, float]) -> CornerModes:
    """Contact modes of a corner with the friction there.

    Parameters
    ----------
    plant : Actuator
        As `prepare_linear` makes it.
    corner : Corner
        Its parameters.
    stiction : float
        Factor on all breakaway friction [-].
    start : mapping of str to float
        Gains at which to look for the operating points.

    Raises
    ------
    NoEquilibrium
        Where the actuator cannot slide both ways there: it is self-locking, or its motor is too weak.
    """
    system = plant.system()
    values = defaults_of(system.parameters)
    # a corner may name what linear models are without: the counts of a sensor
    parameters = {name: value for name, value in corner.parameters.items() if name in values} | dict(start)
    found = linearize_modes(system, parameters=parameters)
    moving = [model for model in found if model.name != STUCK]
    points = {model.name: model.point for model in moving}
    sliding = {model.name: _left_by(model, moving).name for model in moving}
    torque, sticky = {}, parameters | slide_at_breakaway(system.parameters, values | parameters, stiction)
    for word in ("forward", "backward"):
        if word not in points:
            raise NoEquilibrium(f"{corner.name}: {found.unreachable[word]}", {})
        torque[word] = points[word].outputs["motor_torque"]
    released = {
        word: abs(trim(system, word, parameters=sticky).outputs["motor_torque"] - torque[word]) for word in torque
    }
    friction = abs(plant.gear.ratio() * (torque["forward"] - torque["backward"])) / 2
    return CornerModes(corner=corner, points=points, sliding=sliding, friction=friction, released=released)


def _left_by(model: ModeModel, models: Sequence[ModeModel]) -> ModeModel:
    """The sliding mode that a mode with separated teeth leaves; a mode in equilibrium itself."""
    if model.equilibrium:
        return model
    return next(
        other
        for other in models
        if other.equilibrium and all(label in (FREE, other.contacts[name]) for name, label in model.contacts.items())
    )


def slide_at_breakaway(parameters: Sequence[Parameter], values: Mapping[str, float], factor: float) -> dict[str, float]:
    """Parameters with breakaway friction times a factor, and sliding friction equal to it."""
    found: dict[str, float] = {}
    for parameter in parameters:
        role = parameter.role(Breakaway)
        if role is not None:
            names = [parameter.name, *([f"{parameter.owner}.{role.floor}"] if isinstance(role.floor, str) else [])]
            found |= {name: factor * values[parameter.name] for name in names if name in values}
    return found


def move_point(point: OperatingPoint, gains: Mapping[str, float]) -> OperatingPoint:
    """The operating point with other gains: the same state if that is still in equilibrium, else trimmed from it."""
    names = [parameter.name for parameter in point.system.parameters]
    p = point.p.copy()
    for name, value in gains.items():
        p[names.index(name)] = value
    rates = rates_function(point.system)(point.x, point.m, point.u, p).full().ravel()
    scale = np.array([quantity.nominal for quantity in point.system.states])
    if (abs(rates) / scale <= rounding(point.system, point.x, point.m, point.u, p)).all():
        return OperatingPoint(system=point.system, x=point.x, m=point.m, u=point.u, p=p, rates=rates)
    word = {1: "forward", 0: "stuck", -1: "backward"}
    modes = dict(zip(point.system.modes, np.round(point.m), strict=True))
    contacts = {contact.name: word[int(modes[contact.motion])] for contact in point.system.contacts}
    inputs = {quantity.name: float(value) for quantity, value in zip(point.system.inputs, point.u, strict=True)}
    values = dict(zip(names, p.tolist(), strict=True))
    return trim(point.system, contacts, inputs=inputs, guess=point.states, parameters=values)


def separate(point: OperatingPoint, resting: OperatingPoint) -> OperatingPoint:
    """The operating point of a mode with separated teeth, in the state of the sliding point that it leaves."""
    return OperatingPoint(system=point.system, x=resting.x, m=point.m, u=resting.u, p=resting.p, rates=resting.rates)
