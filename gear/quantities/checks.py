"""Fields of a dataclass held against the rules in their annotations, and how a refusal is written."""

import difflib
import math
import operator
from collections.abc import Iterable
from dataclasses import fields
from numbers import Integral, Real
from typing import Any, get_type_hints

from annotated_types import Ge, Gt, Le, Lt, Unit

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
        unit = unit_of(owner, field.name)
        if value is None or unit is None:
            continue
        where = f"{type(owner).__name__}.{field.name}"
        if not is_number(value):
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


def check_choice(owner: Any, name: str, choices: tuple[str, ...]) -> None:
    """Raise ValueError where the field is none of the words it may be."""
    value = getattr(owner, name)
    if value not in choices:
        *most, last = (f'"{choice}"' for choice in choices)
        raise ValueError(f"{type(owner).__name__}.{name} must be {', '.join(most)} or {last}, got {value!r}")


def is_number(value: Any) -> bool:
    """Whether it is a finite real number, and not a symbol, a text or a truth."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def require_known(names: Iterable[str], valid: Iterable[str], what: str) -> None:
    """Raise KeyError for the first name that is not among the valid ones, with the nearest of them."""
    valid = list(valid)
    for name in names:
        if name not in valid:
            near = difflib.get_close_matches(name, valid, n=3, cutoff=0.4) or valid[:8]
            hint = f"did you mean {' or '.join(near)}?" if near else "there are none"
            raise KeyError(f"no {what} named {name!r}; {hint}")
