"""What a mesh asks of its elasticity. A new law is a new file in this folder."""

from abc import abstractmethod
from typing import Protocol

import casadi as ca

from gear.motion import MeshMotion
from gear.quantities import Scalar
from gear.teeth.pair import Pair

DEFLECTION_NOMINAL = 1e-6  # m; teeth under load bend by about a micrometer
AT_REST = MeshMotion(
    deflection=0.0, rate=0.0, position=0.0, speed=0.0, turn_a=0.0, turn_b=0.0, speed_a=0.0, speed_b=0.0
)


class ElasticityLaw(Protocol):
    """What a mesh asks of its elasticity.

    The flank (+1: A pushes B towards positive travel, -1: the opposite flank, 0: in the gap) is a mode of
    the mesh; a law says the force on a given flank, and where flanks engage.
    """

    @abstractmethod
    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N], positive when A pushes B towards positive travel."""

    @abstractmethod
    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""

    @abstractmethod
    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m], negative in the gap.

        None (for every motion) where the teeth cannot lose contact.
        """

    @abstractmethod
    def force_scale(self) -> Scalar:
        """Size of a usual normal force [N], for scaling."""

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where the law has no meaning for the teeth of a pair."""


class ToothSpring(ElasticityLaw, Protocol):
    """Teeth in contact: odd functions of the deflection. Alone they act on both flanks; `Backlash` puts a gap around.

    F_n = spring(deflection) + damper(deflection, rate)
    """

    @abstractmethod
    def spring(self, deflection: Scalar) -> Scalar:
        """Elastic force [N]."""

    @abstractmethod
    def damper(self, deflection: Scalar, rate: Scalar) -> Scalar:
        """Damping force [N]."""

    @abstractmethod
    def energy(self, deflection: Scalar) -> Scalar:
        """Integral of `spring` over the deflection from zero [J]."""

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N]; the same expression on both flanks."""
        return self.spring(motion.deflection) + self.damper(motion.deflection, motion.rate)

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.energy(motion.deflection)

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """None: the teeth are always in contact."""
        return None

    def force_scale(self) -> Scalar:
        """Force [N] at a deflection of one micrometer."""
        return self.spring(DEFLECTION_NOMINAL)


def pushing(spring: Scalar, damper: Scalar) -> Scalar:
    """Force of a contact that cannot pull: the damping is limited to the size of the spring force."""
    limit = ca.fabs(spring)
    return spring + ca.fmax(-limit, ca.fmin(limit, damper))


def has_gap(law: ElasticityLaw) -> bool:
    """Whether flanks can lose contact: the law knows a penetration."""
    return law.penetration(AT_REST, 1.0) is not None
