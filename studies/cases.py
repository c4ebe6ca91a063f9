"""Cases: an actuator with a scenario to run it through, built in or from a file."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Gt, Unit

from actuator.actuator import Actuator
from actuator.parts.current_source import CurrentSource
from actuator.parts.dc_link import DCLink
from actuator.parts.inverter import Inverter
from actuator.parts.linear_load import LinearLoad
from actuator.parts.load import Load
from actuator.parts.motor import PMSM, DCMotor, TorqueSource
from actuator.parts.sensors import Sensors
from actuator.parts.thermal import ThermalNetwork
from actuator.simulation.signals import Signal
from controllers.cascade import Cascade
from controllers.pid import PID
from controllers.sampling import Sampling
from gear.quantities import check, require_known
from gear.transmission import Transmission
from studies.converter import SIGNALS
from studies.files import CaseFile, built_in_files, locate, read
from studies.structure import structure


@dataclass(frozen=True, kw_only=True)
class Case:
    """An actuator and what it is put through.

    Parameters
    ----------
    name : str
        Of the built-in case, or of the file without `.toml`.
    title : str
        One line for reports.
    description : str
        What it is, in a paragraph.
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


@dataclass(frozen=True, kw_only=True)
class Document:
    """The top level of a case file; the fields in the middle are those of Actuator."""

    title: str
    description: str = ""
    motor: TorqueSource | CurrentSource | DCMotor | PMSM
    inverter: Inverter | None = None
    link: DCLink | None = None
    gear: Transmission
    load: Load | LinearLoad = field(default_factory=Load)
    controller: PID | Cascade | None = None
    sampling: Sampling | None = None
    sensors: Sensors = field(default_factory=Sensors)
    thermal: ThermalNetwork | None = None
    scenario: Scenario

    def actuator(self, name: str) -> Actuator:
        """The parts as one actuator; ValueError where they do not go together."""
        parts = {part.name: getattr(self, part.name) for part in fields(Actuator) if part.name != "name"}
        return Actuator(name=name, **parts)


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
    document: Document = structure(file, (), Document)
    try:
        actuator = document.actuator(name)
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
        signals[name] = structure(file, steps, SIGNALS, units[name])
    return signals
