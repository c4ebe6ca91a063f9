"""Friction that changes with the position of the teeth, on top of any other law."""

from collections.abc import Sequence
from dataclasses import dataclass

from gear.friction.coulomb import Coulomb
from gear.friction.law import FrictionLaw
from gear.friction.lugre import LuGre
from gear.harmonics import Harmonic, lowest_factor, pitch_of, tooth_factor
from gear.motion import Sliding
from gear.quantities import Length, Memory, Scalar, check
from gear.quantities.registry import part
from gear.teeth.pair import Pair


@part(FrictionLaw)
@dataclass(frozen=True, kw_only=True)
class PeriodicFriction(FrictionLaw):
    """Any law of friction times a factor that repeats with every tooth.

        mu = law * factor(x),     factor = 1 + sum_k (cosine_k cos(2 pi k x/pitch) + sine_k sin(2 pi k x/pitch))

    for sliding and at rest alike, so that breakaway stays above sliding. x is the feed through the pitch point,
    measured on the pitch circles: there the teeth repeat after 2 pi r_A / z_A (pi times the module of
    a spur pair without shift), which is the base pitch over cos(alpha).

    Parameters
    ----------
    law : FrictionLaw
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

    law: FrictionLaw
    harmonics: tuple[Harmonic, ...]
    pitch: Length | None = None

    @classmethod
    def examples(cls) -> "tuple[PeriodicFriction, ...]":
        """Around a law that sticks, and around one that does not."""
        return tuple(
            cls(law=law, harmonics=(Harmonic(cosine=0.2),)) for law in (*Coulomb.examples(), *LuGre.examples())
        )

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
        self.law.require_pair(pair)

    def factor(self, position: Scalar, pair: Pair | None = None) -> Scalar:
        """Factor [-] at a feed [m]."""
        return tooth_factor(self.harmonics, position / pitch_of(self, pair))

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        return self.factor(sliding.position, sliding.pair) * self.law.coefficient(sliding)

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.factor(sliding.position, sliding.pair) * self.law.breakaway(sliding)

    @property
    def sticks(self) -> bool:
        """Whether the law does."""
        return self.law.sticks

    def memory(self) -> tuple[Memory, ...]:
        """The internal state of the law."""
        return self.law.memory()

    def friction(self, memory: Sequence[Scalar], sliding: Sliding) -> Scalar:
        """Friction over normal force [-], of a law that does not stick."""
        return self.factor(sliding.position, sliding.pair) * self.law.friction(memory, sliding)

    def rates(self, memory: Sequence[Scalar], sliding: Sliding) -> list[Scalar]:
        """Time derivative of the internal state of the law."""
        return self.law.rates(memory, sliding)
