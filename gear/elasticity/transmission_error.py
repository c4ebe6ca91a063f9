"""Static transmission error: what the wheels' own errors add to the deflection of their teeth."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import casadi as ca

from gear.elasticity.backlash import Backlash
from gear.elasticity.law import ElasticityLaw
from gear.elasticity.linear import Linear
from gear.motion import MeshMotion
from gear.quantities import Angle, Distance, Scalar, check, check_count
from gear.quantities.registry import part
from gear.teeth.pair import Pair


@dataclass(frozen=True, kw_only=True)
class ErrorHarmonic:
    """One Fourier term of the transmission error over the turn of a wheel.

        e = amplitude * cos(order * turn + phase)

    Parameters
    ----------
    wheel : "a" or "b"
        The wheel whose turn, relative to the carrier, drives the error.
    order : int
        Waves per turn: 1 for an eccentric wheel, its number of teeth for what every tooth repeats.
    amplitude : float
        On the pitch circle [m].
    phase : float
        [rad].
    """

    wheel: Literal["a", "b"]
    order: int
    amplitude: Distance
    phase: Angle = 0.0

    def __post_init__(self) -> None:
        check(self)
        check_count(self, "order")
        if self.wheel not in ("a", "b"):
            raise ValueError(f'ErrorHarmonic.wheel must be "a" or "b", got {self.wheel!r}')

    def error(self, motion: MeshMotion) -> Scalar:
        """Error [m]."""
        turn = motion.turn_a if self.wheel == "a" else motion.turn_b
        return self.amplitude * ca.cos(self.order * turn + self.phase)

    def rate(self, motion: MeshMotion) -> Scalar:
        """Its time derivative [m/s], by the speed of the wheel."""
        turn, speed = (motion.turn_a, motion.speed_a) if self.wheel == "a" else (motion.turn_b, motion.speed_b)
        return -self.amplitude * self.order * ca.sin(self.order * turn + self.phase) * speed


@part(ElasticityLaw)
@dataclass(frozen=True, kw_only=True)
class TransmissionError(ElasticityLaw):
    """A law that feels the deflection plus the errors of the wheels; the gap closes and opens by it, too.

        F_n of the law at   deflection + sum of e,   rate + sum of e'

    Where e is positive, the flanks for positive travel stand proud: at constant force the teeth's own
    deflection stays, and wheel B runs ahead of A by e (x_B = x_A + e - constant). Both flanks are shifted
    alike, as by an error of pitch or runout; the gap keeps its width.

    The error is a forcing: it does the work F_n cos(pressure angle) e' on the mesh and takes no torque from
    the wheels for it, which would be smaller than that of the teeth by de/dturn / pitch radius.

    A mesh that stands for several equal ones (Mesh.count) gives all of them the same error.

    Parameters
    ----------
    law : ElasticityLaw
        Elasticity of the teeth. Errors, faults and periodic stiffness give the same force in any order.
    harmonics : mapping of str to ErrorHarmonic
        By name.
    """

    law: ElasticityLaw
    harmonics: Mapping[str, ErrorHarmonic]

    @classmethod
    def examples(cls) -> "tuple[TransmissionError, ...]":
        """Once per turn, around a spring and around a gap."""
        return tuple(
            cls(law=law, harmonics={"runout": ErrorHarmonic(wheel="a", order=1, amplitude=1e-6)})
            for law in (*Linear.examples(), *Backlash.examples())
        )

    def shifted(self, motion: MeshMotion) -> MeshMotion:
        """The motion as the teeth feel it."""
        return motion._replace(
            deflection=motion.deflection + sum(harmonic.error(motion) for harmonic in self.harmonics.values()),
            rate=motion.rate + sum(harmonic.rate(motion) for harmonic in self.harmonics.values()),
        )

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where the law has no meaning for the teeth of a pair."""
        self.law.require_pair(pair)

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N], positive when A pushes B towards positive travel."""
        return self.law.force(self.shifted(motion), flank)

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection, at the present turn of the wheels [J]."""
        return self.law.stored(self.shifted(motion), flank)

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m]; None without a gap."""
        return self.law.penetration(self.shifted(motion), flank)

    def force_scale(self) -> Scalar:
        """Size of a usual normal force [N], that of the law."""
        return self.law.force_scale()
