"""The corners of a tuning in the linear models: contact modes, operating points, and what friction is there."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from actuator.actuator import Actuator
from actuator.linear.jacobians import rates_function, rounding
from actuator.linear.modes import mode_models
from actuator.linear.operating_point import NoEquilibrium, OperatingPoint
from actuator.linear.trim import trim
from actuator.stiction.margins import SLIDING, sliding_of
from studies.specification import Corner
from studies.tuning.plant import defaults_of


@dataclass(frozen=True, kw_only=True)
class CornerModes:
    """The contact modes of one corner, and what friction is there; nothing of it depends on the gains.

    Attributes
    ----------
    corner : Corner
        Name and parameters.
    points : dict of str to OperatingPoint
        By mode; "forward", "backward" and those with a mesh in its gap.
    friction : float
        Dry friction at the load while sliding [N m], half of what lies between forward and backward.
    released : dict of str to float
        Torque at the motor [N m] by which breakaway with the stiction margin exceeds sliding friction, by direction.
    """

    corner: Corner
    points: dict[str, OperatingPoint] = field(repr=False)
    friction: float
    released: dict[str, float]


def corner_modes(plant: Actuator, corner: Corner, stiction: float, start: Mapping[str, float]) -> CornerModes:
    """Contact modes of a corner with the friction there.

    Parameters
    ----------
    plant : Actuator
        As `for_linear_models` makes it.
    corner : Corner
        Its parameters.
    stiction : float
        Factor on all breakaway friction [-].
    start : mapping of str to float
        Gains at which to look for the operating points.

    Raises
    ------
    NoEquilibrium
        Where the actuator cannot slide both ways there: it jams, or its motor is too weak.
    """
    system = plant.system()
    values = defaults_of(system.parameters)
    # a corner may name what linear models are without: the counts of a sensor
    parameters = {name: value for name, value in corner.parameters.items() if name in values} | dict(start)
    found = mode_models(system, parameters=parameters)
    points = {model.name: model.point for model in found if model.name != "stuck"}
    torque, sticky = {}, parameters | slides_as_it_breaks_away(values | parameters, stiction)
    for word in ("forward", "backward"):
        if word not in points:
            raise NoEquilibrium(f"{corner.name}: {found.unreachable[word]}", {})
        torque[word] = points[word].outputs["motor_torque"]
    released = {
        word: abs(trim(system, word, parameters=sticky).outputs["motor_torque"] - torque[word]) for word in torque
    }
    friction = abs(plant.gear.ratio() * (torque["forward"] - torque["backward"])) / 2
    return CornerModes(corner=corner, points=points, friction=friction, released=released)


def slides_as_it_breaks_away(values: Mapping[str, float], factor: float) -> dict[str, float]:
    """Parameters with breakaway friction times a factor, and sliding friction equal to it."""
    sticky = {name: factor * value for name, value in values.items() if name.endswith(tuple(SLIDING))}
    return sticky | {other: sticky[name] for name in sticky if (other := sliding_of(name, values)) is not None}


def moved(point: OperatingPoint, gains: Mapping[str, float]) -> OperatingPoint:
    """The operating point with other gains: the same where it still rests, else found anew from there."""
    names = [parameter.name for parameter in point.system.parameters]
    p = point.p.copy()
    for name, value in gains.items():
        p[names.index(name)] = value
    rates = rates_function(point.system)(point.x, point.m, point.u, p).full().ravel()
    scale = np.array([quantity.nominal for quantity in point.system.states])
    if (abs(rates) / scale <= rounding(point.system, point.x, point.m, point.u, p)).all():
        return OperatingPoint(system=point.system, x=point.x, m=point.m, u=point.u, p=p, rates=rates)
    word = {1: "forward", 0: "stuck", -1: "backward"}
    contacts = {
        name.removesuffix(".motion"): word[int(value)]
        for name, value in zip(point.system.modes, np.round(point.m), strict=True)
        if name.endswith(".motion")
    }
    inputs = {quantity.name: float(value) for quantity, value in zip(point.system.inputs, point.u, strict=True)}
    values = dict(zip(names, p.tolist(), strict=True))
    return trim(point.system, contacts, inputs=inputs, guess=point.states, parameters=values)


def in_flight(point: OperatingPoint, resting: OperatingPoint) -> OperatingPoint:
    """A mesh in its gap, in the state of the point that it leaves."""
    return OperatingPoint(system=point.system, x=resting.x, m=point.m, u=resting.u, p=resting.p, rates=resting.rates)
