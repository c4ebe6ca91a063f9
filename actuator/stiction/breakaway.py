"""How stiction holds a standstill, and for how long: until the integrator has driven the motor torque to its edge."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.orbits.cut_motion import cut_motion
from actuator.orbits.flow import FlowMap, NoOrbit, flow_map
from actuator.simulation.engine import engine
from actuator.simulation.prepared import EngineOptions
from actuator.simulation.run import STUCK, contact_labels, contact_names
from actuator.simulation.signals import Piece
from actuator.system.hybrid import HybridSystem

RATES = 1e-6  # rate of a state over its nominal size [1/s] that does not count as moving
LONGEST = 1e4  # s, after which a standstill is called permanent


class NotAtRest(ValueError):
    """The state is not held by stiction: the message says by which margin."""


class Hold(NamedTuple):
    """How far a contact is from letting go."""

    margin: float  # smaller of static - s and static + s, over its usual force or torque
    reserve: float  # the same, over the friction limit: 1 unloaded, 0 at breakaway


@dataclass(frozen=True, kw_only=True, eq=False)
class Rest:
    """A standstill with all contacts stuck, and its end.

    Attributes
    ----------
    holds : dict of str to Hold
        Per contact, at the start.
    position_error : float
        [rad]; nan without a reference.
    drift_time : float
        Time until a contact lets go [s], under integral action; infinite where none does.
    breaks : str
        The margin at which it lets go; empty where none does.
    """

    system: HybridSystem = field(repr=False)
    holds: dict[str, Hold]
    position_error: float
    drift_time: float
    breaks: str


def rest(
    plant: Actuator | HybridSystem,
    state: Mapping[str, float],
    *,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    compiled: bool | None = None,
) -> Rest:
    """How stiction holds an actuator in a state, and when it lets go.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        What stands.
    state : mapping of str to float
        States by name, as of `Run.state`; those not named have their initial value.
    inputs, parameters : mapping of str to float
        By name.
    compiled : bool or None
        As for `simulate`.

    Raises
    ------
    NotAtRest
        Where a contact slides in this state.
    """
    system = plant.system() if isinstance(plant, Actuator) else plant
    x, u, p = system.state_vector(state), system.input_vector(inputs), system.parameter_values(parameters)
    x, m = engine(system, EngineOptions(compiled=compiled)).settle(0.0, x, np.zeros(len(system.modes)), u, p)
    labels = contact_labels(system.modes, m)
    moving = [name for name, label in labels.items() if label != STUCK]
    if moving:
        text = ", ".join(f"{name} is {labels[name]}" for name in moving)
        raise NotAtRest(f"{system.name}: stiction does not hold this state: {text}")
    machine = flow_map(system, compiled=compiled)
    time, name = _drift(machine, x, machine.words(m), u, p)
    return Rest(
        system=system,
        holds=_holds(system, x, m, u, p),
        position_error=_error(system, x, m, u, p),
        drift_time=time,
        breaks=name,
    )


def _holds(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> dict[str, Hold]:
    margins = dict(zip(system.margin_names, system.margins(x, m, u, p).full().ravel(), strict=True))
    found = {}
    for name in contact_names(system.modes):
        upper, lower = margins[f"{name} upper"], margins[f"{name} lower"]
        # (static - s) and (static + s) over the same size: their mean is the limit
        found[name] = Hold(float(min(upper, lower)), float(2 * min(upper, lower) / (upper + lower)))
    return found


def _error(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> float:
    names = [quantity.name for quantity in system.outputs]
    if "position_error" not in names:
        return float("nan")
    return float(system.outputs_function(x, m, u, p)[names.index("position_error")])


def _drift(machine: FlowMap, x: np.ndarray, m: tuple[int, ...], u: np.ndarray, p: np.ndarray) -> tuple[float, str]:
    """Time to the first contact that lets go, and its margin; infinite, "" where the controller comes to rest first."""
    length, passed = 1.0, 0.0
    while passed < LONGEST:
        if (abs(machine.rate(x, m, u, p)) < RATES * machine.nominal).all():
            return float("inf"), ""
        window = engine(machine.system, EngineOptions(tolerance=1e-9, compiled=machine.compiled)).run(
            0.0, length, x, np.array(m, float), p, [Piece(float(value)) for value in u]
        )
        for time, after in window.events:
            labels = contact_labels(machine.system.modes, after)
            if any(label != STUCK for label in labels.values()):
                return _exactly(machine, x, m, u, p, float(time), passed)
        x, m, passed, length = window.end[0], machine.words(window.end[1]), passed + length, 2 * length
    return float("inf"), ""


def _exactly(
    machine: FlowMap, x: np.ndarray, m: tuple[int, ...], u: np.ndarray, p: np.ndarray, guess: float, passed: float
) -> tuple[float, str]:
    """The release near `guess`, from the margins themselves."""
    pieces, _ = cut_motion(machine, x, m, u, p, guess * (1 + 1e-3) + 1e-6)
    for piece in pieces:
        passed += piece.duration
        if piece.fired < machine.events and machine.names[piece.fired].endswith(("upper", "lower")):
            return passed, machine.names[piece.fired]
    raise NoOrbit(f"{machine.system.name}: the end of the standstill at {passed + guess:.9g} s was not found again")
