"""What a tuned actuator has to do, and in which corners: read from a file."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated

from annotated_types import Ge, Gt, Le, Unit

from actuator.actuator import Actuator
from gear.quantities import check
from studies.cases import Case, load_case
from studies.corners import AS_IS, Corner, CornerSettings, Setting, find_corner, select
from studies.files import CaseError, CaseFile, StudyError, read
from studies.structure import structure

SPREADS = ("uniform", "normal")


class Criterion(StrEnum):
    """What is demanded, or bounds a demand."""

    GAIN_MARGIN = "gain margin"
    PHASE_MARGIN = "phase margin"
    DELAY_MARGIN = "delay margin"
    BANDWIDTH = "bandwidth"
    OVERSHOOT = "overshoot"
    STIFFNESS = "stiffness"
    PEAK_CURRENT = "peak current"
    PEAK_TORQUE = "peak torque"
    SLIP = "slip"
    STANDING_ERROR = "standing error"
    GAIN_RANGE = "gain range"

    @property
    def upper(self) -> bool:
        """Whether its limit is the largest value."""
        return self in (Criterion.OVERSHOOT, Criterion.PEAK_CURRENT, Criterion.PEAK_TORQUE, Criterion.SLIP)


@dataclass(frozen=True, kw_only=True)
class Demand:
    """Demands, to be met in every corner.

    Parameters
    ----------
    stroke : float
        Travel of the load from end to end [rad].
    amplitude : float
        Amplitude of the sine for the bandwidth and of the step for current and overshoot, over the stroke [-].
    bandwidth : float
        Frequency [Hz] up to which the load follows a sine of that amplitude within 3 dB, friction included.
    gain_margin, phase_margin : float
        Margins of the loops opened at speed reference and torque reference, in every mode [-], [rad]; the gain margin
        holds for increased and for reduced gain.
    delay_margin : float
        Delay [s] that the same loops tolerate: for all that is not modeled, including sampling where the controller is
        in continuous time.
    overshoot : float
        Overshoot of a step of the amplitude [-].
    stiffness : float
        Least load torque over load angle [N m/rad] at any frequency.
    peak_current, peak_torque : float or None
        Peak of the motor in a step of the amplitude [A], [N m]; None for no limit. A motor without electric part has
        no current.
    standing_error : float
        Largest position error at rest [rad].
    stiction_margin : float
        Factor on all breakaway friction up to which the actuator does not hunt [-].
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
        """Amplitude at the load [rad]."""
        return self.amplitude * self.stroke


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """What may be changed.

    Parameters
    ----------
    gains : tuple of str
        Names of parameters.
    dead_band : bool
        Whether the integral may be given a dead band.
    range : float
        Largest factor by which a gain may differ from the closed-form start, either way [-].
    """

    gains: tuple[str, ...]
    dead_band: bool = False
    range: Annotated[float, Unit("-"), Gt(1)] = 30.0

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class Change:
    """What an entry of an axis changes: factors on parameters and their values, by names as of `studies.corners`."""

    factors: Mapping[str, float] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)

    def settings(self) -> list[Setting]:
        """The factors, then the values."""
        factors = [Setting(name, factor, factor=True) for name, factor in self.factors.items()]
        return factors + [Setting(name, value, factor=False) for name, value in self.values.items()]


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Tolerance of a parameter, relative to its nominal value.

    Parameters
    ----------
    parameter : str
        Name as of `studies.corners`; several parameters spread together.
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
        Axes with their entries; every combination is a corner.
    tolerances : tuple of Tolerance
        Production tolerances, for the robustness study.
    """

    title: str
    case: str
    demand: Demand
    tuning: Tuning
    corners: Mapping[str, Mapping[str, Change]] = field(default_factory=dict)
    tolerances: tuple[Tolerance, ...] = ()

    def all_corners(self, plant: Actuator) -> list[Corner]:
        """Every combination of the axes, for an actuator; as it is where there are none.

        Raises
        ------
        StudyError
            Where it has no such parameter, or a value breaks a rule of its component.
        """
        system, found = plant.system(), []
        for entries in itertools.product(*(axis.items() for axis in self.corners.values())):
            name = ", ".join(name for name, _ in entries) or AS_IS
            settings = tuple(setting for _, change in entries for setting in change.settings())
            found.append(find_corner(system, CornerSettings(name, settings)))
        return found


def built_in_specifications() -> dict[str, Traversable]:
    """The specifications of this package, by the names of their cases."""
    folder = resources.files("studies") / "data" / "specifications"
    found = {file.name.removesuffix(".toml"): file for file in folder.iterdir() if file.name.endswith(".toml")}
    return dict(sorted(found.items()))


def load_specification(name: str | Path) -> tuple[Specification, Case]:
    """Read a built-in specification by name, or a file; with its case.

    Raises
    ------
    CaseError
        For anything wrong with either file; one line with the key, the value and what is allowed.
    """
    file = built_in_specifications().get(str(name))
    if file is None and not Path(name).exists():
        names = ", ".join(built_in_specifications())
        raise CaseError(f"{name}: no such specification; the built-in ones are {names}")
    source: CaseFile = read(file or Path(name).resolve())
    specification: Specification = structure(source, (), Specification)
    at = (
        specification.case
        if file or not specification.case.endswith(".toml")
        else Path(name).parent / specification.case
    )
    case = load_case(at)
    parameters = case.actuator.system().parameters
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
            select(parameters, pattern, factor=True)
        except StudyError as error:
            raise source.error(where, f"does not fit {case.name}: {error}") from None
    return specification, case
