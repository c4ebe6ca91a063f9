"""Friction by DIN 3990-4: a film of oil between rough teeth."""

from dataclasses import dataclass
from typing import Annotated

import casadi as ca

from gear.friction.law import FrictionLaw
from gear.lubrication.law import Lubricant
from gear.lubrication.lubricant import GivenViscosity
from gear.motion import Sliding
from gear.quantities import Length, PositiveCoefficient, Scalar, Share, check
from gear.quantities.registry import part
from gear.quantities.roles import Breakaway
from gear.teeth.pair import Pair

FORCE_FLOOR = 1e-3  # N; below it the coefficient is constant, as its slope over the force is infinite at zero
SI = 1e-3  # the bracket with N/mm, um, mPa s, m/s, mm over the one with N/m, m, Pa s, m/s, m: 1e-3 1e6 / (1e3 1e3)


@part(FrictionLaw)
@dataclass(frozen=True, kw_only=True)
class Din3990(FrictionLaw):
    """Mean coefficient of friction of lubricated teeth by DIN 3990-4, never above the static one.

        mu = min(static, 0.12 (w_bt R_a / (eta v_sum rho_redC))^0.25)

        w_bt     = F_n / (effective_width face_width)                line load [N/mm]
        R_a      = roughness [um],   eta = dynamic viscosity [mPa s]
        v_sum    = 2 |v| sin(alpha)                                  sum of the rolling speeds [m/s]
        rho_redC = r_A r_B sin(alpha) / ((r_A + r_B) cos(beta_b))    reduced radius at the pitch point [mm]

    All inputs are in SI and are converted here. As mu grows without bound toward standstill, it is capped at
    all speeds: a breakaway coefficient below the sliding one would have no consistent motion. Computed as

        mu = static (v_cap / max(|v|, v_cap))^0.25,     v_cap = speed at which the formula gives `static`

    which has finite slopes at zero speed. Thicker oil LOWERS this coefficient: what makes a cold gearbox heavy
    (churning, seals, grease) is not in it and belongs to bearings or to a table of efficiencies.

    Parameters
    ----------
    static : float
        Coefficient at standstill and cap [-].
    lubricant : Lubricant
        Viscosity, or an oil at a temperature.
    roughness : float
        Arithmetic mean roughness R_a of the flanks [m].
    face_width : float
        [m].
    effective_width : float
        Part of the face width that carries [-].

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (35)-(37), after DIN 3990-4 (1987).
    There the cap holds at standstill only, and the viscosity of 275 mPa s has the unit Pa s.
    """

    static: Annotated[PositiveCoefficient, Breakaway(floor=None)]  # it caps sliding too, so the two never part
    lubricant: Lubricant
    roughness: Length
    face_width: Length
    effective_width: Share = 1.0

    @classmethod
    def examples(cls) -> "tuple[Din3990, ...]":
        """Teeth of the gear paper."""
        return (cls(static=0.2, lubricant=GivenViscosity(viscosity=0.275), roughness=8e-7, face_width=0.01),)

    def __post_init__(self) -> None:
        check(self)

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where a pair has no radius of curvature, such as a thread."""
        a, b = pair.radius_a, pair.radius_b
        if a * b * (a + b) <= 0:
            raise ValueError(
                f"Din3990 is for teeth that roll on each other, got {type(pair).__name__} with radius_a={a:.6g} m and "
                f"radius_b={b:.6g} m; use a law over speed, such as Stribeck"
            )

    def cap_speed(self, force: Scalar, pair: Pair) -> Scalar:
        """Mesh speed [m/s] below which the formula would exceed `static`, at a normal force [N]."""
        line_load = ca.fmax(force, FORCE_FLOOR) / (self.effective_width * self.face_width)
        film = self.lubricant.dynamic_viscosity() * reduced_radius(pair) * 2 * ca.sin(pair.working_angle)
        return SI * line_load * self.roughness / film * (0.12 / self.static) ** 4

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]; falls with speed and viscosity, rises with the normal force."""
        cap = self.cap_speed(sliding.force, sliding.pair)
        return self.static * (cap / ca.fmax(sliding.speed, cap)) ** 0.25

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.static


def reduced_radius(pair: Pair) -> Scalar:
    """Reduced radius of curvature of a pair at the pitch point, rho_redC [m]."""
    a, b = pair.radius_a, pair.radius_b
    return a * b / (a + b) * ca.sin(pair.working_angle) / ca.cos(pair.base_helix_angle)
