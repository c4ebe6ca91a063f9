"""The load on the output shaft."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Unit

from gear.quantities import Scalar, TorsionalDamping, check


@dataclass(frozen=True, kw_only=True)
class Load:
    """What is fixed to the output shaft: inertia, and torque over position and speed.

        torque on the shaft = bias - stiffness * angle - damping * speed

    For a control surface, stiffness and damping are the aerodynamic hinge-moment derivatives and the bias
    is the hinge moment at neutral position.

    Parameters
    ----------
    inertia : float
        [kg m^2], added to that of the output shaft.
    stiffness : float
        [N m/rad]; negative where the load is unstable.
    damping : float
        [N m s/rad].
    bias : float
        Torque at angle zero [N m]; positive turns the shaft in positive direction.
    """

    inertia: Annotated[float, Unit("kg m^2"), Ge(0)] = 0.0
    stiffness: Annotated[float, Unit("N m/rad")] = 0.0
    damping: TorsionalDamping = 0.0
    bias: Annotated[float, Unit("N m")] = 0.0

    def __post_init__(self) -> None:
        check(self)

    def torque(self, angle: Scalar, speed: Scalar) -> Scalar:
        """Torque on the output shaft [N m]."""
        return self.bias - self.stiffness * angle - self.damping * speed
