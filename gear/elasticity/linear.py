"""Teeth as a linear spring and damper."""

from dataclasses import dataclass

from gear.elasticity.law import ToothSpring
from gear.quantities import Damping, Scalar, Stiffness, check
from gear.quantities.registry import part


@part(ToothSpring)
@dataclass(frozen=True, kw_only=True)
class Linear(ToothSpring):
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

    @classmethod
    def examples(cls) -> "tuple[Linear, ...]":
        """Damped and undamped."""
        return (cls(stiffness=2e8, damping=2e5), cls(stiffness=1e8, damping=0.0))

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
