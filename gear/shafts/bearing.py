"""Bearings and seals with stiction, dry and oiled."""

from dataclasses import dataclass
from typing import Annotated

from gear.friction.law import require_breakaway_above
from gear.lubrication.drag import Palmgren, Thickening
from gear.lubrication.lubricant import GivenViscosity
from gear.quantities import Distance, FrictionTorque, Scalar, TorsionalDamping, check
from gear.quantities.registry import part
from gear.quantities.roles import Breakaway, SlidingFriction
from gear.shafts.law import ShaftBearing


@part(ShaftBearing, default=True)
@dataclass(frozen=True, kw_only=True)
class Bearing(ShaftBearing):
    """Friction between a shaft and the housing: bearing and seal, with stiction.

        opposing torque = coulomb + load_arm * load + film(|speed|) + viscous * thickening * |speed|    while turning
                       <= breakaway + load_arm * load + film(0)                                         at rest

    The load is the sum of the normal forces of the meshes on the shaft.

    Parameters
    ----------
    shaft : str
        Name of the shaft it supports.
    coulomb, breakaway : float
        Torque while turning slowly, and the largest that holds the shaft at rest [N m]; coulomb <= breakaway.
    viscous : float
        Torque per speed [N m s/rad].
    load_arm : float
        Friction torque per load [m]: friction coefficient times radius of the bearing.
    thickening : Thickening or None
        Makes `viscous` depend on the oil; None where it is given for the oil in use.
    film : Palmgren or None
        Torque of the oil in a rolling bearing.
    """

    shaft: str
    coulomb: Annotated[FrictionTorque, SlidingFriction()]
    breakaway: Annotated[FrictionTorque, Breakaway(floor="coulomb")]
    viscous: TorsionalDamping = 0.0
    load_arm: Distance = 0.0
    thickening: Thickening | None = None
    film: Palmgren | None = None

    @classmethod
    def examples(cls) -> "tuple[Bearing, ...]":
        """Dry, and oiled under load."""
        return (
            cls(shaft="a", coulomb=0.1, breakaway=0.15),
            cls(
                shaft="a",
                coulomb=0.1,
                breakaway=0.15,
                viscous=0.01,
                load_arm=1e-4,
                film=Palmgren(diameter=0.02, factor=2.0, lubricant=GivenViscosity(viscosity=0.1, density=900.0)),
            ),
        )

    def __post_init__(self) -> None:
        check(self)
        owner = f"Bearing on shaft {self.shaft!r}"
        require_breakaway_above(owner, ("coulomb", self.coulomb), ("breakaway", self.breakaway), "N m")

    @property
    def carries_load(self) -> bool:
        """Whether friction rises with the load."""
        return self.load_arm > 0

    def holding(self, load: Scalar) -> Scalar:
        """Largest torque [N m] that holds the shaft at rest under a load [N]."""
        return self.breakaway + self.load_arm * load + self._film(0.0)

    def sliding(self, load: Scalar, speed: Scalar) -> Scalar:
        """Torque against the motion [N m] under a load [N] at a speed >= 0 [rad/s], without `viscous`."""
        return self.coulomb + self.load_arm * load + self._film(speed)

    def _film(self, speed: Scalar) -> Scalar:
        return 0.0 if self.film is None else self.film.torque(speed)

    def viscous_torque(self, speed: Scalar) -> Scalar:
        """Torque on the shaft [N m] at a signed speed [rad/s]."""
        return -self.viscous * (1.0 if self.thickening is None else self.thickening.factor()) * speed
