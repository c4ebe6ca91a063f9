"""What stiction can hold: the set of positions and integrator states at rest, and how long it holds them.

While all contacts stick nothing but the controller moves: angles, normal forces and friction limits stay. The margins
static - s and static + s of the contacts are then linear in the motor torque M, and what stiction holds is an interval,

    lower <= M <= upper

through which the integrator drives M until a contact lets go.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.hunting.flow_map import FlowMap, NoOrbit, Segment, flow_map
from actuator.hybrid import HybridSystem
from actuator.parts.motor import TorqueSource
from actuator.simulation.engine import EngineOptions, engine
from actuator.simulation.run import FREE, STUCK, contact_labels, contact_names
from actuator.simulation.signals import Piece

RATES = 1e-6  # rate of a state over its nominal size [1/s] that does not count as moving
SLOPE = 1e-9  # part of the largest slope of a margin over the torque that is rounding
TRIED = 401  # motor torques, in search of one that holds
HUGE, HALVINGS = 1e9, 60  # N m; 2^-60 is below rounding
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
    pieces: list[Segment] = machine.segments(x, m, u, p, guess * (1 + 1e-3) + 1e-6)[0]
    for piece in pieces:
        passed += piece.duration
        if piece.fired < machine.events and machine.names[piece.fired].endswith(("upper", "lower")):
            return passed, machine.names[piece.fired]
    raise NoOrbit(f"{machine.system.name}: the end of the standstill at {passed + guess:.9g} s was not found again")


@dataclass(frozen=True, kw_only=True)
class RestSet:
    """The motor torques that stiction holds in one standstill, and what follows for a position loop.

    Attributes
    ----------
    lower, upper : float
        Motor torque [N m] at which a contact lets go backward and forward.
    redundant : bool
        Whether more contacts stick than there are shafts to lock. Equilibrium then does not tell which of them carries
        how much; the bounds belong to the share that the joint decision of the modes takes, and are not exact: another
        share may hold a little more, or less.
    """

    lower: float
    upper: float
    redundant: bool = False

    def static_errors(self, gain: float) -> tuple[float, float]:
        """Smallest and largest position error [rad] at rest, with `gain` of motor torque per error [N m/rad]."""
        first, second = self.lower / gain, self.upper / gain
        return min(first, second), max(first, second)

    def threshold(self, gain: float) -> float:
        """Largest change of the reference [rad] that may move nothing, with `gain` of torque per error [N m/rad]."""
        return (self.upper - self.lower) / abs(gain)

    def drift_time(self, torque: float, rate: float) -> float:
        """Time [s] until a motor torque that grows at `rate` [N m/s] from `torque` lets go; infinite for rate 0."""
        if rate == 0:
            return math.inf
        return ((self.upper if rate > 0 else self.lower) - torque) / rate


def rest_set(
    plant: Actuator,
    state: Mapping[str, float],
    *,
    load_torque: float = 0.0,
    parameters: Mapping[str, float] | None = None,
) -> RestSet:
    """Motor torques that stiction holds in a standstill, all contacts decided together.

    While all contacts stick nothing moves, so normal forces and friction limits stay what they are, and the margins
    are linear in the motor torque: what holds is an interval.

    Parameters
    ----------
    plant : Actuator
        What stands; motor and controller do not matter.
    state : mapping of str to float
        Angles of its shafts by state name (other states are ignored).
    load_torque : float
        Input on the output shaft [N m].
    parameters : mapping of str to float
        Of gear and load, by name (others are ignored).

    Raises
    ------
    NotAtRest
        Where no motor torque holds it.
    """
    bare = replace(
        plant,
        motor=TorqueSource(),
        controller=None,
        inverter=None,
        name=f"{plant.name} without drive",
        **_no_extras(plant),
    )
    system = bare.system()
    known = {parameter.name for parameter in system.parameters}
    p = system.parameter_values({name: value for name, value in (parameters or {}).items() if name in known})
    names = {quantity.name for quantity in system.states}
    x = system.state_vector({name: v for name, v in state.items() if name in names and name.endswith(".angle")})
    none = np.zeros(len(system.margin_names))

    def holds(torque: float) -> bool:
        u = system.input_vector({"torque_reference": torque, "load_torque": load_torque})
        _, m, fault = system.reset(none, x, np.zeros(len(system.modes)), u, p)
        labels = contact_labels(system.modes, np.round(m.full().ravel()))
        return not float(fault) and all(label in (STUCK, FREE) for label in labels.values())

    candidates = _candidates(system, x, load_torque, p)
    inside = next((torque for torque in candidates if holds(torque)), None)
    if inside is None:
        raise NotAtRest(
            f"{plant.name}: stiction holds this standstill at no motor torque; {len(candidates)} between "
            f"{candidates.min():.6g} and {candidates.max():.6g} N m were tried"
        )
    lower, upper = (_edge(holds, inside, direction) for direction in (-1.0, 1.0))
    return RestSet(lower=lower, upper=upper, redundant=_locked(system, x, load_torque, inside, p) > _shafts(system))


def _locked(system: HybridSystem, x: np.ndarray, load_torque: float, torque: float, p: np.ndarray) -> int:
    """Contacts that stick; a mesh in its gap does not."""
    u = system.input_vector({"torque_reference": torque, "load_torque": load_torque})
    m = system.reset(np.zeros(len(system.margin_names)), x, np.zeros(len(system.modes)), u, p)[1]
    labels = contact_labels(system.modes, np.round(m.full().ravel()))
    return sum(label == STUCK for label in labels.values())


def _shafts(system: HybridSystem) -> int:
    """Shafts that contacts can lock, each with a speed of its own."""
    return sum(quantity.name.endswith(".speed") for quantity in system.states)


def _no_extras(plant: Actuator) -> dict[str, None]:
    """Parts beside motor and controller that a bare actuator does not have."""
    kept = {"motor", "gear", "load", "name", "controller", "inverter"}
    return {f.name: None for f in fields(plant) if f.name not in kept and f.default is None}


def _candidates(system: HybridSystem, x: np.ndarray, load_torque: float, p: np.ndarray) -> np.ndarray:
    """Motor torques to try, from the middle outward, between those at which the contacts by themselves let go.

    Where several contacts lock the same shafts, one of them alone says little: the others take over.
    """
    none = np.zeros(len(system.margin_names))
    motions = np.array([name.endswith(".motion") for name in system.modes])
    _, m, _ = system.reset(none, x, np.zeros(len(system.modes)), system.input_vector({"load_torque": load_torque}), p)
    m = np.where(motions, 0.0, np.round(m.full().ravel()))

    def margins(torque: float) -> np.ndarray:
        u = system.input_vector({"torque_reference": torque, "load_torque": load_torque})
        return system.margins(x, m, u, p).full().ravel()

    start, slope = margins(0.0), margins(1.0) - margins(0.0)
    moving = abs(slope) > SLOPE * abs(slope).max(initial=0.0)
    if not moving.any():
        return np.zeros(1)
    edges = -start[moving] / slope[moving]
    torques = np.linspace(edges.min(), edges.max(), TRIED)
    return torques[np.argsort(abs(torques - edges.mean()))]


def _edge(holds: Callable[[float], bool], inside: float, direction: float) -> float:
    """The last torque that holds, from `inside` outward."""
    step = max(abs(inside), 1e-6)
    while holds(inside + direction * step):
        step *= 2
        if step > HUGE:
            return direction * math.inf
    low, high = 0.0, step
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(inside + direction * middle) else (low, middle)
    return inside + direction * low
