"""The equilibrium set: the motor torques that stiction holds, and so the positions and integrator states at rest.

While all contacts stick nothing but the controller moves: angles, normal forces and friction limits stay. The margins
static - s and static + s of the contacts are then linear in the motor torque M, and what stiction holds is an interval,

    lower <= M <= upper

through which the integrator drives M until a contact breaks away.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from actuator.actuator import Actuator
from actuator.parts.torque_source import TorqueSource
from actuator.stiction.breakaway import NotAtRest, find_unsupported
from actuator.system.contact_modes import FREE, STUCK, contact_labels, is_at_rest
from actuator.system.hybrid import HybridSystem, ModeKind, require_sticking
from gear.quantities.roles import ShaftAngle, ShaftSpeed

SLOPE_ROUNDING = 1e-9  # part of the largest slope of a margin over the torque that is rounding
TORQUES_TRIED = 401  # in search of one that holds
LARGEST_TORQUE, HALVINGS = 1e9, 60  # N m; 2^-60 is below rounding


@dataclass(frozen=True, kw_only=True)
class EquilibriumSet:
    """The motor torques that stiction holds in one standstill, and what follows for a position loop.

    Attributes
    ----------
    lower, upper : float
        Motor torque [N m] at which a contact breaks away backward and forward.
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
        """Time [s] until a motor torque that grows at `rate` [N m/s] from `torque` breaks away; infinite for rate 0."""
        if rate == 0:
            return math.inf
        return ((self.upper if rate > 0 else self.lower) - torque) / rate


def find_equilibrium_set(
    plant: Actuator,
    state: Mapping[str, float],
    *,
    load_torque: float = 0.0,
    parameters: Mapping[str, float] | None = None,
) -> EquilibriumSet:
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
    require_sticking(system, "find_equilibrium_set")
    known = {parameter.name for parameter in system.parameters}
    p = system.parameter_values({name: value for name, value in (parameters or {}).items() if name in known})
    angles = {quantity.name for quantity in system.states if quantity.role(ShaftAngle) is not None}
    x = system.state_vector({name: value for name, value in state.items() if name in angles})

    def holds(torque: float) -> bool:
        labels, consistent = _decided(system, x, load_torque, torque, p)
        return consistent and bool(is_at_rest(labels))

    candidates = _candidates(system, x, load_torque, p)
    inside = next((torque for torque in candidates if holds(torque)), None)
    if inside is None:
        raise NotAtRest(
            f"{plant.name}: stiction holds this standstill at no motor torque; {len(candidates)} between "
            f"{candidates.min():.6g} and {candidates.max():.6g} N m were tried"
        )
    lower, upper = (_edge(holds, inside, direction) for direction in (-1.0, 1.0))
    locked = _decided(system, x, load_torque, inside, p)[0].count(STUCK)  # a mesh in its gap does not stick
    return EquilibriumSet(lower=lower, upper=upper, redundant=locked > _shafts(system))


def _decided(
    system: HybridSystem, x: np.ndarray, load_torque: float, torque: float, p: np.ndarray
) -> tuple[list[str], bool]:
    """Modes of all contacts at a motor torque, decided together, and whether they hold all shafts."""
    u = system.input_vector({"torque_reference": torque, "load_torque": load_torque})
    _, m, fault = system.reset(np.zeros(len(system.margin_names)), x, np.zeros(len(system.modes)), u, p)
    m = np.round(m.full().ravel())
    labels = list(contact_labels(system, m).values())
    # what no contact holds may hang in a gap
    return labels, not (float(fault) or (FREE in labels and find_unsupported(system, x, m, u, p)))


def _shafts(system: HybridSystem) -> int:
    """Shafts that contacts can lock, each with a speed of its own."""
    return sum(quantity.role(ShaftSpeed) is not None for quantity in system.states)


def _no_extras(plant: Actuator) -> dict[str, None]:
    """Parts beside motor and controller that a bare actuator does not have."""
    kept = {"motor", "gear", "load", "name", "controller", "inverter"}
    return {f.name: None for f in fields(plant) if f.name not in kept and f.default is None}


def _candidates(system: HybridSystem, x: np.ndarray, load_torque: float, p: np.ndarray) -> np.ndarray:
    """Motor torques to try, from the middle outward, between those at which each contact by itself breaks away.

    Where several contacts lock the same shafts, one of them alone says little: the others take over.
    """
    none = np.zeros(len(system.margin_names))
    motions = np.array([mode.kind is ModeKind.MOTION for mode in system.mode_variables])
    _, m, _ = system.reset(none, x, np.zeros(len(system.modes)), system.input_vector({"load_torque": load_torque}), p)
    m = np.where(motions, 0.0, np.round(m.full().ravel()))

    def margins(torque: float) -> np.ndarray:
        u = system.input_vector({"torque_reference": torque, "load_torque": load_torque})
        return system.margins(x, m, u, p).full().ravel()

    start, slope = margins(0.0), margins(1.0) - margins(0.0)
    moving = abs(slope) > SLOPE_ROUNDING * abs(slope).max(initial=0.0)
    if not moving.any():
        return np.zeros(1)
    edges = -start[moving] / slope[moving]
    torques = np.linspace(edges.min(), edges.max(), TORQUES_TRIED)
    return torques[np.argsort(abs(torques - edges.mean()))]


def _edge(holds: Callable[[float], bool], inside: float, direction: float) -> float:
    """The last torque that holds, from `inside` outward."""
    step = max(abs(inside), 1e-6)
    while holds(inside + direction * step):
        step *= 2
        if step > LARGEST_TORQUE:
            return direction * math.inf
    low, high = 0.0, step
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(inside + direction * middle) else (low, middle)
    return inside + direction * low
