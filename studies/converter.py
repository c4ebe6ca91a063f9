"""A cattrs converter for what files hold: strict types, parts told apart by `type`, units in the keys."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from cattrs import Converter
from cattrs.cols import is_mapping, mapping_structure_factory
from cattrs.gen import make_dict_structure_fn

from gear.quantities import require_known
from gear.quantities.registry import default_part, is_slot, parts
from studies.units import field_unit, is_number, spellings, split, to_si

Hook = Callable[[Any, Any], Any]

TAG = "type"
NUMBER, WHOLE, TEXT, SWITCH, LIST, TABLE = (
    "a number",
    "a whole number",
    "a string",
    "true or false",
    "a list",
    "a table",
)
LARGEST_WHOLE = 2**63  # of TOML


class Refused(ValueError):
    """A value that is not of the right kind, at the keys `steps` below the table in which it was found."""

    def __init__(self, text: str, *steps: str, with_value: bool = True) -> None:
        super().__init__(text)
        self.steps, self.with_value = steps, with_value


@lru_cache
def converter(input_unit: str | None = None) -> Converter:
    """Make a converter for components, and for signals on an input of the given unit."""
    made = Converter(detailed_validation=True)
    for kind, (expected, accepts) in LEAVES.items():
        made.register_structure_hook(kind, _leaf(kind, accepts, expected))
    factories = [
        (lambda kind: get_origin(kind) is Literal, _choice),
        (is_mapping, lambda kind: _shaped(dict, mapping_structure_factory(kind, made))),
        (_is_list, lambda kind: _shaped(list, lambda value, _: tuple(made.structure(value, list[get_args(kind)[0]])))),
        (_is_component, lambda kind: _component(kind, made, input_unit)),
    ]
    for predicate, factory in factories:
        made.register_structure_hook_factory(predicate, factory)
    return made


def expected(hint: Any) -> str:
    """What a field of this type takes, in words."""
    plain = getattr(hint, "__origin__", hint) if hasattr(hint, "__metadata__") else hint
    if plain in LEAVES:
        return LEAVES[plain][0]
    if get_origin(plain) is Literal:
        return " or ".join(f'"{choice}"' for choice in get_args(plain))
    return LIST if _is_list(plain) else TABLE


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST_WHOLE


LEAVES: dict[type, tuple[str, Callable[[Any], bool]]] = {
    float: (NUMBER, is_number),
    int: (WHOLE, _is_whole),
    str: (TEXT, lambda value: isinstance(value, str)),
    bool: (SWITCH, lambda value: isinstance(value, bool)),
}


def _leaf(kind: type, accepts: Callable[[Any], bool], words: str) -> Hook:
    def make(value: Any, _: Any) -> Any:
        if not accepts(value):
            raise Refused(f"must be {words}")
        return kind(value)

    return make


def _choice(kind: Any) -> Hook:
    def make(value: Any, _: Any) -> Any:
        if value not in get_args(kind):
            raise Refused(f"must be {expected(kind)}")
        return value

    return make


def _shaped(shape: type, make: Hook) -> Hook:
    """Refuse what cattrs would take for a mapping or a list, such as the letters of a string."""

    def checked(value: Any, kind: Any) -> Any:
        if not isinstance(value, shape):
            raise Refused(f"must be {TABLE if shape is dict else LIST}")
        return make(value, kind)

    return checked


def _is_list(kind: Any) -> bool:
    return get_origin(kind) is tuple


def _members(kind: Any) -> dict[str, Any]:
    """The dataclasses that a field may hold, by name: of a union each member, of a slot each of its parts."""
    is_union = get_origin(kind) in (Union, UnionType)
    members = [part for part in get_args(kind) if part is not NoneType] if is_union else [kind]
    found: dict[str, Any] = {}
    for member in members:
        found |= parts(member) if is_slot(member) else {getattr(member, "__name__", str(member)): member}
    return found


def _default(kind: Any) -> str | None:
    """What is meant where no type is given: the only member of a field, or the default of a slot."""
    slots = [part for part in (get_args(kind) or [kind]) if is_slot(part)]
    members = _members(kind)
    return next(iter(members)) if len(members) == 1 else next(filter(None, map(default_part, slots)), None)


def _is_component(kind: Any) -> bool:
    return all(isinstance(member, type) and is_dataclass(member) for member in _members(kind).values())


def _component(kind: Any, made: Converter, input_unit: str | None) -> Hook:
    """Told apart by `type`; looked up at each table, as parts may have been registered meanwhile."""

    def make(value: Any, _: Any) -> Any:
        members, default = _members(kind), _default(kind)
        must = f"must be {'one of ' if len(members) > 1 else ''}{', '.join(members)}"
        chosen = value.get(TAG, default)
        if chosen is None:
            raise Refused(f"is missing; it {must}", TAG, with_value=False)
        if not isinstance(chosen, str) or chosen not in members:
            raise Refused(must, TAG)
        hook = _part(members[chosen], made, input_unit)
        return hook({key: item for key, item in value.items() if key != TAG}, members[chosen])

    return _shaped(dict, make)


def _part(owner: type, made: Converter, input_unit: str | None) -> Hook:
    """Bring the keys of a table to the names and SI units of one dataclass, and leave the rest to cattrs."""
    make = make_dict_structure_fn(owner, made)
    names = [field.name for field in fields(owner)]

    def structure(table: Mapping[str, Any], _: Any) -> Any:
        in_si: dict[str, Any] = {}
        for key, value in table.items():
            name, suffix = (key, None) if key in names else split(key)
            _require_name(name, names, key)
            if name in in_si:
                same = [other for other in table if name in (other, split(other).name)]
                raise Refused(f"is given more than once, as {' and as '.join(same)}; keep one", name, with_value=False)
            unit = field_unit(owner, name, input_unit)
            if suffix is not None and suffix.unit != unit:
                raise Refused(_misfit(name, unit, suffix.unit), key)
            in_si[name] = value if suffix is None else to_si(value, suffix)
        return make(in_si, owner)

    return structure


def _require_name(name: str, names: list[str], key: str) -> None:
    try:
        require_known([name], names, "key")
    except KeyError as error:
        raise Refused(f"is not allowed: {error.args[0]}", key) from None


def _misfit(name: str, unit: str | None, suffix_unit: str) -> str:
    what = f"{name} is in {unit}" if unit not in (None, "-") else f"{name} has no unit"
    return f"has a suffix for {suffix_unit}, but {what}; allowed: {', '.join(spellings(name, unit))}"
