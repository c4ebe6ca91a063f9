"""The registry of parts: a new friction law, motor, controller, load or coupling is one new file.

    @part(FrictionLaw)
    @dataclass(frozen=True, kw_only=True)
    class Coulomb(FrictionLaw): ...

A slot is a protocol: what the actuator asks of a part in that place, with defaults for what most parts need not say.
A part is held against the protocols of its slots when it registers, and is known by its class name, in files too. Parts
of other packages are found by the entry points of the group `geared_actuator.parts`, each naming a module that
registers its parts when it is imported.
"""

import inspect
from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from typing import Any, TypeVar

GROUP = "geared_actuator.parts"

Part = TypeVar("Part", bound=type)
_parts: dict[type, dict[str, type]] = {}
_defaults: dict[type, str] = {}


class PartError(TypeError):
    """A part that does not keep the contract of its slot, or cannot be found."""


def part(*slots: type, default: bool = False) -> Callable[[Part], Part]:
    """Register a class for slots; a `default` one is meant where a file names no type.

    Raises
    ------
    PartError
        Where it lacks a method of a slot, takes other arguments, or its name or the default is taken.
    """

    def register(made: Part) -> Part:
        for slot in slots:
            _require_contract(made, slot)
            kinds = _parts.setdefault(slot, {})
            taken = kinds.get(made.__name__)
            if taken is not None and (taken.__module__, taken.__qualname__) != (made.__module__, made.__qualname__):
                raise PartError(
                    f"{slot.__name__} {made.__name__} of {made.__module__}: there is one of that name in "
                    f"{taken.__module__}; rename one of them"
                )
            if default and _defaults.get(slot, made.__name__) != made.__name__:
                raise PartError(f"{slot.__name__}: the default is {_defaults[slot]} already, not {made.__name__}")
            kinds[made.__name__] = made
            if default:
                _defaults[slot] = made.__name__
        return made

    return register


def is_slot(kind: Any) -> bool:
    """Whether parts are registered for it."""
    return isinstance(kind, type) and kind in _parts


def parts(slot: type) -> dict[str, type]:
    """The parts of a slot by name, those of other packages with them."""
    _load_others()
    return dict(_parts.get(slot, {}))


def default_part(slot: type) -> str | None:
    """Name of the part that is meant where none is named; None where one has to be."""
    names = parts(slot)
    return _defaults.get(slot, next(iter(names)) if len(names) == 1 else None)


def slots() -> tuple[type, ...]:
    """All slots that have parts."""
    _load_others()
    return tuple(_parts)


@cache
def _load_others() -> None:
    """Import the parts of other packages, once; one that is broken raises with its name."""
    for entry in entry_points(group=GROUP):
        try:
            entry.load()
        except Exception as error:
            raise PartError(f"the parts {entry.name} ({entry.value}) cannot be loaded: {error}") from error


def _require_contract(made: type, slot: type) -> None:
    """Raise PartError where a class does not do what its slot asks, naming method and signature."""
    for name, asked in vars(slot).items():
        if name.startswith("_") or not inspect.isfunction(asked):
            continue
        given = getattr(made, name, None)
        if not callable(given):
            raise PartError(f"{made.__name__} is no {slot.__name__}: it lacks {name}{inspect.signature(asked)}")
        wanted, found = inspect.signature(asked).parameters, inspect.signature(given).parameters
        extra = [key for key, value in found.items() if key not in wanted and value.default is value.empty]
        missing = [key for key in wanted if key not in found]
        open_ended = any(value.kind in (value.VAR_POSITIONAL, value.VAR_KEYWORD) for value in found.values())
        if (missing and not open_ended) or (extra and not open_ended):
            raise PartError(
                f"{made.__name__} is no {slot.__name__}: {name}{inspect.signature(given)} should take "
                f"{inspect.signature(asked)}"
            )
    for name in getattr(slot, "__annotations__", {}):
        if not (hasattr(made, name) or name in getattr(made, "__annotations__", {})):
            raise PartError(f"{made.__name__} is no {slot.__name__}: it does not declare {name}")
