"""Progressive teeth: the stiffness grows until roughness and form errors are pressed flat."""

from dataclasses import dataclass

import casadi as ca

from gear.elasticity.law import ToothSpring
from gear.quantities import Damping, Force, Length, Part, Scalar, Stiffness, check
from gear.quantities.registry import part


@part(ToothSpring)
@dataclass(frozen=True, kw_only=True)
class ProgressiveISO(ToothSpring):
    """Stiffness that grows with the deflection up to the roughness; the law the gear paper names after ISO 6336-1.

        F_n = stiffness / (2 roughness) * deflection^2 * sign(deflection)              |deflection| <= roughness
        F_n = stiffness * (|deflection| - roughness/2) * sign(deflection)              beyond

        and damping * rate in both.

              F_n |      /
                  |     /        slope `stiffness`, as if the teeth began half a roughness later
                  |    /
            ------+--.------
                  |  roughness

    Parameters
    ----------
    stiffness : float
        Beyond the roughness, of the mesh, measured on the pitch circle [N/m].
    damping : float
        [N s/m].
    roughness : float
        R_q of the flanks in contact [m].

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eq. (41), whose outer branch is printed
    with + roughness/2: it would jump by stiffness * roughness where the branches meet.
    """

    stiffness: Stiffness
    damping: Damping
    roughness: Length

    @classmethod
    def examples(cls) -> "tuple[ProgressiveISO, ...]":
        """Rough flanks."""
        return (cls(stiffness=2e8, damping=2e3, roughness=5e-6),)

    def __post_init__(self) -> None:
        check(self)

    def spring(self, deflection: Scalar) -> Scalar:
        """Elastic force [N]."""
        rough = ca.fmax(-self.roughness, ca.fmin(self.roughness, deflection))
        return self.stiffness * (rough * ca.fabs(rough) / (2 * self.roughness) + deflection - rough)

    def damper(self, deflection: Scalar, rate: Scalar) -> Scalar:
        """Damping force [N]."""
        return self.damping * rate

    def energy(self, deflection: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        size = ca.fabs(deflection)
        rough = ca.fmin(size, self.roughness)
        beyond = size - rough
        return self.stiffness * (rough**3 / (6 * self.roughness) + (rough + beyond) * beyond / 2)


@part(ToothSpring)
@dataclass(frozen=True, kw_only=True)
class ProgressiveNiemann(ToothSpring):
    """Stiffness that grows with the force up to a nominal one; for what the gear paper names after Niemann and Winter.

        dF_n/d(deflection) = stiffness * (initial + (1 - initial) |F_n| / nominal_force)     |F_n| <= nominal_force
                           = stiffness                                                       beyond

    Integrated from zero, with k = (1 - initial) * stiffness / nominal_force and x = ln(1/initial) / k,

        F_n = nominal_force * initial/(1 - initial) * (exp(k |deflection|) - 1) * sign(deflection)   |deflection| <= x
        F_n = (nominal_force + stiffness * (|deflection| - x)) * sign(deflection)                    beyond

        and damping * rate in both.

    What is assumed: the paper prints no equation for this law and says only that the stiffness of its
    simulation model rises linearly with the load. That sentence is the law here; the book was not consulted.
    Where it ends is taken from DIN 3990-1 and ISO 6336-1 (method B): there the tooth stiffness is constant above
    a line load of 100 N/mm, and falls with the fourth root of the load below. With `initial` as it is if not
    given, both deflect alike at 100 N/mm (the standards' stiffness read as the slope, 4/3 nominal_force/stiffness).

    Parameters
    ----------
    stiffness : float
        At the nominal force and beyond, of the mesh, measured on the pitch circle [N/m]. Niemann and Winter
        suggest 20 N/um per mm of effective width (as the gear paper quotes their chapter 21.5).
    nominal_force : float
        Normal force from which on the stiffness is constant [N]; 100 N/mm times the effective width.
    damping : float
        [N s/m].
    initial : float
        Stiffness without load, as a part of `stiffness` [-], between 0 and 1.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", figures 7 and 12.
    """

    stiffness: Stiffness
    nominal_force: Force
    damping: Damping
    initial: Part = 0.546

    @classmethod
    def examples(cls) -> "tuple[ProgressiveNiemann, ...]":
        """Ten millimeters wide, nearly."""
        return (cls(stiffness=2e8, nominal_force=1e3, damping=2e3),)

    def __post_init__(self) -> None:
        check(self)

    def growth(self) -> Scalar:
        """Stiffness gained per force, k [1/m]."""
        return (1 - self.initial) * self.stiffness / self.nominal_force

    def nominal_deflection(self) -> Scalar:
        """Deflection at the nominal force, x [m]."""
        return -ca.log(self.initial) / self.growth()

    def spring(self, deflection: Scalar) -> Scalar:
        """Elastic force [N]."""
        k, x = self.growth(), self.nominal_deflection()
        growing = ca.fmax(-x, ca.fmin(x, deflection))
        # exp(u) - 1 = 2 exp(u/2) sinh(u/2), which is odd as it stands when the first u is |u|
        odd = 2 * ca.exp(k * ca.fabs(growing) / 2) * ca.sinh(k * growing / 2)
        return self.initial * self.stiffness / k * odd + self.stiffness * (deflection - growing)

    def damper(self, deflection: Scalar, rate: Scalar) -> Scalar:
        """Damping force [N]."""
        return self.damping * rate

    def energy(self, deflection: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection [J]."""
        k, size = self.growth(), ca.fabs(deflection)
        growing = ca.fmin(size, self.nominal_deflection())
        beyond = size - growing
        rising = 2 * ca.exp(k * growing / 2) * ca.sinh(k * growing / 2)
        return (
            self.initial * self.stiffness / k * (rising / k - growing)
            + self.nominal_force * beyond
            + self.stiffness * beyond**2 / 2
        )
