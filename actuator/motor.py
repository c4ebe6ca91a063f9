"""Motors: torque from current, current from voltage."""

from actuator.current_source import CurrentSource
from actuator.dc_motor import DCMotor
from actuator.pmsm import PMSM
from actuator.torque_source import TorqueSource

__all__ = ["PMSM", "CurrentSource", "DCMotor", "Motors", "TorqueSource"]

Motors = TorqueSource | CurrentSource | DCMotor | PMSM
