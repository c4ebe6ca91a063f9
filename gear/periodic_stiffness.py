"""Stiffness that changes with the position of the teeth, on top of any other law."""

import math
from dataclasses import dataclass

import casadi as ca

from gear.backlash import Backlash, BacklashAsPrinted, Teeth
from gear.elastic_law import as_law
from gear.geometry import ExternalPair
from gear.internal import InternalPair
from gear.motion import MeshMotion
from gear.periodic_friction import Harmonic
from gear.quantities import Length, Scalar, check

SAMPLES = 1000  # of a period, per harmonic; between them the factor is off by less than 5e-6 of its amplitudes
SOFTEST = 0.01  # factor; teeth in contact are never that soft, and zero would leave them without a force


@dataclass(frozen=True, kw_only=True)
class PeriodicStiffness:
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
    law : Linear, ProgressiveISO, ProgressiveNiemann, Backlash or BacklashAsPrinted
        The mean over a tooth.
    pitch : float
        Feed per tooth on the pitch circles [m].
    harmonics : tuple of Harmonic
        First, second, ... over one tooth. Its numbers stay constants of a model; they are not parameters.

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

    law: Teeth | Backlash | BacklashAsPrinted
    pitch: Length
    harmonics: tuple[Harmonic, ...]

    def __post_init__(self) -> None:
        check(self)
        count = max(SAMPLES * len(self.harmonics), 1)
        lowest = min(self.factor(self.pitch * k / count) for k in range(count))
        if lowest < SOFTEST:
            raise ValueError(
                f"PeriodicStiffness.harmonics must leave a factor >= {SOFTEST:g} everywhere, got {lowest:.4g} at its "
                "lowest; reduce the amplitudes"
            )

    @classmethod
    def per_tooth(
        cls,
        pair: ExternalPair | InternalPair,
        law: Teeth | Backlash | BacklashAsPrinted,
        harmonics: tuple[Harmonic, ...],
    ) -> "PeriodicStiffness":
        """With the pitch of a pair."""
        return cls(law=law, pitch=2 * math.pi * pair.radius_a / pair.teeth_a, harmonics=harmonics)

    def factor(self, position: Scalar) -> Scalar:
        """Factor [-] at a feed [m]."""
        result = 1.0
        for k, harmonic in enumerate(self.harmonics, start=1):
            angle = 2 * math.pi * k * position / self.pitch
            result = result + harmonic.cosine * ca.cos(angle) + harmonic.sine * ca.sin(angle)
        return result

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N], positive when A pushes B towards positive travel."""
        return self.factor(motion.position) * as_law(self.law).force(motion, flank)

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection, at the present position [J]."""
        return self.factor(motion.position) * as_law(self.law).stored(motion, flank)

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m]; None without a gap."""
        return as_law(self.law).penetration(motion, flank)

    def nominal_force(self) -> Scalar:
        """Size of a usual normal force [N], that of the law."""
        return as_law(self.law).nominal_force()
