"""A shaft, and what is asked of bearings and drags on it. A new one is a new file in this folder."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from gear.quantities import Inertia, Memory, Scalar, check


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """A rigid shaft with everything that turns with it.

    Parameters
    ----------
    inertia : float
        [kg m^2].
    """

    inertia: Inertia

    def __post_init__(self) -> None:
        check(self)


class ShaftBearing(Protocol):
    """Friction between a shaft and the housing.

    A bearing that sticks says the size of its friction; its contact holds or slides, which is decided together with all
    others. One that does not stick has an internal state instead, as `FrictionLaw` says of meshes.
    """

    shaft: str  # name of the shaft
    sticks: ClassVar[bool] = True
    carries_load: bool = False  # whether its friction depends on the load

    @abstractmethod
    def holding(self, load: Scalar) -> Scalar:
        """Largest torque [N m] that holds the shaft at rest under a load [N]."""

    @abstractmethod
    def sliding(self, load: Scalar, speed: Scalar) -> Scalar:
        """Torque against steady motion [N m] under a load [N] at a speed >= 0 [rad/s], without `viscous_torque`."""

    def viscous_torque(self, speed: Scalar) -> Scalar:
        """Torque on the shaft [N m] at a signed speed [rad/s], which vanishes at rest."""
        return 0.0

    def memory(self) -> tuple[Memory, ...]:
        """Declare the internal state, of a bearing that does not stick."""
        return ()

    def friction(self, memory: Sequence[Scalar], load: Scalar, speed: Scalar) -> Scalar:
        """Torque [N m] with the sign of the speed [rad/s] that it opposes; of a bearing that does not stick."""
        raise TypeError(f"{type(self).__name__}.friction: a bearing that sticks has no friction without a mode")

    def rates(self, memory: Sequence[Scalar], load: Scalar, speed: Scalar) -> list[Scalar]:
        """Time derivative of the internal state."""
        return []

    def terminals(self) -> dict[str, str]:
        """Names of shafts, by the field that names them."""
        return {"shaft": self.shaft}


class ShaftDrag(Protocol):
    """A torque that opposes the motion of a shaft and vanishes at rest."""

    shaft: str  # name of the shaft

    @abstractmethod
    def torque(self, speed: Scalar) -> Scalar:
        """Torque on the shaft [N m] at a signed speed [rad/s]."""

    def terminals(self) -> dict[str, str]:
        """Names of shafts, by the field that names them."""
        return {"shaft": self.shaft}
