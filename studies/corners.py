"""Names of what a map varies: one parameter, or many together.

    controller.speed.integral       the value of one parameter
    *.friction.static               a factor on every parameter of that pattern
    *.breakaway+*.static            a factor on all of several patterns
    =*.temperature                  one value for every parameter of that pattern

A factor does not take breakaway friction below the sliding friction of its contact.
"""

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from actuator.stiction.margins import at_least_sliding
from actuator.system.hybrid import HybridSystem
from gear.quantities import require_known

FACTOR_UNIT = "-"


class Setting(NamedTuple):
    """A name with its value."""

    name: str
    value: float


def setting_of(text: str) -> Setting:
    """The setting that stands in a text NAME=VALUE.

    Raises
    ------
    ValueError
        For another text.
    """
    name, _, value = text.rpartition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (name.strip() and math.isfinite(number)):
        raise ValueError(f"a corner is NAME=VALUE,NAME=VALUE with numbers, got {text!r}")
    return Setting(name.strip(), number)


class Meaning(NamedTuple):
    """What a name stands for: the parameters, whether its value is a factor on them, and its unit."""

    parameters: tuple[str, ...]
    factor: bool
    unit: str

    @property
    def single(self) -> bool:
        """Whether it is the value of one parameter."""
        return not self.factor and len(self.parameters) == 1


def meaning(system: HybridSystem, name: str) -> Meaning:
    """What a name stands for.

    Raises
    ------
    KeyError
        Where no parameter has it (the nearest names are given).
    """
    units = {parameter.name: parameter.unit for parameter in system.parameters}
    factor = "*" in name and not name.startswith("=")
    found: list[str] = []
    for pattern in name.removeprefix("=").split("+"):
        if "*" not in pattern:
            require_known([pattern], units, "parameter")
        matches = [each for each in units if fnmatchcase(each, pattern)]
        if not matches:
            raise KeyError(f"no parameter of {system.name} is of the pattern {pattern!r}; they are {', '.join(units)}")
        found += [each for each in matches if each not in found]
    kinds = sorted({units[each] for each in found})
    if not factor and len(kinds) > 1:
        raise KeyError(f"{name!r} stands for parameters of different units, {', '.join(kinds)}; give one name each")
    return Meaning(tuple(found), factor, FACTOR_UNIT if factor else kinds[0])


def parameters_of(system: HybridSystem, settings: Sequence[Setting]) -> dict[str, float]:
    """Parameters by name from settings, applied one after another: a factor is on what the ones before have set."""
    defaults = {parameter.name: float(parameter.default) for parameter in system.parameters}
    found: dict[str, float] = {}
    for name, value in settings:
        stands_for = meaning(system, name)
        for each in stands_for.parameters:
            before = found.get(each, defaults[each])
            found[each] = at_least_sliding(each, value * before, defaults | found) if stands_for.factor else value
    return found
