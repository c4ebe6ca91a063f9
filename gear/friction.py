"""Friction coefficients of a gear mesh as functions of mesh speed and normal force."""

from dataclasses import dataclass
from typing import Protocol

from gear.motion import Sliding
from gear.quantities import Coefficient, Scalar, check


class FrictionLaw(Protocol):
    """What a mesh asks of its friction law; the direction of motion is the mesh's business, not the law's."""

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        ...

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Largest coefficient [-] that holds the mesh at rest, at this force, position and driving side."""
        ...


@dataclass(frozen=True, kw_only=True)
class Coulomb:
    """Constant sliding friction with its own breakaway value.

        mu(v) = sliding for v > 0,    mu(0) = static

    Parameters
    ----------
    sliding, static : float
        Coefficients while sliding and at breakaway [-], sliding <= static. The other order has no
        consistent solution at breakaway (a contact that lets go would be held harder than before).

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", eq. (34).
    """

    sliding: Coefficient
    static: Coefficient

    def __post_init__(self) -> None:
        check(self)
        if self.static < self.sliding:
            raise ValueError(
                f"Coulomb needs sliding <= static, got sliding={self.sliding:g} and static={self.static:g}; "
                "a breakaway coefficient below the sliding one has no consistent motion at standstill"
            )

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-], the same everywhere."""
        return self.sliding

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.static
