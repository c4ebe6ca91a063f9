"""The registry of parts: a new friction law, motor, controller, load or coupling is one new file.

    @part(FrictionLaw)
    @dataclass(frozen=True, kw_only=True)
    class Coulomb(FrictionLaw): ...

A slot is a protocol: what the actuator asks of a part in that place, with defaults for what most parts need not say.
A slot may refine another one; its parts are parts of both.
A part is held against the protocols of its slots when it registers, and is known by its class name, in files too. It is
found in any file of the folder that its slot is in. Parts of other packages are found by the entry points of the group
`geared_actuator.parts`, each naming a module that registers its parts when it is imported.
"""

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from typing import Any, Protocol, TypeVar

GROUP = "geared_actuator.parts"
OPEN_ENDED = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)

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
        for slot in dict.fromkeys(base for named in slots for base in _refined(named)):
            require_contract(made, slot)
            kinds = _parts.setdefault(slot, {})
            taken = kinds.get(made.__name__)
            if taken is not None and (taken.__module__, taken.__qualname__) != (made.__module__, made.__qualname__):
                raise PartError(
                    f"{slot.__name__} {made.__name__} of {made.__module__}: there is one of that name in "
                    f"{taken.__module__}; rename one of them"
                )
            is_default = default and slot in slots
            if is_default and _defaults.get(slot, made.__name__) != made.__name__:
                raise PartError(f"{slot.__name__}: the default is {_defaults[slot]} already, not {made.__name__}")
            kinds[made.__name__] = made
            if is_default:
                _defaults[slot] = made.__name__
        return made

    return register


def _refined(slot: type) -> list[type]:
    """A slot and the slots that it refines."""
    return [kind for kind in slot.__mro__ if Protocol in kind.__bases__]


def is_slot(kind: Any) -> bool:
    """Whether it is a protocol that parts are registered for."""
    return isinstance(kind, type) and getattr(kind, "_is_protocol", False) and bool(parts(kind))


def parts(slot: type) -> dict[str, type]:
    """The parts of a slot by name, in alphabetical order, those of other packages with them."""
    _load_folder(slot.__module__.rpartition(".")[0])
    _load_others()
    return dict(sorted(_parts.get(slot, {}).items()))


def default_part(slot: type) -> str | None:
    """Name of the part that is meant where none is named; None where one has to be."""
    names = parts(slot)
    return _defaults.get(slot, next(iter(names)) if len(names) == 1 else None)


def slots() -> tuple[type, ...]:
    """All slots that have parts."""
    _load_others()
    return tuple(_parts)


@cache
def _load_folder(package: str) -> None:
    """Import every file of the folder of a slot, once."""
    if package:
        for module in pkgutil.iter_modules(importlib.import_module(package).__path__):
            if not module.name.startswith("__"):
                importlib.import_module(f"{package}.{module.name}")


@cache
def _load_others() -> None:
    """Import the parts of other packages, once; one that is broken raises with its name."""
    for entry in entry_points(group=GROUP):
        try:
            entry.load()
        except Exception as error:
            raise PartError(f"the parts {entry.name} ({entry.value}) cannot be loaded: {error}") from error


def require_contract(made: type, slot: type) -> None:
    """Raise PartError where a class does not do what its slot asks, naming method and signature.

    Methods that the slot leaves to its parts (`abstractmethod`) have to be there; the others may be inherited.
    """
    for name, asked in vars(slot).items():
        if name.startswith("_") or not (inspect.isfunction(asked) or isinstance(asked, property)):
            continue
        given = inspect.getattr_static(made, name, None)
        declared = given is not None or name in getattr(made, "__dataclass_fields__", {})
        if not declared or (given is asked and getattr(asked, "__isabstractmethod__", False)):
            what = str(inspect.signature(asked)) if inspect.isfunction(asked) else ""
            raise PartError(f"{made.__name__} is no {slot.__name__}: it lacks {name}{what}")
        if inspect.isfunction(asked):
            _require_signature(made, slot, name, asked)
    for name in vars(slot).get("__annotations__", {}):
        if not (hasattr(made, name) or name in getattr(made, "__dataclass_fields__", {})):
            raise PartError(f"{made.__name__} is no {slot.__name__}: it does not declare {name}")


def _require_signature(made: type, slot: type, name: str, asked: Callable[..., Any]) -> None:
    given = getattr(made, name)
    if not callable(given) or name in getattr(made, "__dataclass_fields__", {}):
        raise PartError(f"{made.__name__} is no {slot.__name__}: {name} is no method")
    wanted, found = inspect.signature(asked).parameters, inspect.signature(given).parameters
    open_ended = [any(value.kind in OPEN_ENDED for value in those.values()) for those in (wanted, found)]
    extra = [key for key, value in found.items() if key not in wanted and value.default is value.empty]
    missing = [key for key in wanted if key not in found]
    if (missing or extra) and not any(open_ended):
        raise PartError(
            f"{made.__name__} is no {slot.__name__}: {name}{inspect.signature(given)} should take "
            f"{inspect.signature(asked)}"
        )
