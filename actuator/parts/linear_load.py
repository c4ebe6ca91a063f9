"""A load that moves along a line, on the output shaft through a mechanism."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from annotated_types import Ge, Unit

from actuator.parts.load import OutputLoad
from actuator.parts.mechanisms import Lever, Mechanism, Screw
from gear.quantities import Damping, Scalar, check
from gear.quantities.registry import part


@part(OutputLoad)
@dataclass(frozen=True, kw_only=True)
class LinearLoad(OutputLoad):
    """A rod with a mass, and force over its position and speed, moved by the output shaft through a mechanism.

        x = x(phi),   x' = dx/dphi,   x'' = d2x/dphi2                             travel of the mechanism
        force on the rod    f = force - stiffness x - damping v,   v = x' w       and from outside
        inertia at the shaft  = mass x'^2
        torque on the shaft   = x' f - mass x' x'' w^2

    The last term keeps the energy: where the ratio changes, a mass at constant shaft speed is accelerated.

    Parameters
    ----------
    mass : float
        Of everything that moves with the rod [kg].
    stiffness : float
        [N/m]; negative where the load is unstable.
    damping : float
        [N s/m].
    force : float
        On the rod at x = 0 [N], such as a weight; positive pushes it in positive direction.
    mechanism : Mechanism
        Travel of the rod over the angle of the shaft.
    """

    mass: Annotated[float, Unit("kg"), Ge(0)] = 0.0
    stiffness: Annotated[float, Unit("N/m")] = 0.0
    damping: Damping = 0.0
    force: Annotated[float, Unit("N")] = 0.0
    mechanism: Mechanism

    own_input: ClassVar[tuple[str, str] | None] = ("load_force", "N")

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def examples(cls) -> "tuple[LinearLoad, ...]":
        """On a spindle, and with all that it can have on a lever."""
        lever = Lever(radius=0.05, angle=0.2, link=0.2, offset=0.01)
        return (
            cls(mass=5.0, mechanism=Screw(lead=0.005)),
            cls(mass=2.0, stiffness=100.0, damping=10.0, force=-20.0, mechanism=lever),
        )

    def signals(self, angle: Scalar, speed: Scalar) -> dict[str, tuple[str, Scalar]]:
        """Position and speed of the rod."""
        return {"rod_position": ("m", self.position(angle)), "rod_speed": ("m/s", self.speed(angle, speed))}

    def position(self, angle: Scalar) -> Scalar:
        """Position x of the rod [m]."""
        return self.mechanism.travel(angle).position

    def speed(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Speed of the rod [m/s] at the angle [rad] and speed [rad/s] of the shaft."""
        return self.mechanism.travel(angle).slope * speed

    def inertia_at(self, angle: Scalar) -> Scalar:
        """Inertia [kg m^2] that the shaft feels at this angle."""
        return self.mass * self.mechanism.travel(angle).slope ** 2

    def torque(self, angle: Scalar, speed: Scalar, outside: Scalar = 0.0) -> Scalar:
        """Torque on the output shaft [N m], with a force [N] on the rod from outside."""
        travel = self.mechanism.travel(angle)
        pushed = self._force(angle, speed) + outside
        return travel.slope * (pushed - self.mass * travel.curvature * speed**2)

    def power(self, angle: Scalar, speed: Scalar, outside: Scalar = 0.0) -> Scalar:
        """Taken by what acts on the rod, its mass not counted [W], with a force [N] on the rod from outside."""
        return -(self._force(angle, speed) + outside) * self.speed(angle, speed)

    def kinetic(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Kinetic energy [J]."""
        return self.mass * self.speed(angle, speed) ** 2 / 2

    def rod_force(self, angle: Scalar, speed: Scalar, acceleration: Scalar, outside: Scalar = 0.0) -> Scalar:
        """Force of the mechanism on the rod [N], at an acceleration of the shaft [rad/s^2]."""
        travel = self.mechanism.travel(angle)
        accelerated = self.mass * (travel.slope * acceleration + travel.curvature * speed**2)
        return accelerated - self._force(angle, speed) - outside

    def _force(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Force on the rod [N] that belongs to the load itself."""
        return self.force - self.stiffness * self.position(angle) - self.damping * self.speed(angle, speed)
