"""Checks of controller parameters against the rules in their annotations."""

import math
from dataclasses import fields
from typing import Annotated, Any, get_args, get_type_hints

from annotated_types import Ge, Gt, Unit

Scalar = Any  # a float, or a CasADi expression of one: laws are written once for both

Rate = Annotated[float, Unit("1/s"), Ge(0)]
Time = Annotated[float, Unit("s"), Gt(0)]
Speed = Annotated[float, Unit("rad/s"), Gt(0)]
Gain = Annotated[float, Unit("output/error"), Ge(0)]
PositiveGain = Annotated[float, Unit("output/error"), Gt(0)]
IntegralGain = Annotated[float, Unit("output/(error s)"), Ge(0)]
DerivativeGain = Annotated[float, Unit("output s/error"), Ge(0)]
Limit = Annotated[float, Unit("output"), Gt(0)]


def check(owner: Any) -> None:
    """Raise ValueError, with the name, rule, value and unit, where a number breaks the rule of its annotation."""
    hints = get_type_hints(type(owner), include_extras=True)
    for field in fields(owner):
        value, hint = getattr(owner, field.name), hints[field.name]
        notes = next((h.__metadata__ for h in (hint, *get_args(hint)) if hasattr(h, "__metadata__")), ())
        if value is None or not notes:
            continue
        unit, rule = notes
        number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
        if not number or not (value > 0 if isinstance(rule, Gt) else value >= 0):
            bound, where = "> 0" if isinstance(rule, Gt) else ">= 0", f"{type(owner).__name__}.{field.name}"
            shown = f"{value:.6g} {unit.unit}" if number else repr(value)
            raise ValueError(f"{where} must be {bound} {unit.unit}, got {shown}")
