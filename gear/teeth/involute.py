"""Involute wheels at work: from numbers of teeth and a basic rack to radii, angles and the path of contact.

One set of formulas serves external and internal pairs. What belongs to a ring gear B is negative: its number of
teeth, its radii, and with them the length T1 T2 of the line of action.
"""

import math
from typing import NamedTuple

import casadi as ca

from gear.quantities import Scalar

NEWTON_STEPS = 8  # leave nothing but rounding where the working pressure angle is not below the lowest
LOWEST_ANGLE = math.radians(10.0)


def involute(angle: Scalar) -> Scalar:
    """inv(angle) = tan(angle) - angle [rad]."""
    return ca.tan(angle) - angle


class Rack(NamedTuple):
    """The basic rack of both wheels, in the section normal to the teeth."""

    module: Scalar  # m
    pressure_angle: Scalar  # rad
    helix_angle: Scalar  # rad

    @property
    def transverse_module(self) -> Scalar:
        """Module [m] in the plane of the wheels."""
        return self.module / ca.cos(self.helix_angle)

    @property
    def transverse_angle(self) -> Scalar:
        """Pressure angle [rad] in the plane of the wheels, at the reference circles."""
        return ca.atan(ca.tan(self.pressure_angle) / ca.cos(self.helix_angle))


class Teeth(NamedTuple):
    """The teeth of one wheel."""

    count: int  # negative on a ring
    shift: Scalar  # profile shift, in modules
    addendum: Scalar  # in modules
    tip_radius: Scalar | None  # m, negative on a ring; instead of the addendum

    def reference_radius(self, rack: Rack) -> Scalar:
        """Radius [m] on which the rack rolled when the teeth were cut."""
        return rack.transverse_module * self.count / 2

    def half_thickness(self, rack: Rack, angle: Scalar) -> Scalar:
        """Half the angle [rad] that a tooth takes on the circle where the pressure angle is `angle`; signed."""
        cut = (math.pi / 2 + 2 * self.shift * ca.tan(rack.pressure_angle)) / self.count
        return cut + involute(rack.transverse_angle) - involute(angle)


class Path(NamedTuple):
    """The path of contact, as distances [m] along the line of action from base tangent point T1 of wheel A.

    Sliding changes its sign at the pitch point. Averaged over the path with constant normal force, the friction
    of a tooth pair is one force scalar acting along three constants:

        d_F    = (2 T1P - T1A - T1B) / (T1B - T1A)
        d_tauA = (2 T1P^2 - T1A^2 - T1B^2) / (2 (T1B - T1A))
        d_tauB = (2 T2P^2 - T2A^2 - T2B^2) / (2 (T2B - T2A)),   T2X = T1T2 - T1X
    """

    length: Scalar  # T1 to T2; negative for a ring, whose T2 lies on the other side of T1
    pitch: Scalar  # T1 to the pitch point P
    start: Scalar  # T1 to A, where the tip circle of B crosses
    end: Scalar  # T1 to B, where the tip circle of A crosses

    @property
    def friction_factor(self) -> Scalar:
        """d_F [-]."""
        return (2 * self.pitch - self.start - self.end) / (self.end - self.start)

    @property
    def friction_arm_a(self) -> Scalar:
        """-d_tauA [m]."""
        return -(2 * self.pitch**2 - self.start**2 - self.end**2) / (2 * (self.end - self.start))

    @property
    def friction_arm_b(self) -> Scalar:
        """d_tauB [m]."""
        pitch, start, end = (self.length - distance for distance in self[1:])
        return (2 * pitch**2 - start**2 - end**2) / (2 * (end - start))


class Gearing(NamedTuple):
    """Two wheels at the center distance at which they run without backlash."""

    rack: Rack
    a: Teeth
    b: Teeth
    radius_a: Scalar  # working pitch radii [m]
    radius_b: Scalar
    tip_a: Scalar  # tip radii [m]
    tip_b: Scalar
    angle: Scalar  # working transverse pressure angle [rad]

    @property
    def center_distance(self) -> Scalar:
        """Distance [m] of the axes; positive for a ring, too."""
        return ca.fabs(self.radius_a + self.radius_b)

    @property
    def base_a(self) -> Scalar:
        """Base radius [m] of wheel A."""
        return self.radius_a * ca.cos(self.angle)

    @property
    def base_b(self) -> Scalar:
        """Base radius [m] of wheel B, negative for a ring."""
        return self.radius_b * ca.cos(self.angle)

    @property
    def pitch(self) -> Scalar:
        """Travel [m] on the pitch circles from tooth to tooth."""
        return 2 * math.pi * self.radius_a / self.a.count

    @property
    def base_pitch(self) -> Scalar:
        """Distance [m] of neighboring tooth pairs along the line of action."""
        return self.pitch * ca.cos(self.angle)

    @property
    def thickness_a(self) -> Scalar:
        """Thickness [m] of the teeth of wheel A on the working pitch circle; those of B fill the rest of the pitch."""
        return 2 * self.radius_a * self.a.half_thickness(self.rack, self.angle)

    @property
    def base_helix_angle(self) -> Scalar:
        """Helix angle [rad] on the base cylinders."""
        return ca.asin(ca.sin(self.rack.helix_angle) * ca.cos(self.rack.pressure_angle))

    def path(self) -> Path:
        """Path of contact from the tip circle of B to the tip circle of A."""
        length = (self.radius_a + self.radius_b) * ca.sin(self.angle)
        side = 1 if self.b.count > 0 else -1
        return Path(
            length=length,
            pitch=self.radius_a * ca.sin(self.angle),
            start=length - side * ca.sqrt(self.tip_b**2 - self.base_b**2),
            end=ca.sqrt(self.tip_a**2 - self.base_a**2),
        )

    def contact_ratio(self) -> Scalar:
        """Average number of tooth pairs in contact in one plane [-], the transverse contact ratio."""
        path = self.path()
        return (path.end - path.start) / self.base_pitch

    def overlap_ratio(self, face_width: Scalar) -> Scalar:
        """What helical teeth of a face width [m] add to the contact ratio [-]."""
        return face_width * ca.sin(self.rack.helix_angle) / (math.pi * self.rack.module)


def working_involute(rack: Rack, a: Teeth, b: Teeth) -> Scalar:
    """Involute [rad] of the working pressure angle: the profile shifts drive the wheels apart until none is in the way.

    inv(alpha_w) = inv(alpha_t) + 2 tan(alpha_n) (x_A + x_B) / (z_A + z_B)
    """
    return involute(rack.transverse_angle) + _opening(rack, a, b)


def _opening(rack: Rack, a: Teeth, b: Teeth) -> Scalar:
    return 2 * ca.tan(rack.pressure_angle) * (a.shift + b.shift) / (a.count + b.count)


def gearing(rack: Rack, a: Teeth, b: Teeth) -> Gearing:
    """Bring two wheels together until their backlash is zero.

    Newton's method solves the involute equation for t = tan(alpha_w), in the unknown change from tan(alpha_t): the
    function is convex in t, so the steps come down to the solution from above, and wheels without a shift are
    already there.

    Tips that are not given stand addendum + shift beyond the reference circle, less, on an external pair, the
    part of the shifts by which the centers do not move apart. This keeps the clearance that the rack has.
    """
    reference = ca.tan(rack.transverse_angle)
    tangent = reference
    for _ in range(NEWTON_STEPS):
        gap = (tangent - reference) - (ca.atan(tangent) - ca.atan(reference)) - _opening(rack, a, b)
        tangent = tangent - gap * (1 + tangent**2) / tangent**2
    stretch = ca.sqrt((1 + tangent**2) / (1 + reference**2))  # cos(alpha_t) / cos(alpha_w)
    radii = [teeth.reference_radius(rack) for teeth in (a, b)]
    excess = 0.0 if b.count < 0 else a.shift + b.shift - (stretch - 1) * (radii[0] + radii[1]) / rack.module
    tips = [
        radius + (teeth.addendum + teeth.shift - excess) * rack.module if teeth.tip_radius is None else teeth.tip_radius
        for radius, teeth in zip(radii, (a, b), strict=True)
    ]
    return Gearing(
        rack=rack,
        a=a,
        b=b,
        radius_a=radii[0] * stretch,
        radius_b=radii[1] * stretch,
        tip_a=tips[0],
        tip_b=tips[1],
        angle=ca.atan(tangent),
    )
