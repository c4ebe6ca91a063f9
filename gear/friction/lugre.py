"""The LuGre law: friction as bristles that bend before they slip, with an internal state instead of stiction."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import casadi as ca
from annotated_types import Ge, Gt, Unit

from gear.friction.law import FrictionLaw, require_breakaway_above
from gear.motion import Sliding
from gear.quantities import Memory, PositiveCoefficient, PositiveMeshSpeed, Scalar, check
from gear.quantities.registry import part
from gear.quantities.roles import Breakaway, SlidingFriction


def stribeck_level(speed: Scalar, sliding: Scalar, static: Scalar, stribeck_speed: Scalar) -> Scalar:
    """Friction of steady motion without its viscous part, g(v): from `static` at rest down to `sliding`."""
    return sliding + (static - sliding) * ca.exp(-((speed / stribeck_speed) ** 2))


def bristle_rate(bristle: Scalar, speed: Scalar, stiffness: Scalar, level: Scalar) -> Scalar:
    """dz/dt = v - stiffness |v| z / g(v): the bristles follow the motion until they carry g(v)."""
    return speed - stiffness * ca.fabs(speed) / level * bristle


@part(FrictionLaw)
@dataclass(frozen=True, kw_only=True)
class LuGre(FrictionLaw):
    """Friction of bristles (Lund - Grenoble): presliding, frictional lag and a breakaway that depends on the loading.

        dz/dt  = v - stiffness |v| z / g(v),       g(v) = sliding + (static - sliding) exp(-(v/stribeck_speed)^2)
        mu     = stiffness z + damping dz/dt + viscous v

    z is the mean deflection of the bristles, in the direction of the mesh speed v; all coefficients are per normal
    force. The friction is a continuous function of the state: the mesh never sticks, it creeps, and has no mode. What
    asks for modes (equilibrium set, breakaway, models per mode) does not apply to it.

    In steady motion mu = g(v) + viscous |v|; near rest the bristles are a spring `stiffness` with the damping
    `damping` + `viscous`. The law is passive where damping <= viscous sliding / (static - sliding), as Barabanov and
    Ortega show; beyond, and so with the published numbers, the bristles may give out energy for moments.

    Parameters
    ----------
    sliding, static : float
        Coefficients that steady motion settles to far above the Stribeck speed, and near rest [-], sliding <= static.
    stribeck_speed : float
        Mesh speed over which the friction falls [m/s].
    stiffness : float
        Coefficient per deflection of the bristles, sigma_0 [1/m].
    damping : float
        Coefficient per rate of the deflection, sigma_1 [s/m].
    viscous : float
        Coefficient per speed, sigma_2 [s/m].

    References
    ----------
    C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, "A new model for control of systems with friction", IEEE
    Trans. Automatic Control 40 (1995), 419-425; N. Barabanov, R. Ortega, "Necessary and sufficient conditions for
    passivity of the LuGre friction model", same 45 (2000), 830-832.
    """

    sliding: Annotated[PositiveCoefficient, SlidingFriction()]
    static: Annotated[PositiveCoefficient, Breakaway(floor="sliding")]
    stribeck_speed: PositiveMeshSpeed
    stiffness: Annotated[float, Unit("1/m"), Gt(0)]
    damping: Annotated[float, Unit("s/m"), Ge(0)] = 0.0
    viscous: Annotated[float, Unit("s/m"), Ge(0)] = 0.0

    sticks: ClassVar[bool] = False

    @classmethod
    def examples(cls) -> "tuple[LuGre, ...]":
        """The published numbers for a unit mass, per newton of normal force."""
        return (cls(sliding=1.0, static=1.5, stribeck_speed=1e-3, stiffness=1e5, damping=1e5**0.5, viscous=0.4),)

    def __post_init__(self) -> None:
        check(self)
        require_breakaway_above("LuGre", ("sliding", self.sliding), ("static", self.static))

    def level(self, speed: Scalar) -> Scalar:
        """g(v) [-] at a mesh speed [m/s]."""
        return stribeck_level(speed, self.sliding, self.static, self.stribeck_speed)

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Coefficient of steady sliding [-]."""
        return self.level(sliding.speed) + self.viscous * ca.fabs(sliding.speed)

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Largest coefficient [-] that is reached from rest when loaded slowly."""
        return self.static

    def memory(self) -> tuple[Memory, ...]:
        """Mean deflection of the bristles."""
        return (Memory("bristle", "m", self.static / self.stiffness),)

    def friction(self, memory: Sequence[Scalar], sliding: Sliding) -> Scalar:
        """Friction over normal force [-], with the sign of the motion that it opposes."""
        (rate,) = self.rates(memory, sliding)
        return self.stiffness * memory[0] + self.damping * rate + self.viscous * sliding.speed

    def rates(self, memory: Sequence[Scalar], sliding: Sliding) -> list[Scalar]:
        """Rate of the deflection of the bristles [m/s]."""
        return [bristle_rate(memory[0], sliding.speed, self.stiffness, self.level(sliding.speed))]
