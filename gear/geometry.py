"""Involute gear pairs: from teeth to the averaged constants of their friction."""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import casadi as ca

from gear.quantities import Arm, Factor, Length, Number, PressureAngle, Scalar, check


class Pair(Protocol):
    """What a mesh asks of a gear pair, however the numbers were obtained.

    Pitch radii [m], working pressure angle [rad], and the averaged constants of the friction: the lever
    arms `friction_arm_a`, `friction_arm_b` [m] on the wheels and the `friction_factor` [-] on the bearings.
    """

    @property
    def radius_a(self) -> Scalar:
        """Pitch radius [m] of wheel A."""
        ...

    @property
    def radius_b(self) -> Scalar:
        """Pitch radius [m] of wheel B."""
        ...

    @property
    def pressure_angle(self) -> Scalar:
        """Working transverse pressure angle [rad]."""
        ...

    @property
    def friction_factor(self) -> Scalar:
        """d_F [-]."""
        ...

    @property
    def friction_arm_a(self) -> Scalar:
        """-d_tauA [m]."""
        ...

    @property
    def friction_arm_b(self) -> Scalar:
        """d_tauB [m]."""
        ...


class Path(NamedTuple):
    """The path of contact, as distances [m] along the line of action from base tangent point T1 of wheel A."""

    length: float  # T1 to T2
    pitch: float  # T1 to the pitch point P
    start: float  # T1 to A, where the tip circle of B crosses
    end: float  # T1 to B, where the tip circle of A crosses


@dataclass(frozen=True, kw_only=True)
class ExternalPair:
    """External involute spur pair on its standard center distance.

    The friction of a tooth pair changes sign at the pitch point. Averaged over the path of contact it is
    one force scalar s acting along three constants (gear_a on the left, T1 its base tangent point):

        d_F    = (2 T1P - T1A - T1B) / (T1B - T1A)                  friction_factor
        d_tauA = (2 T1P^2 - T1A^2 - T1B^2) / (2 (T1B - T1A))        friction_arm_a = -d_tauA
        d_tauB = (2 T2P^2 - T2A^2 - T2B^2) / (2 (T2B - T2A))        friction_arm_b =  d_tauB

    Parameters
    ----------
    teeth_a, teeth_b : int
        Numbers of teeth.
    module : float
        Module [m]; pitch diameter = module * teeth.
    pressure_angle : float
        Working transverse pressure angle [rad].
    addendum_a, addendum_b : float
        Tip radius minus pitch radius, in modules [-].

    Raises
    ------
    ValueError
        Where the teeth cannot mesh: interference at a base circle, or a contact ratio below one.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (21), (27), (30).
    """

    teeth_a: int
    teeth_b: int
    module: Length
    pressure_angle: PressureAngle = math.radians(20.0)
    addendum_a: Factor = 1.0
    addendum_b: Factor = 1.0

    def __post_init__(self) -> None:
        check(self)
        for name in ("teeth_a", "teeth_b"):
            count = getattr(self, name)
            if isinstance(count, bool) or not isinstance(count, int) or count < 1:
                raise ValueError(f"ExternalPair.{name} must be a whole number of teeth >= 1, got {count!r}")
        path = self.path()
        for wheel, other, distance in (("a", "b", path.start), ("b", "a", path.length - path.end)):
            if distance < 0:
                raise ValueError(
                    f"ExternalPair: the tip of wheel {other} reaches {-1e3 * distance:.4g} mm below the base tangent "
                    f"point of wheel {wheel} (interference); needs more teeth on wheel {wheel}, a larger pressure "
                    f"angle or a smaller addendum_{other}"
                )
        if self.contact_ratio() < 1:
            raise ValueError(
                f"ExternalPair needs a contact ratio >= 1 to hand over from tooth to tooth, got "
                f"{self.contact_ratio():.4g}; enlarge addendum_a or addendum_b"
            )

    @property
    def radius_a(self) -> Scalar:
        """Pitch radius [m] of wheel A."""
        return self.module * self.teeth_a / 2

    @property
    def radius_b(self) -> Scalar:
        """Pitch radius [m] of wheel B."""
        return self.module * self.teeth_b / 2

    def path(self) -> Path:
        """Path of contact from the tip circle of B to the tip circle of A."""
        base_a = self.radius_a * ca.cos(self.pressure_angle)
        base_b = self.radius_b * ca.cos(self.pressure_angle)
        tip_a = self.radius_a + self.addendum_a * self.module
        tip_b = self.radius_b + self.addendum_b * self.module
        length = (self.radius_a + self.radius_b) * ca.sin(self.pressure_angle)
        return Path(
            length=length,
            pitch=self.radius_a * ca.sin(self.pressure_angle),
            start=length - ca.sqrt(tip_b**2 - base_b**2),
            end=ca.sqrt(tip_a**2 - base_a**2),
        )

    @property
    def friction_factor(self) -> Scalar:
        """Averaged friction force on the bearings per unit of friction scalar, d_F [-]."""
        path = self.path()
        return (2 * path.pitch - path.start - path.end) / (path.end - path.start)

    @property
    def friction_arm_a(self) -> Scalar:
        """Averaged lever arm of the friction on wheel A, -d_tauA [m]."""
        path = self.path()
        return -(2 * path.pitch**2 - path.start**2 - path.end**2) / (2 * (path.end - path.start))

    @property
    def friction_arm_b(self) -> Scalar:
        """Averaged lever arm of the friction on wheel B, d_tauB [m]."""
        path = self.path()
        pitch, start, end = (path.length - distance for distance in path[1:])
        return (2 * pitch**2 - start**2 - end**2) / (2 * (end - start))

    def contact_ratio(self) -> float:
        """Average number of tooth pairs in contact [-]."""
        path = self.path()
        return (path.end - path.start) / (math.pi * self.module * ca.cos(self.pressure_angle))


@dataclass(frozen=True, kw_only=True)
class GivenPair:
    """A gear pair whose averaged constants are given as numbers, not computed from teeth.

    For measured or published constants, such as the table of the gear paper whose printed values do not
    follow from its own geometry: friction_factor=0.84, friction_arm_a=9.2e-3, friction_arm_b=15e-3.

    Parameters
    ----------
    radius_a, radius_b : float
        Pitch radii [m].
    pressure_angle : float
        Working transverse pressure angle [rad].
    friction_factor : float
        d_F [-].
    friction_arm_a, friction_arm_b : float
        -d_tauA and d_tauB [m].
    """

    radius_a: Length
    radius_b: Length
    friction_arm_a: Arm
    friction_arm_b: Arm
    friction_factor: Number = 0.0
    pressure_angle: PressureAngle = math.radians(20.0)

    def __post_init__(self) -> None:
        check(self)
