"""Drag of oil beside the meshes: rolling bearings by Palmgren, and any drag with another oil than it was measured."""

import math
from dataclasses import dataclass

import casadi as ca

from gear.lubrication.law import Lubricant
from gear.quantities import Exponent, Factor, Length, Scalar, check

BOUNDARY = 2000.0  # mm^2/s times 1/min, below which Palmgren's torque no longer falls
TO_PALMGREN = 1e6 * 30 / math.pi  # m^2/s times rad/s to mm^2/s times 1/min
TO_NEWTON_METERS = 1e-7 * 1e9 * 1e-3  # his constant, with the diameter in m^3 for mm^3 and N m for N mm


@dataclass(frozen=True, kw_only=True)
class Palmgren:
    """Torque of the oil in a rolling bearing, which depends on speed and viscosity and not on the load.

        M_0 = 1e-7 f_0 max(nu n, 2000)^(2/3) d_m^3          N mm, with nu in mm^2/s, n in 1/min, d_m in mm

    Inputs are in SI and are converted here. Palmgren prints 160e-7 f_0 d_m^3 for nu n < 2000, which is this but for
    0.8 %; it does not vanish at standstill, so it adds to the breakaway torque of the bearing, too.

    In thick cold oil this is an upper bound: the rollers push aside more than flows back (starvation), and the oil
    between them warms up by shear, which later methods of the makers of bearings take into account.

    Parameters
    ----------
    diameter : float
        Mean diameter of the bearing d_m [m].
    factor : float
        f_0, by type of bearing and lubrication [-]: about 1 to 10, from the tables of the maker.
    lubricant : Lubricant
        With its density: the oil, or the base oil of the grease.

    References
    ----------
    A. Palmgren, "Ball and Roller Bearing Engineering", 3rd ed., SKF (1959); T. A. Harris, "Rolling Bearing Analysis",
    chapter on friction torque.
    """

    diameter: Length
    factor: Factor
    lubricant: Lubricant

    def __post_init__(self) -> None:
        check(self)
        self.lubricant.kinematic_viscosity()  # for its density

    def torque(self, speed: Scalar) -> Scalar:
        """Torque against the motion [N m] at a speed >= 0 [rad/s]."""
        film = ca.fmax(self.lubricant.kinematic_viscosity() * speed * TO_PALMGREN, BOUNDARY) ** (2 / 3)
        return TO_NEWTON_METERS * self.factor * self.diameter**3 * film


@dataclass(frozen=True, kw_only=True)
class Thickening:
    """What becomes of a drag torque with another lubricant, or at another temperature, than it was measured with.

        factor = (eta / eta_measured)^exponent

    Parameters
    ----------
    lubricant : Lubricant
        In use.
    measured_with : Lubricant
        During the measurement.
    exponent : float
        0 to 1 [-]: 1 for oil that is sheared in a gap, as in plain bearings and seals (Petroff); 2/3 for rolling
        bearings at one speed (Palmgren); less for churning, where the inertia of the oil counts.

    References
    ----------
    N. P. Petrov, "Friction in machines and the effect of the lubricant" (1883).
    """

    lubricant: Lubricant
    measured_with: Lubricant
    exponent: Exponent = 1.0

    def __post_init__(self) -> None:
        check(self)

    def factor(self) -> Scalar:
        """Torque over that of the measurement [-]."""
        return (self.lubricant.dynamic_viscosity() / self.measured_with.dynamic_viscosity()) ** self.exponent
