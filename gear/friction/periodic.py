"""Friction that changes with the position of the teeth, on top of any other law."""

from dataclasses import dataclass

from gear.friction.at_viscosity import AtViscosity
from gear.friction.coulomb import Coulomb
from gear.friction.din3990 import Din3990
from gear.friction.over_speed import FrictionTable, Stribeck
from gear.friction.tabulated_efficiency import TabulatedEfficiency
from gear.harmonics import Harmonic, lowest_factor, pitch_of, tooth_factor
from gear.motion import Sliding
from gear.quantities import Length, Scalar, check
from gear.teeth.geometry import Pair

UniformFriction = Coulomb | Din3990 | TabulatedEfficiency | Stribeck | FrictionTable | AtViscosity


@dataclass(frozen=True, kw_only=True)
class PeriodicFriction:
    """Any law of friction times a factor that repeats with every tooth.

        mu = law * factor(x),     factor = 1 + sum_k (cosine_k cos(2 pi k x/pitch) + sine_k sin(2 pi k x/pitch))

    for sliding and at rest alike, so that breakaway stays above sliding. x is the feed through the pitch point,
    measured on the pitch circles: there the teeth repeat after 2 pi r_A / z_A (pi times the module of
    a spur pair without shift), which is the base pitch over cos(alpha).

    Parameters
    ----------
    law : Coulomb, Din3990, TabulatedEfficiency, Stribeck, FrictionTable or AtViscosity
        The mean over a tooth.
    harmonics : tuple of Harmonic
        First, second, ... over one tooth. Its numbers stay constants of a model; they are not parameters.
    pitch : float or None
        Feed per tooth on the pitch circles [m]; None for that of the pair of the mesh.

    Raises
    ------
    ValueError
        Where the factor is not positive everywhere.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", section "Friction models".
    """

    law: UniformFriction
    harmonics: tuple[Harmonic, ...]
    pitch: Length | None = None

    def __post_init__(self) -> None:
        check(self)
        lowest, slack = lowest_factor(self.harmonics)
        if lowest - slack <= 0:
            raise ValueError(
                f"PeriodicFriction.harmonics must leave a factor > 0 everywhere, got {lowest:.4g} at its lowest"
            )

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where neither the law nor a pair says the pitch."""
        pitch_of(self, pair)

    def factor(self, position: Scalar, pair: Pair | None = None) -> Scalar:
        """Factor [-] at a feed [m]."""
        return tooth_factor(self.harmonics, position / pitch_of(self, pair))

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        return self.factor(sliding.position, sliding.pair) * self.law.coefficient(sliding)

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.factor(sliding.position, sliding.pair) * self.law.breakaway(sliding)
