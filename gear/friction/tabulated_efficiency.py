"""Friction from the efficiency of a mesh, given over speed for each driving side."""

from dataclasses import dataclass
from typing import Annotated

import casadi as ca

from gear.friction.law import SpeedLaw
from gear.friction.tables import piecewise_linear, require_axis
from gear.motion import Sliding
from gear.quantities import AtLeastOne, MeshSpeed, Scalar, Share, check
from gear.quantities.registry import part
from gear.quantities.roles import Breakaway
from gear.teeth.pair import Pair


@dataclass(frozen=True, kw_only=True)
class EfficiencyPoint:
    """An entry of an efficiency table.

    Parameters
    ----------
    speed : float
        Mesh speed [m/s].
    a_drives, b_drives : float
        Efficiency there where wheel A drives and where wheel B does [-], above 0 up to 1.
    """

    speed: MeshSpeed
    a_drives: Share
    b_drives: Share

    def __post_init__(self) -> None:
        check(self)


@part(SpeedLaw)
@dataclass(frozen=True, kw_only=True)
class TabulatedEfficiency(SpeedLaw):
    """Friction coefficients that give a mesh exactly the efficiencies of a table.

    The efficiency is linear between the points and constant beyond the last. The torques of the mesh,
    T_A = -F_n l_A - s e_A and T_B = -F_n l_B + s e_B with |s| = mu |F_n|, turn it into

        A drives:  mu = cos(alpha) (1 - eta) / (e_B/r_B + eta e_A/r_A)
        B drives:  mu = cos(alpha) (1 - eta) / (e_A/r_A + eta e_B/r_B)
        static     = breakout * the larger of the two at standstill

    The efficiency may be that of a whole cold gearbox lumped into one mesh: coefficients near one and above
    follow from it and are accepted.

    Parameters
    ----------
    points : tuple of EfficiencyPoint
        Speeds increase from zero. Its numbers stay constants of a model; they are not parameters.
    breakout : float
        Factor on the friction at standstill, >= 1 [-].

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (38)-(39); the signs follow the
    driving side, so that both coefficients are positive.
    """

    points: tuple[EfficiencyPoint, ...]
    breakout: Annotated[AtLeastOne, Breakaway(floor=1.0)] = 1.0

    @classmethod
    def examples(cls) -> "tuple[TabulatedEfficiency, ...]":
        """One efficiency, with breakout."""
        return (cls(points=(EfficiencyPoint(speed=0.0, a_drives=0.9, b_drives=0.85),), breakout=1.5),)

    def __post_init__(self) -> None:
        check(self)
        require_axis("TabulatedEfficiency", [point.speed for point in self.points])

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where no friction gives the teeth of a pair an efficiency of the table."""
        a, b = _arms(pair)
        for k, point in enumerate(self.points):
            for side, arm, other in (("a", b, a), ("b", a, b)):
                efficiency = getattr(point, f"{side}_drives")
                if arm + efficiency * other <= 0:
                    raise ValueError(
                        f"TabulatedEfficiency.points[{k}].{side}_drives = {efficiency:g} cannot be reached: with "
                        f"friction arms {a:.4g} r_A and {b:.4g} r_B, more friction does not lower the efficiency"
                    )

    def _coefficients(self, speed: Scalar, pair: Pair) -> tuple[Scalar, Scalar]:
        """Coefficients where A drives and where B does."""
        speeds, a_drives, b_drives = zip(*((p.speed, p.a_drives, p.b_drives) for p in self.points), strict=True)
        eta_a, eta_b = piecewise_linear(speed, speeds, a_drives), piecewise_linear(speed, speeds, b_drives)
        cosine, (a, b) = ca.cos(pair.working_angle), _arms(pair)
        return cosine * (1 - eta_a) / (b + eta_a * a), cosine * (1 - eta_b) / (a + eta_b * b)

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-] for the side that drives."""
        a_drives, b_drives = self._coefficients(sliding.speed, sliding.pair)
        return sliding.a_drives * a_drives + (1 - sliding.a_drives) * b_drives

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest; at rest no side drives."""
        return self.breakout * ca.fmax(*self._coefficients(0.0, sliding.pair))


def _arms(pair: Pair) -> tuple[Scalar, Scalar]:
    """Friction arms over pitch radii."""
    return pair.friction_arm_a / pair.radius_a, pair.friction_arm_b / pair.radius_b
