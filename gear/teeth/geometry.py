"""External involute pairs from their teeth, and pairs from given numbers. Rings: see `gear.teeth.internal`."""

import math
from dataclasses import dataclass
from typing import ClassVar

from gear.quantities import Arm, HelixAngle, Length, Number, PressureAngle, Scalar, check, show
from gear.quantities.registry import part
from gear.teeth.pair import Pair
from gear.teeth.toothed_pair import ToothedPair


@part(Pair)
@dataclass(frozen=True, kw_only=True)
class ExternalPair(ToothedPair):
    """External involute pair, spur or helical, with or without profile shift, at its distance without backlash.

        inv(alpha_w) = inv(alpha_t) + 2 tan(alpha_n) (shift_a + shift_b) / (teeth_a + teeth_b)
        r            = m_t z/2 * cos(alpha_t) / cos(alpha_w)              working pitch radius
        tip radius   = m_t z/2 + m (addendum + shift - excess)            excess = shift_a + shift_b - (a - a_0) / m

    m, alpha_n are those of the rack, in the section normal to the teeth; m_t = m / cos(beta) and alpha_t =
    atan(tan(alpha_n) / cos(beta)) in the plane of the wheels; a is the center distance and a_0 that without
    shifts. The excess (zero where the shifts cancel) keeps the clearance between tip and root.

    Friction is averaged over the path of contact, see `gear.teeth.involute.Path`.

    Parameters
    ----------
    teeth_a, teeth_b : int
        Numbers of teeth.
    module : float
        Normal module m [m]; for spur teeth without shift, pitch diameter = module * teeth.
    pressure_angle : float
        Normal pressure angle alpha_n of the rack [rad]; the working one of spur teeth without shift.
    helix_angle : float
        beta, at the reference cylinders [rad]; 0 for spur teeth. Its hand does not matter.
    shift_a, shift_b : float
        Profile shifts, in modules [-]; positive makes teeth thicker and tips higher.
    addendum_a, addendum_b : float
        Height of the teeth beyond the reference circle, without the shift, in modules [-].
    tip_radius_a, tip_radius_b : float or None
        Where a wheel was turned down or measured [m]; the addendum is then that of the rack only.

    Raises
    ------
    ValueError
        Where the teeth cannot be cut or cannot mesh, see `gear.teeth.checks.require_possible`.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (21), (27), (30); ISO 21771 for the teeth.
    """


@part(Pair)
@dataclass(frozen=True, kw_only=True)
class GivenPair:
    """A gear pair whose averaged constants are given as numbers, not computed from teeth.

    For measured or published constants, such as the table of the gear paper whose printed values do not
    follow from its own geometry: friction_factor=0.84, friction_arm_a=9.2e-3, friction_arm_b=15e-3.

    Parameters
    ----------
    radius_a, radius_b : float
        Pitch radii [m]; that of a ring gear B is negative and the larger one.
    pressure_angle : float
        Working pressure angle [rad].
    friction_factor : float
        d_F [-].
    friction_arm_a, friction_arm_b : float
        -d_tauA and d_tauB [m], the latter with the signs of `gear.teeth.internal.InternalPair` where B is a ring.
    base_helix_angle : float
        beta_b [rad], which friction laws may ask for; 0 for spur teeth.
    tooth_pitch : float or None
        Feed from tooth to tooth on the pitch circles [m], which periodic laws ask for.
    """

    radius_a: Length
    radius_b: Arm
    friction_arm_a: Arm
    friction_arm_b: Arm
    friction_factor: Number = 0.0
    pressure_angle: PressureAngle = math.radians(20.0)
    base_helix_angle: HelixAngle = 0.0
    tooth_pitch: Length | None = None

    sticks_by_mesh_speed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check(self)
        if -self.radius_a <= self.radius_b <= 0:
            raise ValueError(
                "GivenPair.radius_b must be > 0 m, or for a ring < -radius_a = "
                f"{show(-self.radius_a, 'm')}, got {show(self.radius_b, 'm')}"
            )

    @property
    def working_angle(self) -> Scalar:
        """The given pressure angle [rad]."""
        return self.pressure_angle

    def size(self) -> str:
        """Its radii."""
        return f"{1e3 * self.radius_a:.4g} : {1e3 * self.radius_b:.4g} mm"
