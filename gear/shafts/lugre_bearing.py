"""A bearing whose friction is that of bristles, by the LuGre law."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import casadi as ca
from annotated_types import Gt, Unit

from gear.friction.law import require_breakaway_above
from gear.friction.lugre import bristle_rate, stribeck_level
from gear.quantities import Memory, Scalar, TorsionalDamping, TorsionalStiffness, check
from gear.quantities.registry import part
from gear.quantities.roles import Breakaway, SlidingFriction
from gear.shafts.law import ShaftBearing

PositiveTorque = Annotated[float, Unit("N m"), Gt(0)]


@part(ShaftBearing)
@dataclass(frozen=True, kw_only=True)
class LuGreBearing(ShaftBearing):
    """Friction between a shaft and the housing by the law of `gear.friction.lugre.LuGre`, in torques.

        dz/dt  = w - stiffness |w| z / g(w),       g(w) = coulomb + (breakaway - coulomb) exp(-(w/stribeck_speed)^2)
        torque = stiffness z + damping dz/dt + viscous w

    Parameters
    ----------
    shaft : str
        Name of the shaft that it supports.
    coulomb, breakaway : float
        Torques that steady motion settles to far above the Stribeck speed, and near rest [N m]; coulomb <= breakaway.
    stribeck_speed : float
        Speed of the shaft over which the friction falls [rad/s].
    stiffness : float
        Of the bristles, sigma_0 [N m/rad].
    damping : float
        Torque per rate of their deflection, sigma_1 [N m s/rad].
    viscous : float
        Torque per speed, sigma_2 [N m s/rad].

    References
    ----------
    As of `gear.friction.lugre.LuGre`.
    """

    shaft: str
    coulomb: Annotated[PositiveTorque, SlidingFriction()]
    breakaway: Annotated[PositiveTorque, Breakaway(floor="coulomb")]
    stribeck_speed: Annotated[float, Unit("rad/s"), Gt(0)]
    stiffness: TorsionalStiffness
    damping: TorsionalDamping = 0.0
    viscous: TorsionalDamping = 0.0

    sticks: ClassVar[bool] = False

    @classmethod
    def examples(cls) -> "tuple[LuGreBearing, ...]":
        """The published numbers for a unit mass."""
        return (
            cls(
                shaft="a",
                coulomb=1.0,
                breakaway=1.5,
                stribeck_speed=1e-3,
                stiffness=1e5,
                damping=1e5**0.5,
                viscous=0.4,
            ),
        )

    def __post_init__(self) -> None:
        check(self)
        owner = f"LuGreBearing on shaft {self.shaft!r}"
        require_breakaway_above(owner, ("coulomb", self.coulomb), ("breakaway", self.breakaway), "N m")

    def level(self, speed: Scalar) -> Scalar:
        """g(w) [N m] at a speed [rad/s]."""
        return stribeck_level(speed, self.coulomb, self.breakaway, self.stribeck_speed)

    def holding(self, load: Scalar) -> Scalar:
        """Largest torque [N m] that is reached from rest when loaded slowly."""
        return self.breakaway

    def sliding(self, load: Scalar, speed: Scalar) -> Scalar:
        """Torque against steady motion [N m] at a speed >= 0 [rad/s]."""
        return self.level(speed) + self.viscous * ca.fabs(speed)

    def memory(self) -> tuple[Memory, ...]:
        """Mean deflection of the bristles."""
        return (Memory("bristle", "rad", self.breakaway / self.stiffness),)

    def friction(self, memory: Sequence[Scalar], load: Scalar, speed: Scalar) -> Scalar:
        """Torque [N m] with the sign of the speed [rad/s] that it opposes."""
        (rate,) = self.rates(memory, load, speed)
        return self.stiffness * memory[0] + self.damping * rate + self.viscous * speed

    def rates(self, memory: Sequence[Scalar], load: Scalar, speed: Scalar) -> list[Scalar]:
        """Rate of the deflection of the bristles [rad/s]."""
        return [bristle_rate(memory[0], speed, self.stiffness, self.level(speed))]
