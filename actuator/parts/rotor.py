"""What turning costs a rotor: cogging, and drag that is smooth over speed.

Dry friction is a contact and belongs to a bearing of the gear, where it can stick.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import casadi as ca
from annotated_types import Ge, Unit

from gear.quantities import Angle, FrictionTorque, Scalar, TorsionalDamping, check, check_count


class MotorLosses(NamedTuple):
    """Heat of a motor by its place [W]; None for what a motor does not know."""

    copper: Scalar | None = None
    iron: Scalar | None = None
    friction: Scalar | None = None

    def known(self) -> dict[str, Scalar]:
        """By the names of outputs and of heat paths."""
        named = {"copper": self.copper, "iron": self.iron, "drag": self.friction}
        return {name: loss for name, loss in named.items() if loss is not None}


@dataclass(frozen=True, kw_only=True)
class Cogging:
    """Torque of the magnets on the slots, without current.

        torque = -amplitude sin(periods angle + phase),     energy = -amplitude/periods cos(periods angle + phase)

    Parameters
    ----------
    amplitude : float
        Half of peak to peak [N m].
    periods : int
        Per turn of the rotor; a multiple of the least common multiple of slots and poles.
    phase : float
        [rad]; with 0 the rotor is held at angle 0.
    """

    amplitude: FrictionTorque
    periods: int
    phase: Angle = 0.0

    def __post_init__(self) -> None:
        check(self)
        check_count(self, "periods")

    @classmethod
    def of_slots(cls, *, amplitude: float, slots: int, poles: int, phase: float = 0.0) -> "Cogging":
        """First harmonic of a rotor with `poles` magnets in a stator with `slots`."""
        return cls(amplitude=amplitude, periods=math.lcm(slots, poles), phase=phase)

    def torque(self, angle: Scalar) -> Scalar:
        """On the rotor [N m] at its mechanical angle."""
        return -self.amplitude * ca.sin(self.periods * angle + self.phase)

    def energy(self, angle: Scalar) -> Scalar:
        """Magnetic energy [J] over the angle."""
        return -self.amplitude / self.periods * ca.cos(self.periods * angle + self.phase)


@dataclass(frozen=True, kw_only=True)
class RotorDrag:
    """Torque opposing the speed: eddy currents in the iron, viscous friction, air.

        torque = -(eddy + viscous) w - windage w |w|

    Parameters
    ----------
    eddy : float
        Eddy-current loss in the iron over the square of the speed [N m s/rad].
    viscous : float
        Of grease and seals [N m s/rad].
    windage : float
        [N m s^2/rad^2].
    """

    eddy: TorsionalDamping = 0.0
    viscous: TorsionalDamping = 0.0
    windage: Annotated[float, Unit("N m s^2/rad^2"), Ge(0)] = 0.0

    def __post_init__(self) -> None:
        check(self)

    def torque(self, speed: Scalar) -> Scalar:
        """On the rotor [N m]."""
        return -(self.eddy + self.viscous + self.windage * ca.fabs(speed)) * speed

    def iron_loss(self, speed: Scalar) -> Scalar:
        """Heat in the iron [W]."""
        return self.eddy * speed**2

    def friction_loss(self, speed: Scalar) -> Scalar:
        """Heat in bearings, seals and air [W]."""
        return (self.viscous + self.windage * ca.fabs(speed)) * speed**2


@dataclass(frozen=True, kw_only=True)
class Rotor:
    """What acts on the rotor besides the current.

    Parameters
    ----------
    cogging : Cogging or None
    drag : RotorDrag or None
    """

    cogging: Cogging | None = None
    drag: RotorDrag | None = None

    @classmethod
    def examples(cls) -> "tuple[Rotor, ...]":
        """Without anything, and with everything."""
        drag = RotorDrag(eddy=1e-6, viscous=2e-6, windage=1e-9)
        return (cls(), cls(cogging=Cogging(amplitude=1e-3, periods=12), drag=drag))

    def acts(self) -> bool:
        """Whether it has cogging or drag."""
        return self.cogging is not None or self.drag is not None

    def torque(self, angle: Scalar, speed: Scalar) -> Scalar:
        """On the rotor [N m], at its mechanical angle and speed."""
        return (self.cogging.torque(angle) if self.cogging else 0.0) + self.drag_torque(speed)

    def drag_torque(self, speed: Scalar) -> Scalar:
        """On the rotor [N m] without the cogging, which averages out over a turn."""
        return self.drag.torque(speed) if self.drag else 0.0

    def iron_loss(self, speed: Scalar) -> Scalar:
        """Heat in the iron [W]."""
        return self.drag.iron_loss(speed) if self.drag else 0.0

    def friction_loss(self, speed: Scalar) -> Scalar:
        """Heat in bearings, seals and air [W]."""
        return self.drag.friction_loss(speed) if self.drag else 0.0

    def energy(self, angle: Scalar) -> Scalar:
        """Magnetic energy of the cogging [J]."""
        return self.cogging.energy(angle) if self.cogging else 0.0
