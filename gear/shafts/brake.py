"""A brake, or a jam: a shaft that something holds to the housing."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from gear.quantities import FrictionTorque, Scalar, check
from gear.quantities.registry import part
from gear.shafts.law import ShaftBearing

if TYPE_CHECKING:
    from gear.transmission import Transmission


@part(ShaftBearing)
@dataclass(frozen=True, kw_only=True)
class Brake(ShaftBearing):
    """Rubs with the same torque at every speed and at rest.

    It is set, as a load is, and no friction of the gear: where an analysis scales all breakaway friction, it stays.

    Parameters
    ----------
    shaft : str
        Name of the shaft that it holds to the housing.
    torque : float
        [N m].
    """

    shaft: str
    torque: FrictionTorque

    @classmethod
    def examples(cls) -> "tuple[Brake, ...]":
        """Set."""
        return (cls(shaft="a", torque=2.0),)

    def __post_init__(self) -> None:
        check(self)

    def holding(self, load: Scalar) -> Scalar:
        """Torque [N m] that holds the shaft, whatever the load."""
        return self.torque

    def sliding(self, load: Scalar, speed: Scalar) -> Scalar:
        """Torque against the motion [N m], the same at every speed."""
        return self.torque


def add_brake(gear: "Transmission", shaft: str, torque: float) -> "Transmission":
    """The same transmission with one shaft held to the housing until `torque` [N m] is exceeded.

    The brake is named after the shaft, as `brake_<shaft>`; stiction decides together with all other contacts whether it
    holds. For a brake, or a jam, in the middle of a run, build it with torque 0, and go on from the run's last state
    with the parameter `gear.bearings.brake_<shaft>.torque`. A shaft that nothing can turn is `fixed` in Transmission.
    """
    return replace(gear, bearings={**gear.bearings, f"brake_{shaft}": Brake(shaft=shaft, torque=torque)})
