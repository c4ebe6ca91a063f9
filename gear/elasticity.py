"""Elasticity of the teeth: normal force as a function of mesh deformation, and of the gap between flanks."""

from dataclasses import dataclass
from typing import Protocol

import casadi as ca

from gear.quantities import Damping, Distance, Scalar, Stiffness, check

DEFLECTION_NOMINAL = 1e-6  # m; teeth under load bend by about a micrometer


class ToothSpring(Protocol):
    """An elastic tooth contact without gap; `Backlash` wraps one."""

    def spring(self, deflection: Scalar) -> Scalar:
        """Elastic force [N]."""
        ...

    def damper(self, deflection: Scalar, rate: Scalar) -> Scalar:
        """Damping force [N]."""
        ...

    def energy(self, deflection: Scalar) -> Scalar:
        """Work [J/m per m of travel] stored by `spring`, its integral from zero."""
        ...


class ElasticityLaw(Protocol):
    """What a mesh asks of its elasticity.

    The flank (+1: A pushes B towards positive travel, -1: the opposite flank, 0: in the gap) is a mode of
    the mesh; a law says the force on a given flank and, by its gap, where flanks engage.
    """

    def force(self, deflection: Scalar, rate: Scalar, flank: Scalar) -> Scalar:
        """Normal force [N], positive when A pushes B towards positive travel."""
        ...

    def energy(self, deflection: Scalar, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        ...

    @property
    def total_gap(self) -> Scalar | None:
        """Total gap between the flanks [m], or None for a law without one."""
        ...

    @property
    def nominal_force(self) -> Scalar:
        """Size of a usual normal force [N], for scaling."""
        ...


@dataclass(frozen=True, kw_only=True)
class Linear:
    """Linear spring and damper, on both flanks, without a gap.

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

    def force(self, deflection: Scalar, rate: Scalar, flank: Scalar) -> Scalar:
        """Normal force [N]; the same expression on both flanks."""
        return self.spring(deflection) + self.damper(deflection, rate)

    def energy(self, deflection: Scalar, flank: Scalar = 1.0) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.stiffness * deflection**2 / 2

    @property
    def total_gap(self) -> None:
        """None: the teeth are always in contact."""
        return None

    @property
    def nominal_force(self) -> Scalar:
        """Force [N] at a deflection of one micrometer."""
        return self.stiffness * DEFLECTION_NOMINAL


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

    def force(self, deflection: Scalar, rate: Scalar, flank: Scalar) -> Scalar:
        """Normal force [N] on the given flank; zero for flank 0.

        An engaged flank is one with penetration >= 0. The expression goes on below zero with the same slope,
        where no run comes, so that a search for an operating point finds its way back to contact.
        """
        penetration = flank * deflection - self.gap / 2
        spring = self.law.spring(penetration)
        limit = ca.fabs(spring)
        damper = self.law.damper(penetration, flank * rate)
        return flank * (spring + ca.fmax(-limit, ca.fmin(limit, damper)))

    def energy(self, deflection: Scalar, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.law.energy(ca.fmax(flank * deflection - self.gap / 2, 0))

    @property
    def total_gap(self) -> Scalar:
        """Total gap [m]."""
        return self.gap

    @property
    def nominal_force(self) -> Scalar:
        """Force [N] at one micrometer beyond the gap."""
        return self.law.nominal_force
