"""Mechanisms between a shaft and a rod: travel as a function of the shaft's angle, with its first two derivatives.

All are without losses; for the friction of a screw see `gear.teeth.screw.ScrewPair`.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple, Protocol

import casadi as ca
from annotated_types import Unit

from gear.quantities import Angle, Length, Scalar, check, show
from gear.quantities.registry import part


class Travel(NamedTuple):
    """Travel of the rod at an angle of the shaft."""

    position: Scalar  # x [m], zero at angle zero
    slope: Scalar  # dx/dphi [m/rad]
    curvature: Scalar  # d2x/dphi2 [m/rad^2]


class Mechanism(Protocol):
    """Between the output shaft and a rod."""

    def travel(self, angle: Scalar) -> Travel:
        """Travel at the angle [rad] of the shaft."""
        ...


@part(Mechanism)
@dataclass(frozen=True, kw_only=True)
class Rack:
    """A rack on a pinion: x = radius * phi.

    Parameters
    ----------
    radius : float
        Pitch radius of the pinion [m].
    """

    radius: Length

    def __post_init__(self) -> None:
        check(self)

    def travel(self, angle: Scalar) -> Travel:
        """Travel at the angle [rad] of the shaft."""
        return Travel(self.radius * angle, self.radius, 0.0)


@part(Mechanism)
@dataclass(frozen=True, kw_only=True)
class Screw:
    """A nut on a spindle: x = lead * phi / (2 pi).

    Parameters
    ----------
    lead : float
        Travel per turn [m].
    """

    lead: Length

    def __post_init__(self) -> None:
        check(self)

    def travel(self, angle: Scalar) -> Travel:
        """Travel at the angle [rad] of the shaft."""
        slope = self.lead / (2 * math.pi)
        return Travel(slope * angle, slope, 0.0)


@part(Mechanism)
@dataclass(frozen=True, kw_only=True)
class Lever:
    """A lever that moves a rod, through a link or a slot: the ratio depends on the angle.

        theta = phi + angle                                 from the lever's perpendicular on the rod
        y     = radius cos(theta) - offset                  of the lever's end above the rod
        x     = radius sin(theta) + sqrt(link^2 - y^2),     less its value at phi = 0

    At phi = angle = 0 the lever stands square on the rod. Without a link (a slot across the rod, or a link so
    long that its slope does not count) the root falls away.

    Parameters
    ----------
    radius : float
        Length of the lever [m].
    angle : float
        Angle of the lever from the perpendicular on the rod at phi = 0 [rad].
    link : float or None
        Length of the link between lever and rod [m], > radius + |offset|, so that the lever can turn all round.
    offset : float
        Distance of the rod's line from the lever's axis [m].
    """

    radius: Length
    angle: Angle = 0.0
    link: Length | None = None
    offset: Annotated[float, Unit("m")] = 0.0

    def __post_init__(self) -> None:
        check(self)
        if self.link is not None and self.link <= self.radius + abs(self.offset):
            raise ValueError(
                f"Lever.link must be > radius + |offset| = {show(self.radius + abs(self.offset), 'm')}, got "
                f"{show(self.link, 'm')}; a shorter link stops the lever within a turn"
            )

    def travel(self, angle: Scalar) -> Travel:
        """Travel at the angle [rad] of the shaft."""
        now, neutral = self._from_axis(angle + self.angle), self._from_axis(self.angle)
        return now._replace(position=now.position - neutral.position)

    def _from_axis(self, theta: Scalar) -> Travel:
        along, across = self.radius * ca.sin(theta), self.radius * ca.cos(theta)
        if self.link is None:
            return Travel(along, across, -along)
        y = across - self.offset
        root = ca.sqrt(self.link**2 - y**2)
        return Travel(
            position=along + root,
            slope=across + y * along / root,
            curvature=-along + (y * across - along**2) / root - (y * along) ** 2 / root**3,
        )
