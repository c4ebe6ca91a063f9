"""Checks of controller parameters against the rules in their annotations."""

import math
import operator
from dataclasses import fields
from numbers import Real
from typing import Annotated, Any, get_args, get_type_hints

from annotated_types import Ge, Gt, Le, Lt, Unit

Scalar = Any  # a float, or a CasADi expression of one: laws are written once for both

Rate = Annotated[float, Unit("1/s"), Ge(0)]
Time = Annotated[float, Unit("s"), Gt(0)]
Speed = Annotated[float, Unit("rad/s"), Gt(0)]
SpeedBand = Annotated[float, Unit("rad/s"), Ge(0)]
Frequency = Annotated[float, Unit("rad/s"), Gt(0)]
DampingRatio = Annotated[float, Unit("-"), Gt(0)]
Share = Annotated[float, Unit("-"), Ge(0), Le(1)]
ShareBelowOne = Annotated[float, Unit("-"), Ge(0), Lt(1)]
Gain = Annotated[float, Unit("output/error"), Ge(0)]
PositiveGain = Annotated[float, Unit("output/error"), Gt(0)]
IntegralGain = Annotated[float, Unit("output/(error s)"), Ge(0)]
DerivativeGain = Annotated[float, Unit("output s/error"), Ge(0)]
Limit = Annotated[float, Unit("output"), Gt(0)]
Level = Annotated[float, Unit("output"), Ge(0)]
ErrorBand = Annotated[float, Unit("error"), Ge(0)]
ErrorWidth = Annotated[float, Unit("error"), Gt(0)]
SignalRate = Annotated[float, Unit("signal/s"), Gt(0)]
SignalAcceleration = Annotated[float, Unit("signal/s^2"), Gt(0)]
Torque = Annotated[float, Unit("N m"), Ge(0)]
ViscousFriction = Annotated[float, Unit("N m s/rad"), Ge(0)]
Inertia = Annotated[float, Unit("kg m^2"), Gt(0)]
OptionalInertia = Annotated[float, Unit("kg m^2"), Ge(0)]
Inductance = Annotated[float, Unit("H"), Gt(0)]
FluxLinkage = Annotated[float, Unit("V s"), Gt(0)]

RULES = {
    Gt: ("gt", ">", operator.gt),
    Ge: ("ge", ">=", operator.ge),
    Lt: ("lt", "<", operator.lt),
    Le: ("le", "<=", operator.le),
}


def check(owner: Any) -> None:
    """Raise ValueError, with the name, rule, value and unit, where a number breaks the rule of its annotation."""
    hints = get_type_hints(type(owner), include_extras=True)
    for field in fields(owner):
        value, hint = getattr(owner, field.name), hints[field.name]
        notes = next((h.__metadata__ for h in (hint, *get_args(hint)) if hasattr(h, "__metadata__")), ())
        if value is None or not notes:
            continue
        unit = next(note.unit for note in notes if isinstance(note, Unit))
        for note in notes:
            if type(note) in RULES:
                attribute, sign, holds = RULES[type(note)]
                bound = getattr(note, attribute)
                if not (is_number(value) and holds(value, bound)):
                    where = f"{type(owner).__name__}.{field.name}"
                    shown = show(value, unit) if is_number(value) else repr(value)
                    raise ValueError(f"{where} must be {sign} {show(bound, unit)}, got {shown}")


def is_number(value: Any) -> bool:
    """Whether it is a finite real number, and not a symbol, a text or a truth."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def show(value: float, unit: str) -> str:
    """A value as a person writes it: `0.01 s`, and a pure number without a unit."""
    return f"{value:.6g}" if unit == "-" else f"{value:.6g} {unit}"


def check_choice(owner: Any, name: str, choices: tuple[str, ...]) -> None:
    """Raise ValueError where the field is none of the words it may be."""
    value = getattr(owner, name)
    if value not in choices:
        *most, last = (f'"{choice}"' for choice in choices)
        raise ValueError(f"{type(owner).__name__}.{name} must be {', '.join(most)} or {last}, got {value!r}")
