"""The ideal motor: torque on demand."""

from dataclasses import dataclass

from actuator.parts.electrical import TorqueLimit
from gear.quantities import check


@dataclass(frozen=True, kw_only=True)
class TorqueSource:
    """An ideal motor: the torque it is asked for, at once, within a limit.

    Parameters
    ----------
    torque_limit : float or None
        Of the magnitude [N m]; None for none.
    """

    torque_limit: TorqueLimit | None = None

    def __post_init__(self) -> None:
        check(self)
