"""What stiction can hold: the set of motor torques, and so of positions and integrator states, at rest.

While all contacts stick nothing but the controller moves: angles, normal forces and friction limits stay. The margins
static - s and static + s of the contacts are then linear in the motor torque M, and what stiction holds is an interval,

    lower <= M <= upper

through which the integrator drives M until a contact lets go.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from actuator.actuator import Actuator
from actuator.parts.motor import TorqueSource
from actuator.simulation.run import FREE, STUCK, contact_labels
from actuator.stiction.breakaway import NotAtRest
from actuator.system.hybrid import HybridSystem

SLOPE = 1e-9  # part of the largest slope of a margin over the torque that is rounding
TRIED = 401  # motor torques, in search of one that holds
HUGE, HALVINGS = 1e9, 60  # N m; 2^-60 is below rounding


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

    def holds(torque: float) -> bool:
        labels, consistent = _decided(system, x, load_torque, torque, p)
        return consistent and all(label in (STUCK, FREE) for label in labels)

    candidates = _candidates(system, x, load_torque, p)
    inside = next((torque for torque in candidates if holds(torque)), None)
    if inside is None:
        raise NotAtRest(
            f"{plant.name}: stiction holds this standstill at no motor torque; {len(candidates)} between "
            f"{candidates.min():.6g} and {candidates.max():.6g} N m were tried"
        )
    lower, upper = (_edge(holds, inside, direction) for direction in (-1.0, 1.0))
    locked = _decided(system, x, load_torque, inside, p)[0].count(STUCK)  # a mesh in its gap does not stick
    return RestSet(lower=lower, upper=upper, redundant=locked > _shafts(system))


def _decided(
    system: HybridSystem, x: np.ndarray, load_torque: float, torque: float, p: np.ndarray
) -> tuple[list[str], bool]:
    """Modes of all contacts at a motor torque, decided together, and whether they are consistent."""
    u = system.input_vector({"torque_reference": torque, "load_torque": load_torque})
    _, m, fault = system.reset(np.zeros(len(system.margin_names)), x, np.zeros(len(system.modes)), u, p)
    return list(contact_labels(system.modes, np.round(m.full().ravel())).values()), not float(fault)


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
