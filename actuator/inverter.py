"""The inverter, averaged over its switching period."""

import math
from dataclasses import dataclass
from typing import Annotated

import casadi as ca
from annotated_types import Gt, Unit

from gear.quantities import Scalar, check

Voltage = Annotated[float, Unit("V"), Gt(0)]
Current = Annotated[float, Unit("A"), Gt(0)]


@dataclass(frozen=True, kw_only=True)
class Inverter:
    """Averaged voltage source with the limits of its DC link and its current.

        one axis (DC motor):     |v| <= dc_voltage
        two axes (dq, peak):     sqrt(vd^2 + vq^2) <= dc_voltage / sqrt(3)

    Parameters
    ----------
    dc_voltage : float
        Voltage of the DC link [V].
    current_limit : float
        Largest torque-producing current it is asked for [A peak].
    """

    dc_voltage: Voltage
    current_limit: Current

    def __post_init__(self) -> None:
        check(self)

    def realize(self, voltages: list[Scalar]) -> list[Scalar]:
        """The voltages the motor gets [V] from those demanded; the direction of the vector is kept."""
        if len(voltages) == 1:
            return [ca.fmax(-self.dc_voltage, ca.fmin(self.dc_voltage, voltages[0]))]
        limit = self.dc_voltage / math.sqrt(3)
        # scaled by the larger of demand and limit: smooth at zero, where a norm would not be
        square = sum(voltage**2 for voltage in voltages)
        scale = limit / ca.sqrt(ca.fmax(square, limit**2))
        return [scale * voltage for voltage in voltages]

    def allow(self, current: Scalar) -> Scalar:
        """The torque-producing current [A] that may be asked for."""
        return ca.fmax(-self.current_limit, ca.fmin(self.current_limit, current))
