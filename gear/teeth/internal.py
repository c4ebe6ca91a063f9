"""Internal gear pairs: a wheel A with teeth on the outside that runs inside a ring gear B."""

from dataclasses import dataclass

from gear.quantities.registry import part
from gear.teeth.pair import Pair
from gear.teeth.toothed_pair import ToothedPair


@part(Pair)
@dataclass(frozen=True, kw_only=True)
class InternalPair(ToothedPair):
    """Wheel A inside a ring gear B, spur or helical, at the distance without backlash.

    The ring has a negative radius, and every formula of a mesh holds for it as it stands:

        r_B < 0:   x_B = -r_B phi_B,   l_B = r_B cos(alpha) < 0,   length T1T2 = (r_A + r_B) sin(alpha) < 0

    so that both wheels turn the same way and the normal force turns them opposite ways. Friction is averaged over
    the path of contact, see `gear.teeth.involute.Path`. Its arm on the ring is d_tauB taken with the signed length,
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
        Where the teeth cannot be cut or cannot mesh, see `gear.teeth.checks.require_possible`.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (21), (27), (30); ISO 21771 for the teeth;
    SDP/SI, "Elements of metric gear technology" (D785), section 5.2, for tips in each other's way.
    """

    side_b = -1

    def _require_sides(self) -> None:
        if self.teeth_b <= self.teeth_a:
            raise ValueError(
                f"InternalPair needs more teeth on the ring than on the wheel inside it, got teeth_a={self.teeth_a} "
                f"and teeth_b={self.teeth_b}"
            )
