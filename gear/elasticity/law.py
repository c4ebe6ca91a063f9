"""What a mesh asks of its elasticity, and what makes a law of a bare tooth spring."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import casadi as ca

from gear.motion import MeshMotion
from gear.quantities import Scalar

DEFLECTION_NOMINAL = 1e-6  # m; teeth under load bend by about a micrometer
AT_REST = MeshMotion(
    deflection=0.0, rate=0.0, position=0.0, speed=0.0, turn_a=0.0, turn_b=0.0, speed_a=0.0, speed_b=0.0
)


class ToothSpring(Protocol):
    """Teeth in contact: odd functions of the deflection, without a gap. `Backlash` puts a gap around one."""

    def spring(self, deflection: Scalar) -> Scalar:
        """Elastic force [N]."""
        ...

    def damper(self, deflection: Scalar, rate: Scalar) -> Scalar:
        """Damping force [N]."""
        ...

    def energy(self, deflection: Scalar) -> Scalar:
        """Integral of `spring` over the deflection from zero [J]."""
        ...


@runtime_checkable
class ElasticityLaw(Protocol):
    """What a mesh asks of its elasticity.

    The flank (+1: A pushes B towards positive travel, -1: the opposite flank, 0: in the gap) is a mode of
    the mesh; a law says the force on a given flank, and where flanks engage.
    """

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N], positive when A pushes B towards positive travel."""
        ...

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        ...

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m], negative in the gap.

        None (for every motion) where the teeth cannot lose contact.
        """
        ...

    def nominal_force(self) -> Scalar:
        """Size of a usual normal force [N], for scaling."""
        ...


def pushing(spring: Scalar, damper: Scalar) -> Scalar:
    """Force of a contact that cannot pull: the damping is limited to the size of the spring force."""
    limit = ca.fabs(spring)
    return spring + ca.fmax(-limit, ca.fmin(limit, damper))


def has_gap(law: ElasticityLaw) -> bool:
    """Whether flanks can lose contact: the law knows a penetration."""
    return law.penetration(AT_REST, 1.0) is not None


@dataclass(frozen=True, kw_only=True)
class Gapless:
    """A tooth spring on both flanks: what a mesh makes of one that is given without a gap.

    F_n = spring(deflection) + damper(deflection, rate)
    """

    law: ToothSpring

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N]; the same expression on both flanks."""
        return self.law.spring(motion.deflection) + self.law.damper(motion.deflection, motion.rate)

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.law.energy(motion.deflection)

    def penetration(self, motion: MeshMotion, flank: Scalar) -> None:
        """None: the teeth are always in contact."""
        return None

    def nominal_force(self) -> Scalar:
        """Force [N] at a deflection of one micrometer."""
        return self.law.spring(DEFLECTION_NOMINAL)


def as_law(elasticity: ToothSpring | ElasticityLaw) -> ElasticityLaw:
    """The law of a whole mesh; a bare tooth spring acts on both flanks."""
    return elasticity if isinstance(elasticity, ElasticityLaw) else Gapless(law=elasticity)
