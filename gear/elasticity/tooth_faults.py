"""Faulty teeth: once per turn of their wheel the mesh is softer."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import casadi as ca

from gear.elasticity.backlash import Backlash
from gear.elasticity.law import ElasticityLaw
from gear.elasticity.linear import Linear
from gear.motion import MeshMotion
from gear.quantities import Angle, Scalar, Share, check, check_count
from gear.quantities.registry import part
from gear.teeth.pair import Pair

LOG_3 = math.log(3.0)  # (1 + tanh)/2 is 10 % and 90 % at -+ log(3)


@dataclass(frozen=True, kw_only=True)
class ToothFault:
    """A weak or missing tooth: less stiffness within one tooth's angle of its wheel, once per turn.

        factor = 1 - (1 - remaining) * window(turn - angle)

           1 ----.          .----       The window is one in its middle, one tooth's angle 2 pi / teeth wide at
                  :        :            half its height, smooth (every derivative exists) and periodic: a tanh of
        remaining  `------'             the cosine of the turn.

    The factor is that of the whole mesh while the tooth is in it, not of the tooth: where a neighbor shares
    the load (contact ratio above one), a cracked tooth leaves more than its own stiffness. A missing tooth is
    a `remaining` near zero, such as 0.01, and only an approximation: the wheels sink into each other until the
    reduced stiffness carries the load, while in a gear the next tooth takes over, by a step that geometry
    decides. Trust it for when and how often a fault shows and for its first impact, as long as the deflection
    stays well below the height of a tooth.

    Parameters
    ----------
    wheel : "a" or "b"
        The wheel with the fault.
    teeth : int
        Number of teeth of that wheel, at least 3.
    remaining : float
        Stiffness that remains in the middle of the window, as a part of that of sound teeth [-], > 0 and <= 1.
    angle : float
        Turn of the wheel, relative to the carrier, at which the faulty tooth is in the middle of the mesh [rad].
    edge : float
        Part of a tooth's angle over which the stiffness falls from 90 % to 10 %, and rises again [-].
    """

    wheel: Literal["a", "b"]
    teeth: int
    remaining: Share
    angle: Angle = 0.0
    edge: Share = 0.25

    def __post_init__(self) -> None:
        check(self)
        check_count(self, "teeth", least=3)
        if self.wheel not in ("a", "b"):
            raise ValueError(f'ToothFault.wheel must be "a" or "b", got {self.wheel!r}')

    def window(self, turn: Scalar) -> Scalar:
        """How much the tooth is in the mesh at an angle of its wheel [-], 0 to 1."""
        half = math.pi / self.teeth
        rise = self.edge * half * math.sin(half) / LOG_3
        top = (1 - math.cos(half)) / rise
        inside = (ca.cos(turn - self.angle) - math.cos(half)) / rise
        return (1 + ca.tanh(inside)) / (1 + ca.tanh(top))

    def factor(self, motion: MeshMotion) -> Scalar:
        """Stiffness over that of sound teeth [-]."""
        turn = motion.turn_a if self.wheel == "a" else motion.turn_b
        return 1 - (1 - self.remaining) * self.window(turn)


@part(ElasticityLaw)
@dataclass(frozen=True, kw_only=True)
class ToothFaults(ElasticityLaw):
    """Any law of elasticity with weak or missing teeth: a forcing once per turn of a wheel, for health monitoring.

        F_n = law * product of the factors of the faults

    Spring, damper and stored energy are multiplied alike; what PeriodicStiffness says of energy holds here, too.
    A mesh that stands for several equal ones (Mesh.count) gives all of them the same faults.

    Parameters
    ----------
    law : ElasticityLaw
        Sound teeth.
    faults : mapping of str to ToothFault
        By name.
    """

    law: ElasticityLaw
    faults: Mapping[str, ToothFault]

    @classmethod
    def examples(cls) -> "tuple[ToothFaults, ...]":
        """A crack, around a spring and around a gap."""
        return tuple(
            cls(law=law, faults={"crack": ToothFault(wheel="a", teeth=20, remaining=0.5)})
            for law in (*Linear.examples(), *Backlash.examples())
        )

    def factor(self, motion: MeshMotion) -> Scalar:
        """Stiffness over that of sound teeth [-]."""
        product = 1.0
        for fault in self.faults.values():
            product = product * fault.factor(motion)
        return product

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where the law has no meaning for the teeth of a pair."""
        self.law.require_pair(pair)

    def force(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Normal force [N], positive when A pushes B towards positive travel."""
        return self.factor(motion) * self.law.force(motion, flank)

    def stored(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """Integral of the elastic force over the deflection, at the present turn of the wheels [J]."""
        return self.factor(motion) * self.law.stored(motion, flank)

    def penetration(self, motion: MeshMotion, flank: Scalar) -> Scalar:
        """How far the teeth are pressed into each other on a flank [m]; None without a gap."""
        return self.law.penetration(motion, flank)

    def force_scale(self) -> Scalar:
        """Size of a usual normal force [N], that of the law."""
        return self.law.force_scale()
