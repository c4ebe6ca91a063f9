"""Friction as a given function of the mesh speed: the Stribeck curve, or a table."""

from dataclasses import dataclass
from typing import Annotated

import casadi as ca

from gear.friction.law import SpeedLaw, require_breakaway_above
from gear.friction.tables import piecewise_linear, require_axis
from gear.motion import Sliding
from gear.quantities import (
    AtLeastOne,
    Coefficient,
    MeshSpeed,
    PositiveMeshSpeed,
    Scalar,
    ViscousCoefficient,
    check,
)
from gear.quantities.registry import part
from gear.quantities.roles import Breakaway, SlidingFriction

# m/s, of a speed that stays above zero and smooth where a step or a search goes below it, by this and no more above
FLOOR, BEND, LEAST = 1e-12, 1e-17, 1e-30


@part(SpeedLaw)
@dataclass(frozen=True, kw_only=True)
class Stribeck(SpeedLaw):
    """Friction that falls from its static value over the Stribeck speed and rises with viscous drag.

        mu(v) = coulomb + (static - coulomb) exp(-(v/stribeck_speed)^exponent) + viscous v

        static  |.                             .
                | .                  .
                |  .         .                   The falling part is what makes a drive stick and slip.
        coulomb +    . . .
                +----+------------------ v
                     stribeck_speed

    Parameters
    ----------
    static, coulomb : float
        Coefficient at standstill and level to which it falls [-], coulomb <= static.
    stribeck_speed : float
        Mesh speed over which it falls [m/s].
    exponent : float
        Shape of the fall, >= 1 [-]: 1 exponential, 2 Gaussian. Below one the slope at standstill is infinite.
    viscous : float
        Rise per mesh speed [s/m].

    References
    ----------
    B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and compensation
    methods for the control of machines with friction", Automatica 30 (1994), 1083-1138.
    """

    static: Annotated[Coefficient, Breakaway(floor="coulomb")]
    coulomb: Annotated[Coefficient, SlidingFriction()]
    stribeck_speed: PositiveMeshSpeed
    exponent: AtLeastOne = 2.0
    viscous: ViscousCoefficient = 0.0

    @classmethod
    def examples(cls) -> "tuple[Stribeck, ...]":
        """Gaussian, and exponential with a viscous part."""
        return (
            cls(static=0.2, coulomb=0.1, stribeck_speed=0.01),
            cls(static=0.2, coulomb=0.1, stribeck_speed=0.01, exponent=1.0, viscous=0.05),
        )

    def __post_init__(self) -> None:
        check(self)
        require_breakaway_above("Stribeck", ("coulomb", self.coulomb), ("static", self.static))

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        fall = ca.exp(-((_above_zero(sliding.speed) / self.stribeck_speed) ** self.exponent))
        return self.coulomb + (self.static - self.coulomb) * fall + self.viscous * sliding.speed

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.static


def _above_zero(speed: Scalar) -> Scalar:
    """A speed [m/s] >= 0 as it is but for 1e-12, and below zero next to nothing.

    A logarithm of it, in the slope over the exponent, is finite on both sides; its slope over the speed is 1 at zero.
    """
    raised = speed + FLOOR
    return (raised + ca.sqrt(raised**2 + BEND**2)) / 2 + LEAST


@dataclass(frozen=True, kw_only=True)
class FrictionPoint:
    """An entry of a friction table.

    Parameters
    ----------
    speed : float
        Mesh speed [m/s].
    coefficient : float
        Sliding coefficient there [-].
    """

    speed: MeshSpeed
    coefficient: Coefficient

    def __post_init__(self) -> None:
        check(self)


@part(SpeedLaw)
@dataclass(frozen=True, kw_only=True)
class FrictionTable(SpeedLaw):
    """Friction coefficients over mesh speed, linear between the points and constant beyond the last.

    Parameters
    ----------
    points : tuple of FrictionPoint
        Speeds increase from zero. Its numbers stay constants of a model; they are not parameters.
    static : float
        Coefficient at standstill [-], not below that of the first point.
    """

    points: tuple[FrictionPoint, ...]
    static: Annotated[Coefficient, Breakaway(floor="onset")]

    @classmethod
    def examples(cls) -> "tuple[FrictionTable, ...]":
        """Two points."""
        return (
            cls(
                points=(FrictionPoint(speed=0.0, coefficient=0.15), FrictionPoint(speed=1.0, coefficient=0.05)),
                static=0.2,
            ),
        )

    def __post_init__(self) -> None:
        check(self)
        require_axis("FrictionTable", [point.speed for point in self.points])
        require_breakaway_above("FrictionTable", ("points[0].coefficient", self.onset), ("static", self.static))

    @property
    def onset(self) -> float:
        """Sliding coefficient just off standstill [-]."""
        return self.points[0].coefficient

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        speeds, values = zip(*((point.speed, point.coefficient) for point in self.points), strict=True)
        return piecewise_linear(sliding.speed, speeds, values)

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.static
