"""Quantities of control laws as types, with unit, rule and role."""

from typing import Annotated

from annotated_types import Ge, Gt, Le, Lt, Unit

from gear.quantities import roles
from gear.quantities.roles import LoopGain

Rate = Annotated[float, Unit("1/s"), Ge(0)]
Time = Annotated[float, Unit("s"), Gt(0)]
Speed = Annotated[float, Unit("rad/s"), Gt(0)]
SpeedBand = Annotated[float, Unit("rad/s"), Ge(0)]
Frequency = Annotated[float, Unit("rad/s"), Gt(0)]
DampingRatio = Annotated[float, Unit("-"), Gt(0)]
Share = Annotated[float, Unit("-"), Ge(0), Le(1)]
ShareBelowOne = Annotated[float, Unit("-"), Ge(0), Lt(1)]
Gain = Annotated[float, Unit("output/error"), Ge(0), LoopGain("proportional")]
PositiveGain = Annotated[float, Unit("output/error"), Gt(0), LoopGain("proportional")]
IntegralGain = Annotated[float, Unit("output/(error s)"), Ge(0), roles.IntegralGain()]
DerivativeGain = Annotated[float, Unit("output s/error"), Ge(0), LoopGain("derivative")]
Limit = Annotated[float, Unit("output"), Gt(0), roles.Limit()]
Amplitude = Annotated[float, Unit("output"), Gt(0)]
Level = Annotated[float, Unit("output"), Ge(0)]
ErrorBand = Annotated[float, Unit("error"), Ge(0)]
ErrorWidth = Annotated[float, Unit("error"), Gt(0)]
SignalRate = Annotated[float, Unit("signal/s"), Gt(0), roles.Limit()]
SignalAcceleration = Annotated[float, Unit("signal/s^2"), Gt(0), roles.Limit()]
SpeedLimit = Annotated[float, Unit("rad/s"), Gt(0), roles.Limit()]
TorqueLimit = Annotated[float, Unit("N m"), Gt(0), roles.Limit()]
AngleGain = Annotated[float, Unit("N m/rad"), LoopGain("proportional")]
SpeedGain = Annotated[float, Unit("N m s/rad"), LoopGain("derivative")]
AngleIntegralGain = Annotated[float, Unit("N m/(rad s)"), Ge(0), roles.IntegralGain()]
Torque = Annotated[float, Unit("N m"), Ge(0)]
ViscousFriction = Annotated[float, Unit("N m s/rad"), Ge(0)]
Inertia = Annotated[float, Unit("kg m^2"), Gt(0)]
OptionalInertia = Annotated[float, Unit("kg m^2"), Ge(0)]
Inductance = Annotated[float, Unit("H"), Gt(0)]
FluxLinkage = Annotated[float, Unit("V s"), Gt(0)]
