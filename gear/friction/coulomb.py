"""Dry friction: one coefficient while sliding, one at rest."""

from dataclasses import dataclass
from typing import Annotated

from gear.friction.law import FrictionLaw, require_breakaway_above
from gear.motion import Sliding
from gear.quantities import Coefficient, Scalar, check
from gear.quantities.registry import part
from gear.quantities.roles import Breakaway, SlidingFriction


@part(FrictionLaw)
@dataclass(frozen=True, kw_only=True)
class Coulomb(FrictionLaw):
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

    sliding: Annotated[Coefficient, SlidingFriction()]
    static: Annotated[Coefficient, Breakaway(floor="sliding")]

    @classmethod
    def examples(cls) -> "tuple[Coulomb, ...]":
        """With stiction and without."""
        return (cls(sliding=0.1, static=0.15), cls(sliding=0.1, static=0.1))

    def __post_init__(self) -> None:
        check(self)
        require_breakaway_above("Coulomb", ("sliding", self.sliding), ("static", self.static))

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-], the same everywhere."""
        return self.sliding

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.static
