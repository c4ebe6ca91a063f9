"""Motors: torque from current, current from voltage."""

from actuator.parts.current_source import CurrentSource
from actuator.parts.dc_motor import DCMotor
from actuator.parts.pmsm import PMSM
from actuator.parts.torque_source import TorqueSource

__all__ = ["PMSM", "CurrentSource", "DCMotor", "Motors", "TorqueSource"]

Motors = TorqueSource | CurrentSource | DCMotor | PMSM
