"""What is asked of couplings and end stops. A new one is a new file in this folder."""

from abc import abstractmethod
from typing import NamedTuple, Protocol

from gear.quantities import Scalar

TWIST_NOMINAL = 1e-4  # rad; couplings under load twist by about this


class Twist(NamedTuple):
    """How far a coupling is turned, and how fast."""

    angle: Scalar  # phi_a - phi_b [rad]
    rate: Scalar  # its time derivative [rad/s]


class ShaftSpring(Protocol):
    """A torque between shafts that follows from one twist, a linear combination of their angles.

    The flank (+1, -1, or 0 in the gap) is a mode of a spring that has a gap.
    """

    @abstractmethod
    def terminals(self) -> dict[str, str]:
        """Names of shafts, by the field that names them; a single one where the other side is the housing."""

    @abstractmethod
    def twist_per_shaft(self) -> dict[str, Scalar]:
        """Twist [rad] per angle [rad] of each shaft; the torques on the shafts are -torque times these."""

    @abstractmethod
    def penetration(self, twist: Twist, flank: Scalar) -> Scalar:
        """How far the spring is turned beyond its gap on a flank [rad]; None without a gap."""

    @abstractmethod
    def torque(self, twist: Twist, flank: Scalar) -> Scalar:
        """Torque that it passes on [N m] on the given flank; without a gap the flank does not matter."""

    @abstractmethod
    def stored(self, twist: Twist, flank: Scalar) -> Scalar:
        """Energy in the spring [J]."""


class ShaftCoupling(ShaftSpring, Protocol):
    """Joins two shafts, or a shaft and the housing."""

    rigid: bool = True  # whether the ratio of the transmission takes its twist as constant


class ShaftStop(ShaftSpring, Protocol):
    """Ends the travel of a shaft on both sides."""

    @abstractmethod
    def free_range(self) -> tuple[Scalar, Scalar]:
        """The twists [rad] between which nothing is touched."""
