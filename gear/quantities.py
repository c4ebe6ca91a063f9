"""Physical quantities as types: the unit and the rule stand in the annotation.

A parameter is declared in one line, `inertia: Inertia`, and everything else follows from it: the check
when the object is made, the unit in error messages, in files and in reports.
"""

import math
import operator
from dataclasses import fields
from numbers import Integral, Real
from typing import Annotated, Any, get_type_hints

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

RULES = {
    Gt: ("gt", ">", operator.gt),
    Ge: ("ge", ">=", operator.ge),
    Lt: ("lt", "<", operator.lt),
    Le: ("le", "<=", operator.le),
}


def annotations(owner: Any) -> dict[str, tuple[Any, ...]]:
    """Field name -> what its annotation adds to the type: `Unit`, `Gt`, `Ge`, `Lt`, `Le`."""
    hints = get_type_hints(owner if isinstance(owner, type) else type(owner), include_extras=True)
    return {name: _metadata(hint) for name, hint in hints.items()}


def _metadata(hint: Any) -> tuple[Any, ...]:
    if hasattr(hint, "__metadata__"):
        return hint.__metadata__
    return next((_metadata(part) for part in getattr(hint, "__args__", ()) if hasattr(part, "__metadata__")), ())


def unit_of(owner: Any, name: str) -> str | None:
    """Unit of the field `name`, or None where the field is not a quantity."""
    units = [note.unit for note in annotations(owner).get(name, ()) if isinstance(note, Unit)]
    return units[0] if units else None


def show(value: Any, unit: str | None) -> str:
    """A value as a person writes it: `0.01 m`, and a pure number without a unit."""
    text = str(value) if isinstance(value, Integral) else f"{float(value):.6g}"
    return text if unit in (None, "-") else f"{text} {unit}"


def check(owner: Any) -> None:
    """Hold every field of a dataclass against the rule in its annotation.

    Raises
    ------
    ValueError
        Naming the class, the field, the rule and the value with its unit.
    """
    for field in fields(owner):
        value, notes = getattr(owner, field.name), annotations(owner)[field.name]
        if value is None or not notes:
            continue
        unit = unit_of(owner, field.name)
        where = f"{type(owner).__name__}.{field.name}"
        if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
            raise ValueError(f"{where} must be a finite number [{unit}], got {value!r}")
        for note in notes:
            if type(note) in RULES:
                attribute, sign, holds = RULES[type(note)]
                bound = getattr(note, attribute)
                if not holds(value, bound):
                    raise ValueError(f"{where} must be {sign} {show(bound, unit)}, got {show(value, unit)}")


def check_count(owner: Any, name: str, least: int = 1, of: str = "") -> None:
    """Hold a field that counts something (`of` what, for the message) against its least value.

    Raises
    ------
    ValueError
        Naming the class, the field and the value.
    """
    value = getattr(owner, name)
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        what = f"a whole number of {of}" if of else "a whole number"
        raise ValueError(f"{type(owner).__name__}.{name} must be {what} >= {least}, got {value!r}")
