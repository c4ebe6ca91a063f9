"""Internal gear pairs: a wheel A with teeth on the outside that runs inside a ring gear B."""

import math
from dataclasses import dataclass
from functools import cached_property

from gear.involute import Gearing, Path, Rack, Teeth, gearing
from gear.quantities import Factor, HelixAngle, Length, Number, PressureAngle, Scalar, check
from gear.tooth_checks import require_possible, require_teeth


@dataclass(frozen=True, kw_only=True)
class InternalPair:
    """Wheel A inside a ring gear B, spur or helical, at the distance without backlash.

    The ring has a negative radius, and every formula of a mesh holds for it as it stands:

        r_B < 0:   x_B = -r_B phi_B,   l_B = r_B cos(alpha) < 0,   length T1T2 = (r_A + r_B) sin(alpha) < 0

    so that both wheels turn the same way and the normal force turns them opposite ways. Friction is averaged over
    the path of contact, see `gear.involute.Path`. Its arm on the ring is d_tauB taken with the signed length,
    the negative of the one that true radii give; the moment balance d_tauA + d_tauB = T1T2 d_F is that of any pair.

        inv(alpha_w) = inv(alpha_t) + 2 tan(alpha_n) (shift_a + shift_b) / (teeth_a - teeth_b)
        tip radius of the wheel = m_t teeth_a/2 + m (addendum_a + shift_a)
        tip radius of the ring  = m_t teeth_b/2 - m (addendum_b + shift_b)

    Parameters
    ----------
    teeth_a, teeth_b : int
        Numbers of teeth of the wheel and the ring, both positive.
    module : float
        Normal module m [m]; for spur teeth without shift, pitch diameter = module * teeth.
    pressure_angle : float
        Normal pressure angle alpha_n of the rack [rad]; the working one of spur teeth without shift.
    helix_angle : float
        beta, at the reference cylinders [rad]; 0 for spur teeth.
    shift_a, shift_b : float
        Profile shifts, in modules [-]; positive makes the teeth of either thicker, which for the ring is inward
        (ISO 21771; others count it outward). Equal and opposite shifts leave the center distance as it is.
    addendum_a, addendum_b : float
        Height of the teeth beyond the reference circle, without the shift, in modules [-]. Rings often need less
        than one: a high tip meets the wheel below its base circle.
    tip_radius_a, tip_radius_b : float or None
        Where a wheel was turned down or measured [m]; the addendum is then that of the rack only; both positive.

    Raises
    ------
    ValueError
        Where the teeth cannot be cut or cannot mesh, see `gear.tooth_checks.require_possible`.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (21), (27), (30); ISO 21771 for the teeth;
    SDP/SI, "Elements of metric gear technology" (D785), section 5.2, for tips in each other's way.
    """

    teeth_a: int
    teeth_b: int
    module: Length
    pressure_angle: PressureAngle = math.radians(20.0)
    helix_angle: HelixAngle = 0.0
    shift_a: Number = 0.0
    shift_b: Number = 0.0
    addendum_a: Factor = 1.0
    addendum_b: Factor = 1.0
    tip_radius_a: Length | None = None
    tip_radius_b: Length | None = None

    def __post_init__(self) -> None:
        check(self)
        require_teeth(self)
        if self.teeth_b <= self.teeth_a:
            raise ValueError(
                f"InternalPair needs more teeth on the ring than on the wheel inside it, got teeth_a={self.teeth_a} "
                f"and teeth_b={self.teeth_b}"
            )
        require_possible(type(self).__name__, *self._parts())

    def _parts(self) -> tuple[Rack, Teeth, Teeth]:
        rack = Rack(self.module, self.pressure_angle, self.helix_angle)
        a = Teeth(self.teeth_a, self.shift_a, self.addendum_a, self.tip_radius_a)
        tip = None if self.tip_radius_b is None else -self.tip_radius_b
        return rack, a, Teeth(-self.teeth_b, self.shift_b, self.addendum_b, tip)

    @cached_property
    def gearing(self) -> Gearing:
        """Everything that follows from the teeth, that of the ring negative: radii, angles, center distance, ratios."""
        return gearing(*self._parts())

    @property
    def radius_a(self) -> Scalar:
        """Working pitch radius [m] of wheel A."""
        return self.gearing.radius_a

    @property
    def radius_b(self) -> Scalar:
        """Working pitch radius [m] of the ring, negative."""
        return self.gearing.radius_b

    @property
    def working_angle(self) -> Scalar:
        """Working transverse pressure angle [rad]."""
        return self.gearing.angle

    @property
    def base_helix_angle(self) -> Scalar:
        """Helix angle at the base cylinders, beta_b [rad]."""
        return self.gearing.base_helix_angle

    @property
    def tooth_pitch(self) -> Scalar:
        """Feed from tooth to tooth on the working pitch circles [m]."""
        return self.gearing.pitch

    @property
    def friction_factor(self) -> Scalar:
        """Averaged friction force on the bearings per unit of friction scalar, d_F [-]."""
        return self.path().friction_factor

    @property
    def friction_arm_a(self) -> Scalar:
        """Averaged lever arm of the friction on wheel A, -d_tauA [m]."""
        return self.path().friction_arm_a

    @property
    def friction_arm_b(self) -> Scalar:
        """Averaged lever arm of the friction on the ring, d_tauB with the signed length [m]."""
        return self.path().friction_arm_b

    def path(self) -> Path:
        """Path of contact from the tip circle of the ring to the tip circle of A."""
        return self.gearing.path()

    def contact_ratio(self) -> Scalar:
        """Average number of tooth pairs in contact in one plane [-]."""
        return self.gearing.contact_ratio()
