"""From the tables of a file to frozen dataclasses, and from what went wrong to one line about it."""

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from cattrs import BaseValidationError

from studies.converter import Refused, converter, expected
from studies.files import CaseFile, Steps
from studies.units import field_unit


class Fault(NamedTuple):
    """One of the exceptions that cattrs collected, and where it arose."""

    steps: Steps
    owner: Any  # class or collection that was being made
    error: Exception
    hint: Any = None  # type of the field
    unit: str | None = None  # unit of the field


def structure(file: CaseFile, steps: Steps, kind: Any, input_unit: str | None = None) -> Any:
    """Make a `kind` (a dataclass, or a union of them told apart by `type`) from the table at `steps`.

    Parameters
    ----------
    file : CaseFile
        Where the table stands.
    steps : tuple
        The way to it from the top.
    kind : type
        What to make.
    input_unit : str or None
        Unit of the input that a signal drives.

    Raises
    ------
    CaseError
        For the first thing that is wrong, with its key and what is allowed there.
    """
    table: Any = file.table
    for step in steps:
        table = table[step]
    try:
        return converter(input_unit).structure(table, kind)
    except (BaseValidationError, Refused) as error:
        fault = next(_faults(Fault(steps, kind, error), input_unit))
        raise _explained(file, fault) from None


def _faults(fault: Fault, input_unit: str | None) -> Iterator[Fault]:
    """The leaves of a tree of exceptions, in the order of the fields."""
    group = fault.error
    if not isinstance(group, BaseValidationError):
        yield fault
        return
    for error in group.exceptions:
        inner = Fault(fault.steps, group.cl, error, fault.hint, fault.unit)
        # the note of cattrs: a field by its name, an item of a collection by its index
        note: Any = next((note for note in getattr(error, "__notes__", ()) if hasattr(note, "type")), None)
        if hasattr(note, "name"):
            unit = field_unit(group.cl, note.name, input_unit)
            inner = inner._replace(steps=(*fault.steps, note.name), hint=note.type, unit=unit)
        elif note is not None:
            inner = inner._replace(steps=(*fault.steps, note.index), hint=note.type)
        yield from _faults(inner, input_unit)


def _explained(file: CaseFile, fault: Fault) -> Exception:
    error, unit = fault.error, f" [{fault.unit}]" if fault.unit not in (None, "-") else ""
    match error:
        case Refused():
            return file.error((*fault.steps, *error.steps), f"{error}{unit}", with_value=error.with_value)
        case KeyError():
            return file.error(fault.steps, f"is missing; it must be {expected(fault.hint)}{unit}")
        case ValueError() | ArithmeticError():
            return _rule(file, fault.steps, fault.owner, str(error))
    return error


def _rule(file: CaseFile, steps: Steps, owner: type, text: str) -> Exception:
    """A rule of a dataclass that does not hold; where it names the field, `PMSM.flux must be`, so does the path."""
    found = re.match(rf"{owner.__name__}\.([\w.]+) (.*)", text)
    if found:
        return file.error((*steps, *found[1].split(".")), found[2])
    return file.error(steps, f"is refused: {text}")
