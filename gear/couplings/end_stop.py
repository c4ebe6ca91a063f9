"""Ends of the travel of a shaft."""

from dataclasses import dataclass

from gear.couplings.law import ShaftStop, Twist
from gear.elasticity.law import pushing
from gear.quantities import Angle, Scalar, TorsionalDamping, TorsionalStiffness, check, show
from gear.quantities.registry import part


@part(ShaftStop, default=True)
@dataclass(frozen=True, kw_only=True)
class EndStop(ShaftStop):
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

    @classmethod
    def examples(cls) -> "tuple[EndStop, ...]":
        """Stops that are not symmetric."""
        return (cls(shaft="a", lower=-0.3, upper=0.5, stiffness=1e3, damping=1.0),)

    def __post_init__(self) -> None:
        check(self)
        if self.lower >= self.upper:
            raise ValueError(
                f"EndStop on shaft {self.shaft!r} needs lower < upper, got lower={show(self.lower, 'rad')} and "
                f"upper={show(self.upper, 'rad')}"
            )

    def terminals(self) -> dict[str, str]:
        """Names of shafts, by the field that names them."""
        return {"shaft": self.shaft}

    def free_range(self) -> tuple[Scalar, Scalar]:
        """The two angles [rad]."""
        return self.lower, self.upper

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
