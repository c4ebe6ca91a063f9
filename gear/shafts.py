"""Shafts and what stands beside the meshes: bearings with stiction, flexible couplings."""

from dataclasses import dataclass

from gear.quantities import FrictionTorque, Inertia, TorsionalDamping, TorsionalStiffness, check, show


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

        torque opposing motion = coulomb + viscous * |speed|      while turning
                              <= breakaway                        at rest

    Parameters
    ----------
    shaft : str
        Name of the shaft it supports.
    coulomb, breakaway : float
        Torque while turning slowly, and the largest that holds the shaft at rest [N m]; coulomb <= breakaway.
    viscous : float
        Torque per speed [N m s/rad].
    """

    shaft: str
    coulomb: FrictionTorque
    breakaway: FrictionTorque
    viscous: TorsionalDamping = 0.0

    def __post_init__(self) -> None:
        check(self)
        if self.breakaway < self.coulomb:
            raise ValueError(
                f"Bearing on shaft {self.shaft!r} needs coulomb <= breakaway, got coulomb="
                f"{show(self.coulomb, 'N m')} and breakaway={show(self.breakaway, 'N m')}; a breakaway torque below "
                "the sliding one has no consistent motion at standstill"
            )


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """Torsional spring and damper between two shafts: a flexible shaft, mounting or surface.

        torque on b = stiffness (phi_a - phi_b) + damping (phi_a' - phi_b'),   on a the opposite

    Parameters
    ----------
    a, b : str
        Names of the shafts it joins.
    stiffness : float
        [N m/rad].
    damping : float
        [N m s/rad].
    """

    a: str
    b: str
    stiffness: TorsionalStiffness
    damping: TorsionalDamping

    def __post_init__(self) -> None:
        check(self)
        if self.a == self.b:
            raise ValueError(f"Coupling needs two different shafts, got {self.a!r} twice")
