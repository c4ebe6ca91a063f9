"""Backlash: a gap between the flanks, around any tooth spring."""

from dataclasses import dataclass
from typing import Annotated

import casadi as ca

from gear.elasticity.law import DEFLECTION_NOMINAL, ElasticityLaw, ToothSpring, pushing
from gear.elasticity.linear import Linear
from gear.motion import MeshMotion
from gear.quantities import Distance, Scalar, check
from gear.quantities.registry import part
from gear.quantities.roles import Gap


@part(ElasticityLaw)
@dataclass(frozen=True, kw_only=True)
class Backlash(ElasticityLaw):
    """A gap between the flanks around any tooth spring; the teeth can push and cannot pull.

        x   = flank * deflection - gap/2                        penetration of the engaged flank
        F_n = flank * (spring(x) + damping limited to +-spring(x)),   zero for flank 0, in the gap

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
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (42) and (43), for the gap;
    Modelica Standard Library, Rotational.Components.ElastoBacklash2, for the limited damping.
    """

    gap: Annotated[Distance, Gap()]
    law: ToothSpring

    @classmethod
    def examples(cls) -> "tuple[Backlash, ...]":
        """Around each of two springs."""
        return tuple(cls(gap=2e-5, law=law) for law in Linear.examples())

    def __post_init__(self) -> None:
        check(self)

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N] on the given flank; zero for flank 0.

        An engaged flank is one with penetration >= 0. The expression goes on below zero with the same slope,
        where no run comes, so that a search for an operating point finds its way back to contact.
        """
        penetration = self.penetration(motion, flank)
        return flank * pushing(self.law.spring(penetration), self.law.damper(penetration, flank * motion.rate))

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.law.energy(ca.fmax(self.penetration(motion, flank), 0))

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m]."""
        return flank * motion.deflection - self.gap / 2

    def force_scale(self) -> Scalar:
        """Force [N] at one micrometer beyond the gap."""
        return self.law.spring(DEFLECTION_NOMINAL)


@part(ElasticityLaw)
@dataclass(frozen=True, kw_only=True)
class BacklashAsPrinted(ElasticityLaw):
    """Backlash as the gear paper prints it: the whole damping force acts as long as the flanks overlap.

        x   = flank * deflection - gap/2                        penetration of the engaged flank
        F_n = flank * (spring(x) + damper(x, flank * rate)),   zero for flank 0, in the gap

    The force jumps by damping * |rate| where a flank engages, and pulls with damping * |rate| where it lets
    go. For comparison with the paper; `Backlash` does neither.

    Parameters
    ----------
    gap : float
        TOTAL gap between the flanks, on the pitch circle [m].
    law : ToothSpring
        Elasticity of the engaged teeth.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eqs. (42) and (43).
    """

    gap: Annotated[Distance, Gap()]
    law: ToothSpring

    @classmethod
    def examples(cls) -> "tuple[BacklashAsPrinted, ...]":
        """Around each of two springs."""
        return tuple(cls(gap=2e-5, law=law) for law in Linear.examples())

    def __post_init__(self) -> None:
        check(self)

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N] on the given flank, against it where the damping pulls; zero for flank 0."""
        penetration = self.penetration(motion, flank)
        return flank * (self.law.spring(penetration) + self.law.damper(penetration, flank * motion.rate))

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        return self.law.energy(ca.fmax(self.penetration(motion, flank), 0))

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m]."""
        return flank * motion.deflection - self.gap / 2

    def force_scale(self) -> Scalar:
        """Force [N] at one micrometer beyond the gap."""
        return self.law.spring(DEFLECTION_NOMINAL)
