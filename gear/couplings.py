"""Torsional springs between two shafts or to the housing, with free play or without, and end stops."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from annotated_types import Ge, Unit

from gear.elasticity.law import pushing
from gear.quantities import Angle, Scalar, TorsionalDamping, TorsionalStiffness, check, show
from gear.quantities.roles import Gap

TWIST_NOMINAL = 1e-4  # rad; couplings under load twist by about this


class Twist(NamedTuple):
    """How far a coupling is turned, and how fast."""

    angle: Scalar  # phi_a - phi_b [rad]
    rate: Scalar  # its time derivative [rad/s]


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """Torsional spring and damper between two shafts: a flexible shaft, mounting or surface, with free play or without.

        twist = phi_a - phi_b,   torque on b = T,   on a = -T

        without gap:  T = stiffness twist + damping twist'
        with a gap:   x = flank * twist - gap/2                            penetration of the engaged flank
                      T = flank * (stiffness x + damping x' limited to +-stiffness x),   zero for flank 0, in the gap

    With a gap the coupling can push and cannot pull, as `Backlash` between teeth.

    Parameters
    ----------
    a : str
        Name of the shaft on one side.
    b : str or None
        Name of the shaft on the other side; None for the housing.
    stiffness : float
        [N m/rad].
    damping : float
        [N m s/rad].
    gap : float or None
        TOTAL free play [rad]; None for a coupling without any.
    """

    a: str
    b: str | None = None
    stiffness: TorsionalStiffness
    damping: TorsionalDamping
    gap: Annotated[float, Unit("rad"), Ge(0), Gap()] | None = None

    def __post_init__(self) -> None:
        check(self)
        if self.a == self.b:
            raise ValueError(f"Coupling needs two different shafts, got {self.a!r} twice")

    def twist_per_shaft(self) -> dict[str, float]:
        """Twist [rad] per angle [rad] of each shaft; the torques on the shafts are -T times these."""
        return {self.a: 1.0} if self.b is None else {self.a: 1.0, self.b: -1.0}

    def penetration(self, twist: Twist, flank: Scalar) -> Scalar:
        """How far the coupling is turned beyond its gap on a flank [rad]; None without a gap."""
        return None if self.gap is None else flank * twist.angle - self.gap / 2

    def torque(self, twist: Twist, flank: Scalar) -> Scalar:
        """Torque on b [N m] on the given flank; without a gap the flank does not matter."""
        penetration = self.penetration(twist, flank)
        if penetration is None:
            return self.stiffness * twist.angle + self.damping * twist.rate
        return flank * pushing(self.stiffness * penetration, self.damping * flank * twist.rate)

    def stored(self, twist: Twist, flank: Scalar) -> Scalar:
        """Energy in the spring [J]."""
        penetration = self.penetration(twist, flank)
        if penetration is None:
            return self.stiffness * twist.angle**2 / 2
        return flank**2 * self.stiffness * penetration**2 / 2


@dataclass(frozen=True, kw_only=True)
class EndStop:
    """What ends the travel of a shaft on both sides: a spring and damper to the housing beyond each of two angles.

        x = angle - upper  (flank +1)   or   lower - angle  (flank -1)     penetration
        torque on the shaft = -flank * (stiffness x + damping x' limited to +-stiffness x)

    Parameters
    ----------
    shaft : str
        Name of the shaft.
    lower, upper : float
        Angles at which the stops are touched [rad], lower < upper.
    stiffness : float
        [N m/rad].
    damping : float
        [N m s/rad].
    """

    shaft: str
    lower: Angle
    upper: Angle
    stiffness: TorsionalStiffness
    damping: TorsionalDamping = 0.0

    def __post_init__(self) -> None:
        check(self)
        if self.lower >= self.upper:
            raise ValueError(
                f"EndStop on shaft {self.shaft!r} needs lower < upper, got lower={show(self.lower, 'rad')} and "
                f"upper={show(self.upper, 'rad')}"
            )

    def twist_per_shaft(self) -> dict[str, float]:
        """Twist [rad] per angle [rad] of each shaft; the torques on the shafts are -T times these."""
        return {self.shaft: 1.0}

    def penetration(self, twist: Twist, flank: Scalar) -> Scalar:
        """How far the shaft is turned beyond the stop of a flank [rad]; half the range below zero for flank 0."""
        return flank * (twist.angle - (self.upper + self.lower) / 2) - (self.upper - self.lower) / 2

    def torque(self, twist: Twist, flank: Scalar) -> Scalar:
        """Torque on the housing [N m] at the given stop; zero for flank 0, between the stops."""
        penetration = self.penetration(twist, flank)
        return flank * pushing(self.stiffness * penetration, self.damping * flank * twist.rate)

    def stored(self, twist: Twist, flank: Scalar) -> Scalar:
        """Energy in the spring [J]."""
        return flank**2 * self.stiffness * self.penetration(twist, flank) ** 2 / 2
