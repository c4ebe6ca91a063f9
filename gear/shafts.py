"""Shafts and what brakes them beside the meshes: bearings with stiction, drag."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from gear.friction.tables import piecewise_linear
from gear.lubrication.drag import Palmgren, Thickening
from gear.quantities import Distance, FrictionTorque, Inertia, Scalar, TorsionalDamping, check, show
from gear.quantities.roles import Breakaway, SlidingFriction


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """A rigid shaft with everything that turns with it.

    Parameters
    ----------
    inertia : float
        [kg m^2].
    """

    inertia: Inertia

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class Bearing:
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

    def __post_init__(self) -> None:
        check(self)
        if self.breakaway < self.coulomb:
            raise ValueError(
                f"Bearing on shaft {self.shaft!r} needs coulomb <= breakaway, got coulomb="
                f"{show(self.coulomb, 'N m')} and breakaway={show(self.breakaway, 'N m')}; a breakaway torque below "
                "the sliding one has no consistent motion at standstill"
            )

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


@dataclass(frozen=True, kw_only=True)
class Drag:
    """Torque that opposes motion and vanishes at rest, as a table over speed: windage, churning.

        torque = -sign(speed) * table(|speed|) * thickening

    with straight lines between the points, constant beyond the last.

    Parameters
    ----------
    shaft : str
        Name of the shaft.
    speeds : tuple of float
        [rad/s], increasing from 0.
    torques : tuple of float
        [N m], as many, the first 0, none negative.
    thickening : Thickening or None
        Makes the torques depend on the oil; None where they are given for the oil in use.
    """

    shaft: str
    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    thickening: Thickening | None = None

    def __post_init__(self) -> None:
        where = f"Drag on shaft {self.shaft!r}"
        if len(self.speeds) != len(self.torques) or len(self.speeds) < 2:  # noqa: PLR2004
            raise ValueError(
                f"{where} needs at least two speeds and as many torques, got {len(self.speeds)} and {len(self.torques)}"
            )
        if self.speeds[0] != 0 or any(late <= early for early, late in pairwise(self.speeds)):
            raise ValueError(f"{where}: speeds must increase from 0 rad/s, got {self.speeds}")
        if self.torques[0] != 0 or min(self.torques) < 0:
            raise ValueError(f"{where}: torques must begin with 0 N m and not be negative, got {self.torques}")

    def torque(self, speed: Scalar) -> Scalar:
        """Torque on the shaft [N m] at a signed speed [rad/s]; an odd function, so no sign is taken."""
        mirrored = (*(-value for value in reversed(self.speeds[1:])), *self.speeds)
        odd = (*(-value for value in reversed(self.torques[1:])), *self.torques)
        return -piecewise_linear(speed, mirrored, odd) * (1.0 if self.thickening is None else self.thickening.factor())
