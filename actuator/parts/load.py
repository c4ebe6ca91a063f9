"""The load on the output shaft."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar, Protocol

import casadi as ca
from annotated_types import Ge, Unit

from gear.quantities import Angle, Scalar, TorsionalDamping, check
from gear.quantities.registry import part


class OutputLoad(Protocol):
    """What an actuator asks of its load.

    Attributes
    ----------
    own_input : (str, str) or None
        Name and unit of an input that acts on the load beside `load_torque`; its value follows angle and speed in the
        arguments of `torque` and `power`.
    """

    own_input: ClassVar[tuple[str, str] | None] = None

    @abstractmethod
    def inertia_at(self, angle: Scalar) -> Scalar:
        """Inertia [kg m^2] on the output shaft at an angle [rad]."""

    @abstractmethod
    def torque(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Torque on the output shaft [N m]."""

    @abstractmethod
    def power(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Taken by what acts on the load, its inertia not counted [W]."""

    def signals(self, angle: Scalar, speed: Scalar) -> dict[str, tuple[str, Scalar]]:
        """Outputs of its own: name -> unit and value."""
        return {}


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """Weight of an unbalanced load.

        torque on the shaft = -moment sin(angle - hanging_angle)

    Parameters
    ----------
    moment : float
        Mass times gravity times distance of the center of gravity from the axis [N m].
    hanging_angle : float
        Angle of the shaft at which the center of gravity hangs below the axis [rad].
    """

    moment: Annotated[float, Unit("N m"), Ge(0)]
    hanging_angle: Angle = 0.0

    def __post_init__(self) -> None:
        check(self)

    def torque(self, angle: Scalar) -> Scalar:
        """Torque on the shaft [N m]."""
        return -self.moment * ca.sin(angle - self.hanging_angle)


@part(OutputLoad, default=True)
@dataclass(frozen=True, kw_only=True)
class Load(OutputLoad):
    """What is fixed to the output shaft: inertia, and torque over position and speed.

        torque on the shaft = bias - stiffness * angle - damping * speed + torque of gravity

    For a control surface, stiffness and damping are the aerodynamic hinge-moment derivatives and the bias
    is the hinge moment at neutral position. A gust is a signal on the input `load_torque`.

    Parameters
    ----------
    inertia : float
        [kg m^2], added to that of the output shaft.
    stiffness : float
        [N m/rad]; negative where the load is unstable.
    damping : float
        [N m s/rad].
    bias : float
        Torque at angle zero [N m]; positive turns the shaft in positive direction.
    gravity : Gravity or None
        Weight of an unbalanced load; None for a balanced one.
    """

    inertia: Annotated[float, Unit("kg m^2"), Ge(0)] = 0.0
    stiffness: Annotated[float, Unit("N m/rad")] = 0.0
    damping: TorsionalDamping = 0.0
    bias: Annotated[float, Unit("N m")] = 0.0
    gravity: Gravity | None = None

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def examples(cls) -> "tuple[Load, ...]":
        """An inertia, and all that it can have."""
        whole = cls(inertia=0.1, stiffness=2.0, damping=0.1, bias=0.5, gravity=Gravity(moment=1.0, hanging_angle=0.3))
        return (cls(inertia=0.1), whole)

    def inertia_at(self, angle: Scalar) -> Scalar:
        """Inertia [kg m^2]; the same at every angle."""
        return self.inertia

    def torque(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Torque on the output shaft [N m]."""
        aerodynamic = self.bias - self.stiffness * angle - self.damping * speed
        return aerodynamic if self.gravity is None else aerodynamic + self.gravity.torque(angle)

    def power(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Taken by what acts on the load, its inertia not counted [W]."""
        return -self.torque(angle, speed) * speed

    def kinetic(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Kinetic energy [J]."""
        return self.inertia * speed**2 / 2
