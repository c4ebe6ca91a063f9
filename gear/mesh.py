"""A gear mesh: three terminals (wheel A, wheel B, carrier), elastic, with friction that sticks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import casadi as ca

from gear.elasticity.law import ElasticityLaw
from gear.friction.law import FrictionLaw
from gear.motion import MeshMotion
from gear.quantities import Scalar, check_count, show
from gear.teeth.pair import Pair

MESH_SPEED_NOMINAL = 1e-2  # m/s


class BearingForce(NamedTuple):
    """Planar force [N] of a mesh on wheel B; on wheel A it is the opposite. x runs from A to the pitch point.

    That is toward the center of an external wheel B. The center of a ring lies the other way.
    """

    x: float  # along the line of centers
    y: float  # perpendicular to it, positive to the left of x


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """The contact between two wheels, with angles counted counter-clockwise for both.

        x_A =  r_A (phi_A - phi_G)               travel of each wheel through the pitch point
        x_B = -r_B (phi_B - phi_G)
        deflection = x_A - x_B,   speed v = (x_A' + x_B')/2
        T_A = -F_n l_A - s e_A,   T_B = -F_n l_B + s e_B,   T_G = -(T_A + T_B)

    F_n comes from the elasticity law, s is the friction scalar; the mode says which law s follows:

        mode      s                              left when                       for
        STUCK     what keeps dv/dt = 0           static |F_n| - |s| falls to 0   FORWARD or BACKWARD
        FORWARD   +mu(v) |F_n|                   v falls to 0                    STUCK or BACKWARD
        BACKWARD  -mu(-v) |F_n|                  -v falls to 0                   STUCK or FORWARD
        FREE      0 (and F_n = 0, in the gap)    a flank engages                 one of the others

    Parameters
    ----------
    a, b : str
        Names of the shafts of wheel A and wheel B.
    carrier : str or None
        Name of the shaft that carries the line of centers; None for the housing.
    pair : Pair
        Radii and averaged friction arms.
    elasticity : ElasticityLaw or None
        Normal force from deflection and its rate; None for rigid teeth, a constraint.
    friction : FrictionLaw or None
        Friction coefficients; None for no losses. Rigid teeth have none: their normal force is not a law.
    count : int
        Equal meshes side by side that share the load (the planets of a set, lumped into one shaft).
    stick_by : "mesh speed" or "conjugate speed"
        The speed that friction opposes and that is zero while stuck: v as above, or
        u = e_A (phi_A' - phi_G') - e_B (phi_B' - phi_G'), for which friction never does positive work.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (1)-(11), (32)-(33), Table 2,
    with signs made consistent by energy and moment balance.
    """

    a: str
    b: str
    carrier: str | None = None
    pair: Pair
    elasticity: ElasticityLaw | None = None
    friction: FrictionLaw | None = None
    count: int = 1
    stick_by: Literal["mesh speed", "conjugate speed"] = "mesh speed"

    def __post_init__(self) -> None:
        if self.a == self.b or self.carrier in (self.a, self.b):
            raise ValueError(
                f"Mesh needs three different shafts, got a={self.a!r}, b={self.b!r}, carrier={self.carrier!r}"
            )
        if self.friction is not None and self.elasticity is None:
            raise ValueError(
                "Mesh.friction needs the normal force of an elasticity; give one, or leave the friction out"
            )
        if self.friction is not None and self._sliding() == 0:
            raise ValueError(
                "Mesh.friction cannot act: with friction arms of "
                f"{show(self.pair.friction_arm_a, 'm')} and {show(self.pair.friction_arm_b, 'm')} its pair does not "
                "slide as it rolls; give it other arms, or leave the friction out"
            )
        for law in (self.friction, self.elasticity):
            if law is not None:
                law.require_pair(self.pair)
        check_count(self, "count")
        if self.stick_by not in ("mesh speed", "conjugate speed"):
            raise ValueError(f'Mesh.stick_by must be "mesh speed" or "conjugate speed", got {self.stick_by!r}')
        if not self.pair.sticks_by_mesh_speed and self.stick_by == "mesh speed":
            raise ValueError(
                f'Mesh.stick_by must be "conjugate speed" for a {type(self.pair).__name__}, got "mesh speed"; it rubs '
                "along its slope"
            )

    @property
    def rigid(self) -> bool:
        """Whether the teeth are a constraint and not a spring."""
        return self.elasticity is None

    def law(self) -> ElasticityLaw:
        """The elasticity; rigid teeth have none."""
        if self.elasticity is None:
            raise ValueError("rigid teeth have no law of elasticity: their normal force is that of a constraint")
        return self.elasticity

    def motion(self, angle: Mapping[str, Scalar], speed: Mapping[str, Scalar]) -> MeshMotion:
        """Position and motion of the mesh from the angles [rad] and speeds [rad/s] of the shafts."""
        turn, spin = (0.0, 0.0) if self.carrier is None else (angle[self.carrier], speed[self.carrier])
        turn_a, turn_b = angle[self.a] - turn, angle[self.b] - turn
        speed_a, speed_b = speed[self.a] - spin, speed[self.b] - spin
        r_a, r_b = self.pair.radius_a, self.pair.radius_b
        return MeshMotion(
            deflection=r_a * turn_a + r_b * turn_b,
            rate=r_a * speed_a + r_b * speed_b,
            position=(r_a * turn_a - r_b * turn_b) / 2,
            speed=(r_a * speed_a - r_b * speed_b) / 2,
            turn_a=turn_a,
            turn_b=turn_b,
            speed_a=speed_a,
            speed_b=speed_b,
            pair=self.pair,
        )

    def terminals(self) -> dict[str, str]:
        """Names of shafts, by the field that names them."""
        return {"a": self.a, "b": self.b} | ({} if self.carrier is None else {"carrier": self.carrier})

    def _per_shaft(self, a: Scalar, b: Scalar) -> dict[str, Scalar]:
        """Coefficients on the absolute motion of the shafts, from those on the motion relative to the carrier."""
        return {self.a: a, self.b: b} | ({} if self.carrier is None else {self.carrier: -(a + b)})

    def deflection_per_shaft(self) -> dict[str, Scalar]:
        """Deflection [m] per angle [rad] of each shaft."""
        return self._per_shaft(self.pair.radius_a, self.pair.radius_b)

    def slip_per_shaft(self) -> dict[str, Scalar]:
        """Speed that friction opposes [m/s] per speed [rad/s] of each shaft, by `stick_by`."""
        if self.stick_by == "conjugate speed":
            return self._per_shaft(self.pair.friction_arm_a, -self.pair.friction_arm_b)
        return self._per_shaft(self.pair.radius_a / 2, -self.pair.radius_b / 2)

    def _sliding(self) -> Scalar:
        """Conjugate speed per mesh speed [-] of wheels that roll together: the mean sliding of their teeth."""
        return self.pair.friction_arm_a / self.pair.radius_a + self.pair.friction_arm_b / self.pair.radius_b

    def speed_per_slip(self) -> Scalar:
        """Mesh speed per slip speed [-] of wheels that roll together, for laws of friction over the mesh speed."""
        return 1 / ca.fabs(self._sliding()) if self.stick_by == "conjugate speed" else 1.0

    def torque_per_normal(self) -> dict[str, Scalar]:
        """Torque [N m] on each shaft per normal force [N]: the base radii, T_A = -F_n l_A, T_B = -F_n l_B."""
        cosine = ca.cos(self.pair.working_angle)
        return self._per_shaft(-self.pair.radius_a * cosine, -self.pair.radius_b * cosine)

    def torque_per_friction(self) -> dict[str, Scalar]:
        """Torque [N m] on each shaft per friction scalar [N]: T_A = -s e_A, T_B = +s e_B."""
        return self._per_shaft(-self.pair.friction_arm_a, self.pair.friction_arm_b)

    def bearing_force(self, normal: Scalar, friction: Scalar, flank: Scalar) -> BearingForce:
        """Planar load [N] on the bearing of wheel B from signed normal force and friction scalar.

            F_B = |F_n| (sin alpha, flank cos alpha) + s d_F (flank cos alpha, -sin alpha)

        Whichever flank is loaded, it pushes B away from A at the pitch point: the axes of external wheels apart,
        those of a ring and the wheel inside it together.
        """
        sine, cosine = ca.sin(self.pair.working_angle), ca.cos(self.pair.working_angle)
        tangential = friction * self.pair.friction_factor
        return BearingForce(
            x=flank * normal * sine + flank * tangential * cosine,
            y=normal * cosine - tangential * sine,
        )
