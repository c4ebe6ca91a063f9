"""Stiffness that changes with the position of the teeth, on top of any other law."""

from dataclasses import dataclass

from gear.elasticity.backlash import Backlash
from gear.elasticity.law import ElasticityLaw
from gear.elasticity.linear import Linear
from gear.harmonics import Harmonic, lowest_factor, pitch_of, tooth_factor
from gear.motion import MeshMotion
from gear.quantities import Length, Scalar, check
from gear.quantities.registry import part
from gear.teeth.pair import Pair

SOFTEST = 0.01  # factor; teeth in contact are never that soft, and zero would leave them without a force


@part(ElasticityLaw)
@dataclass(frozen=True, kw_only=True)
class PeriodicStiffness(ElasticityLaw):
    """Any law of elasticity times a factor that repeats with every tooth, as more and fewer pairs share the load.

        F_n = law * factor(x),     factor = 1 + sum_k (cosine_k cos(2 pi k x/pitch) + sine_k sin(2 pi k x/pitch))

    x is the feed through the pitch point, measured on the pitch circles: there the teeth repeat after
    2 pi r_A / z_A (pi times the module of a spur pair without shift), which is the base pitch over cos(alpha).

    Spring and damper are multiplied alike, so teeth that cannot pull still cannot. So is the stored energy: at
    one position the force is still its derivative over the deflection. Over the position the factor is a
    forcing, parametric excitation: it does the work stored * factor'/factor on the mesh as the teeth move on,
    and takes no torque from the wheels for it. That torque would be smaller than that of the teeth by about
    deflection / pitch, and its work at constant deflection is zero over a tooth.

    Parameters
    ----------
    law : ElasticityLaw
        The mean over a tooth.
    harmonics : tuple of Harmonic
        First, second, ... over one tooth. Its numbers stay constants of a model; they are not parameters.
    pitch : float or None
        Feed per tooth on the pitch circles [m]; None for that of the pair of the mesh.

    Raises
    ------
    ValueError
        Where the factor does not stay above 0.01.

    References
    ----------
    F. L. J. van der Linden, "Modeling of geared positioning systems", which lists a position dependent spring and
    damper among its laws.
    S. Oh, K. Grosh, J. R. Barber, "Energy conserving equations of motion for gear systems", J. Vib. Acoust. 2005,
    doi 10.1115/1.1891815, for the torque that is left out.
    """

    law: ElasticityLaw
    harmonics: tuple[Harmonic, ...]
    pitch: Length | None = None

    @classmethod
    def examples(cls) -> "tuple[PeriodicStiffness, ...]":
        """Around a spring, and around a gap."""
        return tuple(
            cls(law=law, harmonics=(Harmonic(cosine=0.3),)) for law in (*Linear.examples(), *Backlash.examples())
        )

    def __post_init__(self) -> None:
        check(self)
        lowest, _ = lowest_factor(self.harmonics)
        if lowest < SOFTEST:
            raise ValueError(
                f"PeriodicStiffness.harmonics must leave a factor >= {SOFTEST:g} everywhere, got {lowest:.4g} at its "
                "lowest; reduce the amplitudes"
            )

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where neither the law nor a pair says the pitch."""
        pitch_of(self, pair)
        self.law.require_pair(pair)

    def factor(self, position: Scalar, pair: Pair | None = None) -> Scalar:
        """Factor [-] at a feed [m]."""
        return tooth_factor(self.harmonics, position / pitch_of(self, pair))

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N], positive when A pushes B towards positive travel."""
        return self.factor(motion.position, motion.pair) * self.law.force(motion, flank)

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection, at the present position [J]."""
        return self.factor(motion.position, motion.pair) * self.law.stored(motion, flank)

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m]; None without a gap."""
        return self.law.penetration(motion, flank)

    def force_scale(self) -> Scalar:
        """Size of a usual normal force [N], that of the law."""
        return self.law.force_scale()
