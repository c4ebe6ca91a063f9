"""Electrical, magnetic and thermal quantities as types: the unit and the rule stand in the annotation."""

from typing import Annotated

from annotated_types import Ge, Gt, Unit

from gear.quantities.roles import Limit

Resistance = Annotated[float, Unit("ohm"), Gt(0)]
SeriesResistance = Annotated[float, Unit("ohm"), Ge(0)]
Inductance = Annotated[float, Unit("H"), Gt(0)]
Capacitance = Annotated[float, Unit("F"), Gt(0)]
Voltage = Annotated[float, Unit("V"), Gt(0)]
VoltageDrop = Annotated[float, Unit("V"), Ge(0)]
Current = Annotated[float, Unit("A"), Gt(0)]
FluxLinkage = Annotated[float, Unit("V s"), Gt(0)]
TorqueConstant = Annotated[float, Unit("N m/A"), Gt(0)]
TorqueLimit = Annotated[float, Unit("N m"), Gt(0), Limit()]
RotorInertia = Annotated[float, Unit("kg m^2"), Gt(0)]
Lag = Annotated[float, Unit("s"), Gt(0)]
DeadTime = Annotated[float, Unit("s"), Ge(0)]
Frequency = Annotated[float, Unit("Hz"), Gt(0)]
TemperatureCoefficient = Annotated[float, Unit("1/K")]
HeatCapacity = Annotated[float, Unit("J/K"), Gt(0)]
HeatResistance = Annotated[float, Unit("K/W"), Gt(0)]
