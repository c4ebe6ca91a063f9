"""How stiction holds a standstill, and when it breaks away: once the integrator has driven the motor that far."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.orbits.flow import FlowMap, NoOrbit, flow_map
from actuator.orbits.segments import cut_motion
from actuator.simulation.engine import engine
from actuator.simulation.prepared import EngineOptions
from actuator.simulation.signals import Piece
from actuator.system.contact_modes import STUCK, contact_labels, is_at_rest
from actuator.system.hybrid import INACTIVE, MARGIN_BAND, EventKind, HybridSystem, require_sticking
from gear.quantities.roles import ShaftSpeed

STILL_RATE = 1e-6  # rate of a state over its nominal size [1/s] that does not count as moving
PERMANENT = 1e4  # s, after which a standstill is called so


class NotAtRest(ValueError):
    """The state is not held by stiction: the message says by which margin."""


class Hold(NamedTuple):
    """How far a contact is from breaking away, alone or with the group that holds with it."""

    margin: float  # smaller of static - s and static + s, over its usual force or torque
    reserve: float  # the same, over the friction limit: 1 unloaded, 0 at breakaway


@dataclass(frozen=True, kw_only=True, eq=False)
class BreakawayPrediction:
    """A standstill that stiction holds, and its end.

    Attributes
    ----------
    holds : dict of str to Hold
        Per contact that sticks, at the start.
    position_error : float
        [rad]; nan without a reference.
    drift_time : float
        Time until a contact breaks away [s], under integral action; infinite where none does.
    breaks : str
        The event at which it does; empty where none does.
    """

    system: HybridSystem = field(repr=False)
    holds: dict[str, Hold]
    position_error: float
    drift_time: float
    breaks: str


def predict_breakaway(
    plant: Actuator | HybridSystem,
    state: Mapping[str, float],
    *,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    compiled: bool | None = None,
) -> BreakawayPrediction:
    """How stiction holds an actuator in a state, and when it breaks away.

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
        Where a contact slides in this state, or a shaft is held by none.
    """
    system = plant.system() if isinstance(plant, Actuator) else plant
    require_sticking(system, "predict_breakaway")
    x, u, p = system.state_vector(state), system.input_vector(inputs), system.parameter_values(parameters)
    x, m = engine(system, EngineOptions(compiled=compiled)).settle(0.0, x, np.zeros(len(system.modes)), u, p)
    labels = contact_labels(system, m)
    moving = [] if is_at_rest(list(labels.values())) else [f"{name} is {label}" for name, label in labels.items()]
    if not moving:  # what no contact holds may hang in a gap
        moving = find_unsupported(system, x, m, u, p)
    if moving or not labels:
        raise NotAtRest(f"{system.name}: stiction does not hold this state: {', '.join(moving) or 'nothing sticks'}")
    machine = flow_map(system, compiled=compiled)
    time, name = _drift(machine, x, machine.integer_modes(m), u, p)
    return BreakawayPrediction(
        system=system,
        holds=_holds(system, x, m, u, p),
        position_error=_error(system, x, m, u, p),
        drift_time=time,
        breaks=name,
    )


def find_unsupported(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> list[str]:
    """Shafts that move or accelerate in a state."""
    rates = system.flow(x, m, u, p).full().ravel()
    return [
        f"{state.owner} moves"
        for state, speed, rate in zip(system.states, x, rates, strict=True)
        if state.role(ShaftSpeed) is not None and max(abs(speed), abs(rate)) > STILL_RATE * state.nominal
    ]


def _holds(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> dict[str, Hold]:
    margins = zip(system.events, system.margins(x, m, u, p).full().ravel(), strict=True)
    sides = {(event.contacts, event.side): margin for event, margin in margins if event.kind is EventKind.FRICTION}
    found: dict[str, Hold] = {}
    stuck = {name for name, label in contact_labels(system, m).items() if label == STUCK}
    for contacts in {contacts for contacts, _ in sides}:
        upper, lower = sides[contacts, 1], sides[contacts, -1]
        if upper == lower == INACTIVE + MARGIN_BAND:
            continue
        # (limit - load) and (limit + load) over the same size: their mean is the limit
        hold = Hold(float(min(upper, lower)), float(2 * min(upper, lower) / (upper + lower)))
        for name in stuck & set(contacts):  # a contact lets go with the first group that does
            found[name] = min(found.get(name, hold), hold, key=lambda one: one.reserve)
    return {name: found[name] for name in contact_labels(system, m) if name in found}


def _error(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> float:
    names = [quantity.name for quantity in system.outputs]
    if "position_error" not in names:
        return float("nan")
    return float(system.outputs_function(x, m, u, p)[names.index("position_error")])


def _drift(machine: FlowMap, x: np.ndarray, m: tuple[int, ...], u: np.ndarray, p: np.ndarray) -> tuple[float, str]:
    """Time to breakaway and its event; infinite, "" where the controller comes to rest first."""
    length, passed = 1.0, 0.0
    while passed < PERMANENT:
        if (abs(machine.rate(x, m, u, p)) < STILL_RATE * machine.nominal).all():
            return float("inf"), ""
        window = engine(machine.system, EngineOptions(tolerance=1e-9, compiled=machine.compiled)).run(
            0.0, length, x, np.array(m, float), p, [Piece(float(value)) for value in u]
        )
        for time, after in window.events:
            if not is_at_rest(list(contact_labels(machine.system, after).values())):
                return _exactly(machine, x, m, u, p, float(time), passed)
        x, m, passed, length = window.end[0], machine.integer_modes(window.end[1]), passed + length, 2 * length
    return float("inf"), ""


def _exactly(
    machine: FlowMap, x: np.ndarray, m: tuple[int, ...], u: np.ndarray, p: np.ndarray, guess: float, passed: float
) -> tuple[float, str]:
    """The breakaway near `guess`, from the margins themselves."""
    pieces, _ = cut_motion(machine, x, m, u, p, guess * (1 + 1e-3) + 1e-6)
    for piece in pieces:
        passed += piece.duration
        if piece.fired < machine.events and machine.system.events[piece.fired].kind is EventKind.FRICTION:
            return passed, machine.names[piece.fired]
    raise NoOrbit(f"{machine.system.name}: the end of the standstill at {passed + guess:.9g} s was not found again")
