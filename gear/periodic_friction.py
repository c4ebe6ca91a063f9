"""Friction that changes with the position of the teeth, on top of any other law."""

import math
from dataclasses import dataclass

import casadi as ca

from gear.coulomb import Coulomb
from gear.din3990 import Din3990
from gear.geometry import ExternalPair
from gear.internal import InternalPair
from gear.motion import Sliding
from gear.quantities import Length, Number, Scalar, check
from gear.tabulated_efficiency import TabulatedEfficiency
from gear.velocity_friction import FrictionTable, Stribeck
from gear.viscosity_friction import AtViscosity

SAMPLES = 1000  # of a period, per harmonic; between them the factor is off by less than 5e-6 of its amplitudes

UniformFriction = Coulomb | Din3990 | TabulatedEfficiency | Stribeck | FrictionTable | AtViscosity


@dataclass(frozen=True, kw_only=True)
class Harmonic:
    """Amplitudes of one harmonic.

    Parameters
    ----------
    cosine, sine : float
        [-], of the mean.
    """

    cosine: Number = 0.0
    sine: Number = 0.0

    def __post_init__(self) -> None:
        check(self)


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
    pitch : float
        Feed per tooth on the pitch circles [m].
    harmonics : tuple of Harmonic
        First, second, ... over one tooth. Its numbers stay constants of a model; they are not parameters.

    Raises
    ------
    ValueError
        Where the factor is not positive everywhere.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", section "Friction models".
    """

    law: UniformFriction
    pitch: Length
    harmonics: tuple[Harmonic, ...]

    def __post_init__(self) -> None:
        check(self)
        count = max(SAMPLES * len(self.harmonics), 1)
        lowest = min(self.factor(self.pitch * k / count) for k in range(count))
        # a minimum between two samples lies below both by less than h^2/8 times the largest second derivative
        bend = sum(
            (2 * math.pi * k / count) ** 2 * math.hypot(harmonic.cosine, harmonic.sine)
            for k, harmonic in enumerate(self.harmonics, start=1)
        )
        if lowest - bend / 8 <= 0:
            raise ValueError(
                f"PeriodicFriction.harmonics must leave a factor > 0 everywhere, got {lowest:.4g} at its lowest"
            )

    @classmethod
    def per_tooth(
        cls, pair: ExternalPair | InternalPair, law: UniformFriction, harmonics: tuple[Harmonic, ...]
    ) -> "PeriodicFriction":
        """With the pitch of a pair."""
        return cls(law=law, pitch=2 * math.pi * pair.radius_a / pair.teeth_a, harmonics=harmonics)

    def factor(self, position: Scalar) -> Scalar:
        """Factor [-] at a feed [m]."""
        result = 1.0
        for k, harmonic in enumerate(self.harmonics, start=1):
            angle = 2 * math.pi * k * position / self.pitch
            result = result + harmonic.cosine * ca.cos(angle) + harmonic.sine * ca.sin(angle)
        return result

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        return self.factor(sliding.position) * self.law.coefficient(sliding)

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.factor(sliding.position) * self.law.breakaway(sliding)
