"""Elasticity of the teeth: normal force as a function of mesh deformation, and of the gap between flanks."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import casadi as ca

from gear.motion import MeshMotion
from gear.quantities import Damping, Distance, Scalar, Stiffness, check

DEFLECTION_NOMINAL = 1e-6  # m; teeth under load bend by about a micrometer


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


def has_gap(law: ElasticityLaw) -> bool:
    """Whether flanks can lose contact: the law knows a penetration."""
    at_rest = MeshMotion(*(0.0 for _ in MeshMotion._fields))
    return law.penetration(at_rest, 1.0) is not None


@dataclass(frozen=True, kw_only=True)
class Linear:
    """Linear spring and damper.

        F_n = stiffness * deflection + damping * rate

    Parameters
    ----------
    stiffness : float
        Of the mesh, measured on the pitch circle [N/m].
    damping : float
        [N s/m].

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eq. (40).
    """

    stiffness: Stiffness
    damping: Damping

    def __post_init__(self) -> None:
        check(self)

    def spring(self, deflection: Scalar) -> Scalar:
        """Elastic force [N]."""
        return self.stiffness * deflection

    def damper(self, deflection: Scalar, rate: Scalar) -> Scalar:
        """Damping force [N]."""
        return self.damping * rate

    def energy(self, deflection: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.stiffness * deflection**2 / 2


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


@dataclass(frozen=True, kw_only=True)
class Backlash:
    """A gap between the flanks around any tooth spring; the teeth can push and cannot pull.

        x   = flank * deflection - gap/2                        penetration of the engaged flank
        F_n = flank * (spring(x) + damping limited to +-spring(x)),   zero in the gap

              F_n |        /
                  |       /         Limiting the damping to the spring force (so that the total stays
           -gap/2 |      /          between zero and twice the spring force) removes the jump at
        ----+-----+----+----        engagement and the pull at separation that a plain spring and
           /      |   gap/2         damper in a gap would show.
          /       |       deflection

    Parameters
    ----------
    gap : float
        TOTAL gap between the flanks, on the pitch circle [m].
    law : ToothSpring
        Elasticity of the engaged teeth.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eq. (42), for the gap;
    Modelica Standard Library, Rotational.Components.ElastoBacklash2, for the limited damping.
    """

    gap: Distance
    law: Linear

    def __post_init__(self) -> None:
        check(self)

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N] on the given flank; zero for flank 0.

        An engaged flank is one with penetration >= 0. The expression goes on below zero with the same slope,
        where no run comes, so that a search for an operating point finds its way back to contact.
        """
        penetration = self.penetration(motion, flank)
        spring = self.law.spring(penetration)
        limit = ca.fabs(spring)
        damper = self.law.damper(penetration, flank * motion.rate)
        return flank * (spring + ca.fmax(-limit, ca.fmin(limit, damper)))

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.law.energy(ca.fmax(self.penetration(motion, flank), 0))

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m]."""
        return flank * motion.deflection - self.gap / 2

    def nominal_force(self) -> Scalar:
        """Force [N] at one micrometer beyond the gap."""
        return self.law.spring(DEFLECTION_NOMINAL)
