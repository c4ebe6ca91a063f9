"""Cases: an actuator with a scenario, built in or from a file."""

from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Gt, Unit

from actuator.actuator import Actuator
from actuator.simulation.signals import Signal
from gear.quantities import check, require_known
from studies.files import CaseFile, built_in_files, locate, read
from studies.structure import structure


@dataclass(frozen=True, kw_only=True)
class Case:
    """An actuator with a scenario.

    Parameters
    ----------
    name : str
        Of the built-in case, or of the file without `.toml`.
    title : str
        One line for reports.
    description : str
        A paragraph for reports.
    actuator : Actuator
        What is simulated.
    duration : float
        Of the scenario [s].
    inputs : mapping of str to Signal
        By name of the input; the others are zero.
    """

    name: str
    title: str
    description: str
    actuator: Actuator
    duration: float
    inputs: Mapping[str, Signal]


def _again(part: Field) -> Any:
    """A field with the same default."""
    return field(default=part.default, default_factory=part.default_factory)


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """The table `[scenario]`; the signals are made once the units of the inputs are known.

    Parameters
    ----------
    duration : float
        [s].
    inputs : mapping of str to mapping
        Tables of signals by name of the input.
    """

    duration: Annotated[float, Unit("s"), Gt(0)]
    inputs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check(self)


PARTS = tuple(part for part in fields(Actuator) if part.name != "name")
Document: Any = make_dataclass(  # the top level of a case file: the fields of Actuator in the middle
    "Document",
    [
        ("title", str),
        ("description", str, field(default="")),
        *((part.name, part.type, _again(part)) for part in PARTS),
        ("scenario", Scenario),
    ],
    frozen=True,
    kw_only=True,
)


def built_in() -> list[str]:
    """Names of the cases that come with the package."""
    return list(built_in_files())


def load_case(case: str | Path) -> Case:
    """Read a built-in case by its name, or a file by its path.

    Raises
    ------
    CaseError
        For anything wrong with the file; one line with the key, the value and what is allowed.
    """
    source = locate(case, Path())
    file = read(source)
    name = source.name.removesuffix(".toml")
    document = structure(file, (), Document)
    try:
        actuator = Actuator(name=name, **{part.name: getattr(document, part.name) for part in PARTS})
    except ValueError as error:
        raise file.error((), str(error)) from None
    return Case(
        name=name,
        title=document.title,
        description=document.description.strip(),
        actuator=actuator,
        duration=document.scenario.duration,
        inputs=_signals(file, actuator, document.scenario),
    )


def _signals(file: CaseFile, actuator: Actuator, scenario: Scenario) -> dict[str, Signal]:
    units = {quantity.name: quantity.unit for quantity in actuator.system().inputs}
    signals = {}
    for name in scenario.inputs:
        steps = ("scenario", "inputs", name)
        try:
            require_known([name], units, "input")
        except KeyError as error:
            raise file.error(steps, f"is not allowed: {error.args[0]}") from None
        signals[name] = structure(file, steps, Signal, units[name])
    return signals
