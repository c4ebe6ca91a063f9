"""From numbers to symbols: every float field of a component becomes a named CasADi parameter."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, NamedTuple, TypeVar

import casadi as ca

from gear.quantities import annotations, unit_of
from gear.quantities.roles import AnyRole, Breakaway, InLoop, IntegralGain, Role, find_role, roles_in

Component = TypeVar("Component")


class Parameter(NamedTuple):
    """A named number of a model, with its default value."""

    name: str  # path through the components, "gear.meshes.first.friction.sliding"
    unit: str
    default: float
    symbol: ca.SX
    roles: tuple[Role, ...] = ()
    owner: str = ""  # path of the component that it is a field of
    component: Any = None  # that component, with numbers

    def role(self, kind: type[AnyRole]) -> AnyRole | None:
        """Its role of that kind, or None."""
        return find_role(self.roles, kind)


def parameterize(component: Component, path: str) -> tuple[Component, list[Parameter]]:
    """Copy a component with a symbol in place of every number that has a unit.

    Counts, names and choices stay what they are: they decide the structure of the model. The copy is not
    checked again (a symbol is neither positive nor negative); its methods work as those of the original.
    """
    found: list[Parameter] = []
    return _copy(component, path, (), found), found


def _copy(part: Any, path: str, inherited: tuple[Role, ...], found: list[Parameter]) -> Any:
    """A component, with the roles that were declared of it for all that it holds."""
    if isinstance(part, Mapping):
        return {name: _copy(item, f"{path}.{name}", inherited, found) for name, item in part.items()}
    if not is_dataclass(part):
        return part
    copy, notes = object.__new__(type(part)), annotations(part)
    for field in fields(part):
        value, unit, name = getattr(part, field.name), unit_of(part, field.name), f"{path}.{field.name}"
        roles = (*inherited, *roles_in(notes[field.name]))
        if unit is not None and value is not None:
            symbol = ca.SX.sym(name)
            found.append(Parameter(name, unit, float(value), symbol, roles, path, part))
            value = symbol
        else:
            value = _copy(value, name, roles, found)
        object.__setattr__(copy, field.name, value)
    return copy


def unchecked(kind: type[Component], **values: Any) -> Component:
    """A component with expressions in its fields, which no rule can be held against."""
    made = object.__new__(kind)
    for field in fields(kind):  # pyright: ignore[reportArgumentType] - components are dataclasses
        object.__setattr__(made, field.name, values[field.name])
    return made


def substituted(part: Any, change: Callable[[Any], Any], keep: Iterable[str] = ()) -> Any:
    """A symbolic component with `change` made to every part of it that it is not None for, unchecked.

    Fields named in `keep` stay as they are.
    """
    if isinstance(part, Mapping):
        return {name: substituted(item, change, keep) for name, item in part.items()}
    if not is_dataclass(part) or isinstance(part, type):
        return part
    changed = change(part)
    if changed is not None:
        return changed
    old = {field.name: getattr(part, field.name) for field in fields(part)}
    new = {name: value if name in keep else substituted(value, change, keep) for name, value in old.items()}
    return unchecked(type(part), **new)


def with_values(part: Any, path: str, values: Mapping[str, float]) -> Any:
    """The same component with other numbers, each by its name, checked as when it was made.

    Raises
    ------
    ValueError
        Where a number breaks a rule of its component.
    """
    if isinstance(part, Mapping):
        return {name: with_values(item, f"{path}.{name}", values) for name, item in part.items()}
    if not is_dataclass(part) or isinstance(part, type):
        return part
    changes = {}
    for field in fields(part):
        old, name = getattr(part, field.name), f"{path}.{field.name}"
        new = float(values[name]) if name in values else with_values(old, name, values)
        if new is not old and new != old:
            changes[field.name] = new
    return replace(part, **changes) if changes else part


def breakaway_floor(parameter: Parameter, values: Mapping[str, float]) -> float | None:
    """What a breakaway friction must not fall below, at these values of other parameters; None without a floor.

    That is the sliding friction of the same contact just off standstill, in the measure of the parameter.
    """
    role = parameter.role(Breakaway)
    if role is None or role.floor is None:
        return None
    if not isinstance(role.floor, str):
        return role.floor
    sibling = f"{parameter.owner}.{role.floor}"
    return values[sibling] if sibling in values else float(getattr(parameter.component, role.floor))


def motion_integrals(parameters: Iterable[Parameter]) -> tuple[Parameter, ...]:
    """Gains of every integral that acts on motion, and so winds up against a contact that sticks."""
    found = []
    for parameter in parameters:
        loop = parameter.role(InLoop)
        if parameter.role(IntegralGain) is not None and (loop is None or loop.domain == "motion"):
            found.append(parameter)
    return tuple(found)


def at_least_sliding(parameter: Parameter, value: float, values: Mapping[str, float]) -> float:
    """A value for a parameter; for breakaway friction no less than its sliding friction among the values."""
    floor = breakaway_floor(parameter, values)
    return value if floor is None else max(value, floor)


def scaled_breakaway(parameters: Iterable[Parameter], factor: float, values: Mapping[str, float]) -> dict[str, float]:
    """All breakaway friction among the parameters times a factor, each down to its sliding friction."""
    return {
        parameter.name: at_least_sliding(parameter, factor * values[parameter.name], values)
        for parameter in parameters
        if parameter.role(Breakaway) is not None
    }
