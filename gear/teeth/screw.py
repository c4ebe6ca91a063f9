"""The thread between a spindle and its nut, as a pair of a mesh."""

import math
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from gear.quantities import HelixAngle, Length, Scalar, check
from gear.quantities.registry import part
from gear.teeth.pair import Pair


@part(Pair)
@dataclass(frozen=True, kw_only=True)
class ScrewPair:
    """Spindle A and nut B of a screw, for a mesh that sticks by "conjugate speed".

    The nut's travel x counts as an angle, phi_B = x / h with h = lead / (2 pi): a nut of mass m is a shaft of
    inertia m h^2, and a load on it is a `LinearLoad` with the mechanism `Screw` of the same lead. With lead
    angle lambda, flank angle beta and mean radius r, the mesh's equations give what the inclined thread does:

        tan(lambda) = lead / (2 pi r)
        deflection  = r sin(lambda) (phi_A - phi_B)                       of the thread, square to it
        torque on the spindle = -r (F_n sin(lambda) cos(beta) + s cos(lambda))
        thrust on the nut     =  F_n cos(lambda) cos(beta) - s sin(lambda)
        slip speed            = r cos(lambda) w_A + x' sin(lambda)        along the thread

    A friction law over speed is told the mesh speed, r sin(lambda) w: that is sin(lambda) cos(lambda) times the slip.
    Friction is that of the mesh: in proportion to the normal force, with stiction and in any law, and with
    it a screw may be self-locking (not driven by its nut where mu >= tan(lambda) cos(beta)). A nut with
    backlash has the elasticity `Backlash`. The radial load from the flank angle acts all round and cancels;
    the bearing force that a mesh reports from it does not apply.

    Parameters
    ----------
    mean_radius : float
        Mean radius of the thread [m].
    lead : float
        Travel per turn [m].
    flank_angle : float
        Half of the angle between the flanks, in the section normal to the thread [rad]; 0 for a square thread.

    References
    ----------
    R. G. Budynas, J. K. Nisbett, "Shigley's Mechanical Engineering Design", section 8-2.
    """

    mean_radius: Length
    lead: Length
    flank_angle: HelixAngle = 0.0

    sticks_by_mesh_speed: ClassVar[bool] = False  # it rubs along its slope

    def __post_init__(self) -> None:
        check(self)

    @property
    def lead_angle(self) -> Scalar:
        """Angle of the thread from the plane of rotation [rad]."""
        return ca.atan(self.lead / (2 * math.pi * self.mean_radius))

    @property
    def radius_a(self) -> Scalar:
        """Deflection of the thread per angle of the spindle [m]."""
        return self.mean_radius * ca.sin(self.lead_angle)

    @property
    def radius_b(self) -> Scalar:
        """Deflection per angle of the nut [m]; both turn the same way, as a wheel and a ring."""
        return -self.radius_a

    @property
    def working_angle(self) -> Scalar:
        """The flank angle [rad]."""
        return self.flank_angle

    @property
    def friction_factor(self) -> float:
        """Zero: friction acts all round the thread and pushes no axis aside."""
        return 0.0

    @property
    def friction_arm_a(self) -> Scalar:
        """Lever arm of the friction on the spindle [m]."""
        return self.mean_radius * ca.cos(self.lead_angle)

    @property
    def friction_arm_b(self) -> Scalar:
        """Lever arm of the friction on the nut, on its travel as an angle [m]."""
        return -self.radius_a * ca.tan(self.lead_angle)

    @property
    def base_helix_angle(self) -> float:
        """Zero; a thread has no base cylinder."""
        return 0.0

    @property
    def tooth_pitch(self) -> None:
        """None: a thread has no teeth that come and go."""
        return None

    def size(self) -> str:
        """Its lead."""
        return f"screw of lead {1e3 * self.lead:.4g} mm"
