"""Physical quantities as types: the unit and the rule stand in the annotation.

A parameter is declared in one line, `inertia: Inertia`, and everything else follows from it: the check
when the object is made, the unit in error messages, in files and in reports. What it means for an analysis
is declared in the same place, by a role (`gear.quantities.roles`).
"""

import math
from typing import Annotated, Any, NamedTuple

from annotated_types import Ge, Gt, Le, Lt, Unit

Scalar = Any  # a float, or a CasADi expression of one: laws are written once for both
Matrix = Any  # of CasADi: SX inside functions, MX around them; plain numbers become DM

Number = Annotated[float, Unit("-")]
Coefficient = Annotated[float, Unit("-"), Ge(0)]
Factor = Annotated[float, Unit("-"), Gt(0)]
Length = Annotated[float, Unit("m"), Gt(0)]
Distance = Annotated[float, Unit("m"), Ge(0)]
Arm = Annotated[float, Unit("m")]
Exponent = Annotated[float, Unit("-"), Ge(0), Le(1)]
PressureAngle = Annotated[float, Unit("rad"), Gt(0), Lt(math.pi / 4)]
Inertia = Annotated[float, Unit("kg m^2"), Gt(0)]
Stiffness = Annotated[float, Unit("N/m"), Gt(0)]
Damping = Annotated[float, Unit("N s/m"), Ge(0)]
FrictionTorque = Annotated[float, Unit("N m"), Ge(0)]
TorsionalStiffness = Annotated[float, Unit("N m/rad"), Gt(0)]
TorsionalDamping = Annotated[float, Unit("N m s/rad"), Ge(0)]
PositiveCoefficient = Annotated[float, Unit("-"), Gt(0)]
ViscousCoefficient = Annotated[float, Unit("s/m"), Ge(0)]
Share = Annotated[float, Unit("-"), Gt(0), Le(1)]
AtLeastOne = Annotated[float, Unit("-"), Ge(1)]
MeshSpeed = Annotated[float, Unit("m/s"), Ge(0)]
PositiveMeshSpeed = Annotated[float, Unit("m/s"), Gt(0)]
HelixAngle = Annotated[float, Unit("rad"), Ge(0), Lt(math.pi / 2)]
Temperature = Annotated[float, Unit("K"), Gt(0)]
KinematicViscosity = Annotated[float, Unit("m^2/s"), Gt(0)]
DynamicViscosity = Annotated[float, Unit("Pa s"), Gt(0)]
Density = Annotated[float, Unit("kg/m^3"), Gt(0)]
Expansion = Annotated[float, Unit("1/K"), Ge(0)]
Angle = Annotated[float, Unit("rad")]
Force = Annotated[float, Unit("N"), Gt(0)]
Part = Annotated[float, Unit("-"), Gt(0), Lt(1)]


class Memory(NamedTuple):
    """One number that a law keeps from one instant to the next."""

    name: str
    unit: str
    nominal: float  # usual size, for the error control
    initial: float = 0.0
