"""The ideal motor: torque on demand."""

from dataclasses import dataclass

import casadi as ca

from actuator.parts.electrical import TorqueLimit
from actuator.parts.motor import TorqueDriven
from gear.quantities import Scalar, check
from gear.quantities.registry import part


@part(TorqueDriven)
@dataclass(frozen=True, kw_only=True)
class TorqueSource(TorqueDriven):
    """An ideal motor: the torque it is asked for, at once, within a limit.

    Parameters
    ----------
    torque_limit : float or None
        Of the magnitude [N m]; None for none.
    """

    torque_limit: TorqueLimit | None = None

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def examples(cls) -> "tuple[TorqueSource, ...]":
        """With and without a limit."""
        return (cls(), cls(torque_limit=2.0))

    def allow_torque(self, torque: Scalar) -> Scalar:
        """The torque [N m] within the limit."""
        limit = self.torque_limit
        return torque if limit is None else ca.fmax(-limit, ca.fmin(limit, torque))
