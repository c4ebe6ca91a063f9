"""Where a frequency response is measured: temperatures and other sets of parameters, each with every bias load."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from actuator import Actuator, temperature_sets
from studies.corners import Setting, parameters_of, setting_of
from studies.files import built_in_files, locate, read
from studies.specification import Specification, built_in_specifications, load_specification

AS_IS = "as it is"
AXIS = "temperature"  # of the corners of a specification
TEMPERATURES = (218.15, 293.15, 343.15)  # K, of oils


class WrongRequest(ValueError):
    """A study that cannot be made; the message is one line."""


class Place(NamedTuple):
    """A corner by its name, with a bias load [N m]."""

    corner: str
    bias: float


@dataclass(frozen=True, kw_only=True)
class Corners:
    """Sets of parameters by name, for any actuator that has the parameters.

    Parameters
    ----------
    given : mapping of str to sequence of Setting
        Those that are asked for; None for the temperatures: of the specification, else of what has an oil.
    specification : Specification or None
        Its axis `temperature`, where it has one.
    """

    given: Mapping[str, Sequence[Setting]] | None = None
    specification: Specification | None = field(default=None, repr=False)

    def sets_of(self, actuator: Actuator) -> dict[str, dict[str, float]]:
        """Parameters by name of the corner; the first is the actuator as it is.

        Raises
        ------
        WrongRequest
            Where it has no such parameter, or the value breaks a rule.
        """
        system = actuator.system()
        defaults = {parameter.name: float(parameter.default) for parameter in system.parameters}
        try:
            found = self._sets(actuator)
            for changes in found.values():
                system.parameter_values(changes)
        except (KeyError, ValueError) as error:
            raise WrongRequest(f"corner: {error.args[0]}; choose others with --corner") from None
        same = [name for name, changes in found.items() if all(defaults[k] == value for k, value in changes.items())]
        first = same[0] if same else AS_IS
        return {first: {}} | {name: changes for name, changes in found.items() if name not in same}

    def _sets(self, actuator: Actuator) -> dict[str, dict[str, float]]:
        if self.given is not None:
            return {name: parameters_of(actuator.system(), settings) for name, settings in self.given.items()}
        if self.specification is not None and AXIS in self.specification.corners:
            only = replace(self.specification, corners={AXIS: self.specification.corners[AXIS]})
            return {corner.name: corner.parameters for corner in only.all_corners(actuator)}
        try:
            return temperature_sets(actuator, TEMPERATURES)
        except ValueError:  # nothing in it knows a temperature
            return {}


def corners_of(case: str | Path, texts: Sequence[str]) -> Corners:
    """Corners from what stands on the command line, each "[LABEL:] NAME=VALUE,..." or "as it is".

    Without any, they are the temperatures of the case: those of the built-in specification of it, or of the nearest
    case that it is based on, else of its oils.

    Raises
    ------
    WrongRequest
        For a text that is none of these.
    CaseError
        For a case that cannot be read.
    """
    if not texts:
        return Corners(specification=_specification_of(case))
    found: dict[str, Sequence[Setting]] = {}
    for text in texts:
        if text.strip() == AS_IS:
            continue
        label, _, rest = text.rpartition(":")
        try:
            settings = [setting_of(part) for part in rest.split(",")]
        except ValueError as error:
            raise WrongRequest(str(error)) from None
        name = label.strip() or ", ".join(f"{setting.name}={setting.value:g}" for setting in settings)
        if name in (AS_IS, *found):
            raise WrongRequest(f"two corners are called {name!r}; give each a name of its own, NAME: ...")
        found[name] = settings
    return Corners(given=found)


def _specification_of(case: str | Path) -> Specification | None:
    files = built_in_files()
    for source in read(locate(case, Path())).sources:
        for name in built_in_specifications():
            if files.get(name) == source.file:
                return load_specification(name)[0]
    return None
