"""Corners: sets of parameters by name, how they are written, and what they are for an actuator.

    controller.speed.integral       the value of one parameter
    *.friction.static               a factor on every parameter that matches
    *.coulomb+*.sliding             a factor on every parameter that matches one of several patterns
    =*.temperature                  one value for every parameter that matches
    breakaway                       a factor on every parameter that has this role, whatever its name

Settings are applied one after another: a factor is on what those before have set. Breakaway friction does not fall
below the sliding friction of its contact by a factor on either.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from actuator.system.hybrid import HybridSystem
from actuator.system.parameters import Parameter, breakaway_floor, motion_integrals
from gear.quantities import require_known
from gear.quantities.roles import Breakaway, Gap, Role, SlidingFriction
from studies.files import StudyError

AS_IS = "as it is"
FACTOR_UNIT = "-"


def _having(role: type[Role]) -> Callable[[Iterable[Parameter]], list[Parameter]]:
    return lambda parameters: [each for each in parameters if each.role(role) is not None]


ROLES: dict[str, Callable[[Iterable[Parameter]], Sequence[Parameter]]] = {
    "breakaway": _having(Breakaway),
    "sliding": _having(SlidingFriction),
    "backlash": _having(Gap),
    "integral": motion_integrals,
}


class Setting(NamedTuple):
    """A name with its value; `factor` is None where the name says whether the value is a factor."""

    name: str
    value: float
    factor: bool | None = None


class CornerSettings(NamedTuple):
    """A corner as it is written, for any actuator that has the parameters."""

    name: str
    settings: tuple[Setting, ...] = ()


class Corner(NamedTuple):
    """A corner of one actuator: a name, and the parameters that differ."""

    name: str
    parameters: dict[str, float]


class Selection(NamedTuple):
    """The parameters that a name stands for, whether its value is a factor on them, and its unit."""

    parameters: tuple[str, ...]
    factor: bool
    unit: str

    @property
    def single(self) -> bool:
        """Whether it is the value of one parameter."""
        return not self.factor and len(self.parameters) == 1


def read_setting(text: str) -> Setting:
    """The setting in a text NAME=VALUE; StudyError for another text."""
    name, _, value = text.rpartition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (name.strip() and math.isfinite(number)):
        raise StudyError(f"a corner is NAME=VALUE,NAME=VALUE with numbers, got {text!r}")
    return Setting(name.strip(), number)


def read_corners(texts: Iterable[str]) -> tuple[CornerSettings, ...]:
    """Corners from texts "[LABEL:] NAME=VALUE,..." or "as it is".

    Raises
    ------
    StudyError
        For a text that is neither, and where two corners have one name.
    """
    found: list[CornerSettings] = []
    for text in texts:
        if text.strip() == AS_IS:
            corner = CornerSettings(AS_IS)
        else:
            label, _, rest = text.rpartition(":")
            settings = tuple(read_setting(part) for part in rest.split(","))
            named = label.strip() or ", ".join(f"{setting.name}={setting.value:g}" for setting in settings)
            corner = CornerSettings(named, settings)
        if corner.name in [other.name for other in found] or (corner.settings and corner.name == AS_IS):
            raise StudyError(f"two corners are called {corner.name!r}; give each a name of its own, NAME: ...")
        found.append(corner)
    return tuple(found)


def select(parameters: Sequence[Parameter], name: str, factor: bool | None = None) -> Selection:
    """The parameters that a name stands for.

    Raises
    ------
    StudyError
        Where there is none (with the nearest names), or they would get one value in different units.
    """
    if factor is None:
        factor = name in ROLES or ("*" in name and not name.startswith("="))
    known = {parameter.name: parameter.unit for parameter in parameters}
    found: dict[str, None] = {}
    for part in name.removeprefix("=").split("+"):
        found |= dict.fromkeys(_matching(parameters, known, part))
    units = sorted({known[each] for each in found})
    if not factor and len(units) > 1:
        raise StudyError(f"{name!r} stands for parameters of different units, {', '.join(units)}; give one name each")
    return Selection(tuple(found), factor, FACTOR_UNIT if factor else units[0])


def _matching(parameters: Sequence[Parameter], known: Mapping[str, str], part: str) -> list[str]:
    """Names of the parameters that have a role, match a pattern, or are called so."""
    if part in ROLES:
        having = [parameter.name for parameter in ROLES[part](parameters)]
        if not having:
            raise StudyError(f"no parameter has the role {part!r}")
        return having
    if "*" not in part:
        try:
            require_known([part], known, "parameter")
        except KeyError as error:
            raise StudyError(error.args[0]) from None
        return [part]
    matching = [name for name in known if fnmatchcase(name, part)]
    if not matching:
        raise StudyError(f"no parameter matches {part!r}; the parameters are {', '.join(known)}")
    return matching


def apply_settings(
    parameters: Sequence[Parameter], settings: Iterable[Setting], values: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Parameters that differ from `values` (default: those of the model) by settings applied one after another.

    Raises
    ------
    StudyError
        As of `select`.
    """
    before = {parameter.name: float(parameter.default) for parameter in parameters} | dict(values or {})
    found: dict[str, float] = {}
    scaled: dict[str, bool] = {}
    for setting in settings:
        selection = select(parameters, setting.name, setting.factor)
        for name in selection.parameters:
            found[name] = setting.value * found.get(name, before[name]) if selection.factor else setting.value
            scaled[name] = selection.factor
    # a value that is set breaks the rule or keeps it; a factor ends there
    by_factors = before | {name: value for name, value in found.items() if scaled[name]}
    for parameter in parameters:
        name = parameter.name
        if parameter.role(Breakaway) is None or not scaled.get(name, True):
            continue
        floor = breakaway_floor(parameter, before | found if name in found else by_factors)
        if floor is not None and by_factors[name] < floor:
            found[name] = floor
    return found


def find_corner(system: HybridSystem, corner: CornerSettings) -> Corner:
    """A corner of one actuator.

    Raises
    ------
    StudyError
        Where it has no such parameter, or a value breaks a rule of its component.
    """
    found = apply_settings(system.parameters, corner.settings)
    try:
        system.parameter_values(found)
    except ValueError as error:
        raise StudyError(f"{corner.name}: {error}") from None
    return Corner(corner.name, found)
