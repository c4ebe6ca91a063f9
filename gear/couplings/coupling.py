"""Torsional springs between two shafts or to the housing, with free play or without."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Unit

from gear.couplings.law import ShaftCoupling, Twist
from gear.elasticity.law import pushing
from gear.quantities import Scalar, TorsionalDamping, TorsionalStiffness, check
from gear.quantities.registry import part
from gear.quantities.roles import Gap


@part(ShaftCoupling, default=True)
@dataclass(frozen=True, kw_only=True)
class Coupling(ShaftCoupling):
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

    @classmethod
    def examples(cls) -> "tuple[Coupling, ...]":
        """Between shafts and to the housing, with free play and without."""
        return (
            cls(a="a", b="b", stiffness=1e3, damping=1.0),
            cls(a="a", stiffness=1e3, damping=1.0, gap=0.01),
        )

    def __post_init__(self) -> None:
        check(self)
        if self.a == self.b:
            raise ValueError(f"Coupling needs two different shafts, got {self.a!r} twice")

    def terminals(self) -> dict[str, str]:
        """Names of shafts, by the field that names them."""
        return {"a": self.a} if self.b is None else {"a": self.a, "b": self.b}

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
