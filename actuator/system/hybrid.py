"""HybridSystem: the only seam between models and analyses.

Event rules, stated once:

1. A margin is positive while the present modes hold, and fires when it falls through zero.
2. `reset` decides ALL modes at once. It is told which margin fired, returns the state after the event (a
   contact that sticks has its slip speed set to exactly zero) and leaves every margin non-negative.
   With no margin fired it is the initialization: modes from the continuous state alone.
3. Margins are dimensionless (a part of a usual speed, force or length) and stay positive by MARGIN_BAND
   where the physics has them at exactly zero, so that an engine which only sees sign changes can arm them.
4. The system does not depend on time; inputs do.
5. Sampled controllers are clocks of the same system. At a tick, all laws that are due run once, in one
   function `tick` of what is measured then; what they hold between ticks are states without dynamics, the last ones of
   x. Where a tick makes a margin negative, `reset` decides the modes, as at the start.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.system.parameters import Parameter
from gear.quantities import require_known, show
from gear.quantities.roles import AnyRole, FrictionMemory, Role, find_role

MARGIN_BAND = 1e-10


class Quantity(NamedTuple):
    """A named signal: unit, usual size, roles and owner; a state with where it begins, and whether a clock holds it."""

    name: str
    unit: str
    nominal: float = 1.0
    initial: float = 0.0
    held: bool = False
    roles: tuple[Role, ...] = ()
    owner: str = ""  # what it belongs to, in words: "motor winding", "shaft load", "controller"

    def role(self, kind: type[AnyRole]) -> AnyRole | None:
        """Its role of that kind, or None."""
        return find_role(self.roles, kind)


class Clock(NamedTuple):
    """A sampled loop: due at every `every`-th tick of the system, the first time at time zero."""

    name: str
    every: int = 1


class Place(StrEnum):
    """What a mode, an event or a contact is at."""

    MESH = "mesh"
    BEARING = "bearing"
    COUPLING = "coupling"
    STOP = "end stop"


class ModeKind(StrEnum):
    """What an integer mode variable tells."""

    MOTION = "motion"  # of a contact: 0 stuck, +-1 sliding, +-2 stuck at its limit
    FLANK = "flank"  # of a mesh, coupling or stop: +1, -1, 0 in its gap


class Mode(NamedTuple):
    """An integer mode variable, and where it is."""

    name: str
    kind: ModeKind = ModeKind.MOTION
    at: str = ""  # path of the contact, coupling or stop: "gear.meshes.first"
    place: Place = Place.MESH


class EventKind(StrEnum):
    """What is left when a margin falls through zero."""

    FRICTION = "friction"  # stuck: the friction limit on a side; sliding: the slip speed reverses
    GAP = "gap"  # a flank engages or separates
    FORCE = "force"  # teeth without a gap: the normal force changes its sign


class Event(NamedTuple):
    """What is left when a margin falls through zero, in the order of the vector of margins."""

    name: str
    kind: EventKind = EventKind.FRICTION
    at: str = ""
    place: Place = Place.MESH
    side: int = 0  # +1, -1; 0 where there is one margin for both sides


class Contact(NamedTuple):
    """A place where friction can stick.

    Its slip speed and friction are `contact_state` of the system; the slip is linear in the speeds of the shafts.
    """

    name: str  # its path, "gear.meshes.first"
    place: Place
    motion: str  # name of its mode variables
    flank: str | None
    direction: int  # in which it slides when the output moves forward: +1 or -1


@dataclass(frozen=True, kw_only=True, eq=False)
class HybridSystem:
    """Continuous states, modes, inputs, parameters and outputs, with the functions between them.

        dx/dt = flow(x, m, u, p)
        margins(x, m, u, p)                      >= 0 while the modes m hold
        (x+, m+, fault) = reset(fired, x, m, u, p)    fault = 1 where no consistent modes were found
        x+ = tick(due, x, m, u, p)                at the ticks, `period(p)` apart
        y = outputs(x, m, u, p)

    Attributes
    ----------
    states, inputs, outputs : tuple of Quantity
        In the order of the vectors x, u, y. Nominal sizes scale the error control.
    mode_variables : tuple of Mode
        In the order of the vector m.
    events : tuple of Event
        What is left when a margin falls through zero, in the order of the margins.
    contacts : tuple of Contact
        Where friction can stick.
    parameters : tuple of Parameter
        In the order of p, with defaults, roles and owners.
    check : callable or None
        Raises ValueError where changed parameters, by name, break a rule.
    flow, margins, reset, outputs_function : casadi.Function
        As above; `fired` is a vector with 1 at the margin that fired.
    clocks : tuple of Clock
        Sampled loops; none in continuous time.
    tick, period : casadi.Function or None
        As above; `due` is a vector with 1 at the clocks that are due. None without clocks.
    contact_state : casadi.Function or None
        (x, m, u, p) -> slip speed, friction, friction limit at rest, friction while sliding, each (K, 1) in the order
        of the contacts; None for a system without contacts.
    begin : casadi.Function or None
        (x, p) -> x with the states where they begin that follow other states or parameters; None where none does.
    """

    name: str
    states: tuple[Quantity, ...]
    mode_variables: tuple[Mode, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    events: tuple[Event, ...]
    parameters: tuple[Parameter, ...]
    flow: ca.Function
    margins: ca.Function
    reset: ca.Function
    outputs_function: ca.Function
    contacts: tuple[Contact, ...] = ()
    contact_state: ca.Function | None = None
    check: Callable[[Mapping[str, float]], None] | None = None
    clocks: tuple[Clock, ...] = ()
    tick: ca.Function | None = None
    period: ca.Function | None = None
    begin: ca.Function | None = None

    def __post_init__(self) -> None:
        names = [quantity.name for quantity in (*self.states, *self.inputs, *self.outputs)]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(
                f"HybridSystem {self.name}: signals share a name: {', '.join(twice)}; rename a shaft or an output"
            )
        held = [quantity.held for quantity in self.states]
        if held != sorted(held) or any(held) > bool(self.clocks):
            raise ValueError(f"HybridSystem {self.name}: held states stand behind the others, and need a clock")

    @property
    def modes(self) -> tuple[str, ...]:
        """Names of the mode variables."""
        return tuple(mode.name for mode in self.mode_variables)

    @property
    def margin_names(self) -> tuple[str, ...]:
        """Names of the events."""
        return tuple(event.name for event in self.events)

    def parameters_having(self, role: type[Role]) -> tuple[Parameter, ...]:
        """The parameters that have a role, in the order of p."""
        return tuple(parameter for parameter in self.parameters if parameter.role(role) is not None)

    def signals_having(self, role: type[Role]) -> tuple[Quantity, ...]:
        """The states, inputs and outputs that have a role."""
        signals = (*self.states, *self.inputs, *self.outputs)
        return tuple(quantity for quantity in signals if quantity.role(role) is not None)

    def describe(self, name: str) -> str:
        """What is declared of a parameter or signal, in a line: value, unit, rules, roles and owner.

        Raises
        ------
        KeyError
            For an unknown name, with the nearest.
        """
        known = {quantity.name: quantity for quantity in (*self.states, *self.inputs, *self.outputs)}
        known |= {parameter.name: parameter for parameter in self.parameters}
        require_known([name], known, "parameter or signal")
        quantity = known[name]
        text = f"{name} [{quantity.unit}]"
        if isinstance(quantity, Parameter):
            text = f"{name} = {show(quantity.default, quantity.unit)}"
        return ", ".join([text, *map(str, quantity.roles), *([f"of {quantity.owner}"] if quantity.owner else [])])

    @property
    def moving(self) -> int:
        """How many states are continuous; the held ones follow."""
        return sum(not quantity.held for quantity in self.states)

    @property
    def hyperperiod(self) -> int:
        """Ticks after which all clocks are due together again."""
        return math.lcm(*(clock.every for clock in self.clocks))

    def tick_period(self, p: np.ndarray) -> float:
        """Time [s] between two ticks; infinite without clocks."""
        return math.inf if self.period is None else float(self.period(p))

    def due(self, ticks: np.ndarray) -> np.ndarray:
        """Which clocks (rows) are due at the ticks of these numbers (columns), 1 or 0."""
        return np.array([ticks % clock.every == 0 for clock in self.clocks], dtype=float)

    def parameter_values(self, changes: Mapping[str, float] | None = None) -> np.ndarray:
        """Values of p: the defaults, with `changes` by name, held against the rules of their components."""
        changes = changes or {}
        require_known(changes, [parameter.name for parameter in self.parameters], "parameter")
        if changes and self.check is not None:
            self.check(changes)
        return np.array([float(changes.get(parameter.name, parameter.default)) for parameter in self.parameters])

    def state_vector(self, values: Mapping[str, float] | None = None, p: np.ndarray | None = None) -> np.ndarray:
        """A state vector x by name; states not named are where they begin, with parameters p or the default ones."""
        values = values or {}
        require_known(values, [state.name for state in self.states], "state")
        x = np.array([float(values.get(state.name, state.initial)) for state in self.states])
        if self.begin is None:
            return x
        begun = self.begin(x, self.parameter_values() if p is None else p).full().ravel()
        return np.array([values.get(state.name, value) for state, value in zip(self.states, begun, strict=True)])

    def input_vector(self, values: Mapping[str, float] | None = None) -> np.ndarray:
        """An input vector u by name; inputs not named are zero."""
        values = values or {}
        require_known(values, [signal.name for signal in self.inputs], "input")
        return np.array([float(values.get(signal.name, 0.0)) for signal in self.inputs])

    def mode_vector(self, values: Mapping[str, int]) -> np.ndarray:
        """A mode vector m by name; every mode must be named."""
        require_known(values, self.modes, "mode")
        missing = [name for name in self.modes if name not in values]
        if missing:
            raise KeyError(f"modes {', '.join(missing)} are not given; every contact needs one")
        return np.array([float(values[name]) for name in self.modes])


def require_sticking(system: HybridSystem, analysis: str) -> None:
    """Raise ValueError where an analysis that asks for contact modes meets a friction law that never sticks."""
    creeping = dict.fromkeys(state.owner for state in system.signals_having(FrictionMemory))
    if creeping:
        raise ValueError(
            f"{analysis} does not apply to {system.name}: it asks which contacts stick, and {' and '.join(creeping)} "
            "never does; its friction has an internal state instead. Simulate, or use a law that sticks"
        )
