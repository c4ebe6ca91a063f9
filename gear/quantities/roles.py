"""Roles: what a parameter or signal means for an analysis, declared where its unit is.

    static: Annotated[Coefficient, Breakaway(floor="sliding")]

An analysis asks the system for what has a role (`system.parameters_having(Breakaway)`, `signals_having`) and reads no
meaning off a name. A new role is a new class here; a quantity may have several.
"""

from dataclasses import dataclass
from typing import Literal, TypeVar


@dataclass(frozen=True)
class Role:
    """What a quantity means for analyses."""


# -- parameters of contacts ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Breakaway(Role):
    """Largest friction that holds a contact at rest, or a factor on it.

    `floor` is below what it must not fall: the name of a field or property of the same component (its sliding
    friction just off standstill, in the same measure), a number, or None where the law itself keeps the order.
    """

    floor: str | float | None


@dataclass(frozen=True)
class SlidingFriction(Role):
    """Friction of a contact while it slides."""


@dataclass(frozen=True)
class Gap(Role):
    """Total backlash or free play."""


# -- parameters of controllers ------------------------------------------------------------------------------


@dataclass(frozen=True)
class LoopGain(Role):
    """A gain of a control law: which part of the law it is on."""

    part: Literal["proportional", "derivative"]


@dataclass(frozen=True)
class IntegralGain(Role):
    """Gain of an integral that acts, whatever law it belongs to: PI, PID, disturbance observer, state feedback."""


@dataclass(frozen=True)
class InLoop(Role):
    """The control loop whose law it belongs to. Declared of a law, all numbers of the law have it.

    A loop of `motion` acts on angles and speeds, so that its integral winds up against a contact that sticks; one that
    is `electrical` acts on currents and does not.
    """

    loop: str
    domain: Literal["motion", "electrical"] = "motion"


@dataclass(frozen=True)
class Limit(Role):
    """Bound of a signal: reaching it makes the actuator nonlinear."""


@dataclass(frozen=True)
class Compensates(Role):
    """A setting of a compensation of the friction that has the other role; it is not that friction."""

    role: type[Role]


@dataclass(frozen=True)
class SensorOf(Role):
    """What a sensor reads: "motor", "load", "current". Declared of a sensor, all its numbers have it."""

    reads: str


@dataclass(frozen=True)
class Resolution(Role):
    """Counts of a sensor: the step of what it reads."""


@dataclass(frozen=True)
class NoiseLevel(Role):
    """Standard deviation of the noise of a sensor."""


# -- temperatures -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class OilTemperature(Role):
    """Temperature at which a lubricant is taken."""


@dataclass(frozen=True)
class NodeTemperature(Role):
    """Temperature of a node of the thermal network: as a state, or where it begins as a parameter."""

    node: str = ""


# -- signals ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ShaftAngle(Role):
    """Angle of a shaft."""

    shaft: str


@dataclass(frozen=True)
class ShaftSpeed(Role):
    """Speed of a shaft."""

    shaft: str


@dataclass(frozen=True)
class ControllerMemory(Role):
    """What a control law keeps in mind, or a result that is held until its next tick."""


@dataclass(frozen=True)
class FrictionMemory(Role):
    """Internal state of a friction law that does not stick."""

    contact: str


@dataclass(frozen=True)
class Heat(Role):
    """Power that becomes heat, by the loss that it is."""

    loss: str


@dataclass(frozen=True)
class FrictionHeat(Role):
    """Part of the friction heat: that of one contact, by its path in the gear."""

    contact: str


@dataclass(frozen=True)
class LoopSignal(Role):
    """A signal inside a control loop, as output, as the input that is added to it, or as the state that holds it."""

    signal: str


AnyRole = TypeVar("AnyRole", bound=Role)


def find_role(roles: tuple[Role, ...], kind: type[AnyRole]) -> AnyRole | None:
    """The first role of a kind; None where there is none."""
    return next((role for role in roles if isinstance(role, kind)), None)


def roles_in(notes: tuple) -> tuple[Role, ...]:
    """The roles among the notes of an annotation."""
    return tuple(note for note in notes if isinstance(note, Role))
