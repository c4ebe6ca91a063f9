"""What a tuned actuator has to do, and the corners in which: read from a file."""

import fnmatch
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from annotated_types import Ge, Gt, Le, Unit

from actuator.actuator import Actuator
from gear.quantities import check
from studies.cases import Case, load_case
from studies.files import CaseError, CaseFile, read
from studies.structure import structure

SPREADS = ("uniform", "normal")


@dataclass(frozen=True, kw_only=True)
class Demand:
    """What is demanded in every corner.

    Parameters
    ----------
    stroke : float
        From end to end [rad].
    amplitude : float
        Of the sine for the bandwidth and of the step for the current [-], over the stroke.
    bandwidth : float
        Frequency [Hz] up to which the load follows a sine of that amplitude within 3 dB, friction and all.
    gain_margin, phase_margin : float
        Of the loops opened at speed reference and torque reference, in every mode [-], [rad]; the gain margin holds for
        gains that rise and gains that fall.
    delay_margin : float
        Of the same loops: what is not in the model may take [s], which with a controller in continuous time is sampling
        too.
    overshoot : float
        Of a step of the amplitude [-].
    stiffness : float
        Load torque over load angle [N m/rad] at the frequency at which that is least.
    peak_current, peak_torque : float or None
        Of the motor in a step of the amplitude [A], [N m]; None where it may be any. A motor without electric part has
        no current.
    standing_error : float
        Largest position error at which the actuator may come to rest [rad].
    stiction_margin : float
        Factor on all breakaway friction up to which nothing hunts [-].
    """

    stroke: Annotated[float, Unit("rad"), Gt(0)]
    amplitude: Annotated[float, Unit("-"), Gt(0), Le(1)] = 0.01
    bandwidth: Annotated[float, Unit("Hz"), Gt(0)]
    gain_margin: Annotated[float, Unit("-"), Ge(1)] = 2.0
    phase_margin: Annotated[float, Unit("rad"), Ge(0)] = 0.7
    delay_margin: Annotated[float, Unit("s"), Gt(0)] = 1e-3
    overshoot: Annotated[float, Unit("-"), Ge(0)] = 0.1
    stiffness: Annotated[float, Unit("N m/rad"), Gt(0)]
    peak_current: Annotated[float, Unit("A"), Gt(0)] | None = None
    peak_torque: Annotated[float, Unit("N m"), Gt(0)] | None = None
    standing_error: Annotated[float, Unit("rad"), Gt(0)]
    stiction_margin: Annotated[float, Unit("-"), Ge(1)] = 1.3

    def __post_init__(self) -> None:
        check(self)

    @property
    def sine(self) -> float:
        """The amplitude at the load [rad]."""
        return self.amplitude * self.stroke


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """What may be changed.

    Parameters
    ----------
    gains : tuple of str
        Names of parameters.
    dead_band : bool
        Whether the integral of the speed law may get a dead band.
    range : float
        Factor up and down from the closed-form start [-].
    """

    gains: tuple[str, ...]
    dead_band: bool = False
    range: Annotated[float, Unit("-"), Gt(1)] = 30.0

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class Change:
    """What a corner changes: factors on parameters and their values, by name or pattern (`gear.meshes.*.gap`)."""

    factors: Mapping[str, float] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """How a parameter spreads, over its nominal value.

    Parameters
    ----------
    parameter : str
        Name, or a pattern for several that spread together.
    spread : "uniform" or "normal"
        Uniform between 1 - size and 1 + size, or normal about 1 with this standard deviation.
    size : float
        [-].
    """

    parameter: str
    spread: str = "uniform"
    size: Annotated[float, Unit("-"), Gt(0), Le(1)]

    def __post_init__(self) -> None:
        check(self)
        if self.spread not in SPREADS:
            raise ValueError(f'Tolerance.spread must be "uniform" or "normal", got {self.spread!r}')


class Corner(NamedTuple):
    """A named set of parameters."""

    name: str
    parameters: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Specification:
    """A tuning task.

    Parameters
    ----------
    title : str
        One line for reports.
    case : str
        Built-in case or path of a case file.
    demand : Demand
        What is demanded.
    tuning : Tuning
        What may be changed.
    corners : mapping of str to mapping of str to Change
        Axes, and the entries of each; every combination is a corner.
    tolerances : tuple of Tolerance
        Of a production, for the study of robustness.
    """

    title: str
    case: str
    demand: Demand
    tuning: Tuning
    corners: Mapping[str, Mapping[str, Change]] = field(default_factory=dict)
    tolerances: tuple[Tolerance, ...] = ()

    def all_corners(self, plant: Actuator) -> list[Corner]:
        """Every combination of the axes; one without a name where there are none."""
        defaults = {parameter.name: float(parameter.default) for parameter in plant.system().parameters}
        found = []
        for entries in itertools.product(*(axis.items() for axis in self.corners.values())):
            values: dict[str, float] = {}
            for _, change in entries:
                for pattern, factor in change.factors.items():
                    for name in matching(pattern, defaults):
                        values[name] = factor * values.get(name, defaults[name])
                for pattern, value in change.values.items():
                    values |= dict.fromkeys(matching(pattern, defaults), value)
            found.append(Corner(", ".join(name for name, _ in entries) or "as it is", values))
        return found


def matching(pattern: str, names: Mapping[str, Any] | Sequence[str]) -> list[str]:
    """The names that a pattern fits; KeyError where there is none."""
    found = [name for name in names if fnmatch.fnmatchcase(name, pattern)]
    if not found:
        raise KeyError(f"no parameter fits {pattern!r}")
    return found


def built_in_specifications() -> dict[str, Traversable]:
    """The specifications that come with the package, by the name of their case."""
    folder = resources.files("studies") / "data" / "specifications"
    found = {file.name.removesuffix(".toml"): file for file in folder.iterdir() if file.name.endswith(".toml")}
    return dict(sorted(found.items()))


def load_specification(name: str | Path) -> tuple[Specification, Case]:
    """A built-in specification by name, else a file; with its case.

    Raises
    ------
    CaseError
        For anything wrong with either file; one line with the key, the value and what is allowed.
    """
    file = built_in_specifications().get(str(name))
    if file is None and not Path(name).exists():
        names = ", ".join(built_in_specifications())
        raise CaseError(f"{name}: there is no such specification; the built-in ones are {names}")
    source: CaseFile = read(file or Path(name).resolve())
    specification: Specification = structure(source, (), Specification)
    at = (
        specification.case
        if file or not specification.case.endswith(".toml")
        else Path(name).parent / specification.case
    )
    case = load_case(at)
    defaults = [parameter.name for parameter in case.actuator.system().parameters]
    steps: list[tuple[tuple[str | int, ...], str]] = [
        (("corners", axis, entry, kind), pattern)
        for axis, entries in specification.corners.items()
        for entry, change in entries.items()
        for kind in (part.name for part in fields(Change))
        for pattern in getattr(change, kind)
    ]
    steps += [(("tuning", "gains"), gain) for gain in specification.tuning.gains]
    steps += [(("tolerances", k), each.parameter) for k, each in enumerate(specification.tolerances)]
    for where, pattern in steps:
        try:
            matching(pattern, defaults)
        except KeyError as error:
            raise source.error(where, f"is refused: {error.args[0]} of {case.name}") from None
    return specification, case
