"""What a frequency-response study measures: sines, corners and bias loads, and on which actuators."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from actuator import Actuator, temperature_sets
from actuator.system.parameters import with_values
from studies.cases import Case, built_in, load_case
from studies.corners import AS_IS, CornerSettings, find_corner, read_corners
from studies.files import StudyError, built_in_files, locate, read
from studies.frequency.bench import TESTS
from studies.frequency.mask import Mask
from studies.specification import Specification, built_in_specifications, load_specification
from studies.tuning.plant import add_dead_band
from studies.tuning.result import read_tuned_gains

PARTS = (0.1, 0.2, 0.4)  # of the largest torque, in the sines of torque on the load
EVERY = 2  # frequencies of the reference per frequency of the torque
AXIS = "temperature"  # of the corners of a specification
TEMPERATURES = (218.15, 293.15, 343.15)  # K, of oils
TUNING = ".json"  # suffix of the result of a tuning


class Place(NamedTuple):
    """A corner by its name, with a bias load [N m]."""

    corner: str
    bias: float


@dataclass(frozen=True, kw_only=True)
class Corners:
    """Sets of parameters by name, for any actuator that has the parameters.

    Parameters
    ----------
    given : tuple of CornerSettings or None
        Those asked for; None for temperatures: of the specification, else of oils.
    specification : Specification or None
        Its axis `temperature`, where it has one.
    """

    given: tuple[CornerSettings, ...] | None = None
    specification: Specification | None = field(default=None, repr=False)

    def sets_of(self, actuator: Actuator) -> dict[str, dict[str, float]]:
        """Parameters by name of the corner; the first is the actuator as it is.

        Raises
        ------
        StudyError
            Where it has no such parameter, or the value breaks a rule.
        """
        defaults = {parameter.name: float(parameter.default) for parameter in actuator.system().parameters}
        try:
            found = self._sets(actuator)
        except StudyError as error:
            raise StudyError(f"corner {error}; choose others with --corner") from None
        same = [name for name, changes in found.items() if all(defaults[k] == value for k, value in changes.items())]
        first = same[0] if same else AS_IS
        return {first: {}} | {name: changes for name, changes in found.items() if name not in same}

    def _sets(self, actuator: Actuator) -> dict[str, dict[str, float]]:
        if self.given is not None:
            return dict(find_corner(actuator.system(), corner) for corner in self.given)
        if self.specification is not None and AXIS in self.specification.corners:
            only = replace(self.specification, corners={AXIS: self.specification.corners[AXIS]})
            return dict(only.all_corners(actuator))
        try:
            return temperature_sets(actuator, TEMPERATURES)
        except ValueError:  # no part depends on a temperature
            return {}


def choose_corners(case: str | Path, texts: Sequence[str]) -> Corners:
    """Corners from texts as of `read_corners`, or without any, temperatures for a case.

    Those are the temperatures of the built-in specification of the case, or of the nearest case that it is based on,
    else of its oils.

    Raises
    ------
    StudyError
        For a text that is not a corner, or a case that cannot be read.
    """
    return Corners(given=read_corners(texts)) if texts else Corners(specification=_find_specification(case))


def _find_specification(case: str | Path) -> Specification | None:
    files = built_in_files()
    for source in read(locate(case, Path())).sources:
        for name in built_in_specifications():
            if files.get(name) == source.file:
                return load_specification(name)[0]
    return None


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is measured, the same for every actuator of a comparison.

    Parameters
    ----------
    mask : Mask
        Limits of the response; its amplitudes are measured too.
    stroke : float
        Travel of the load from end to end [rad].
    amplitudes : tuple of float
        Amplitudes of the reference sines, over the stroke [-].
    frequencies : tuple of float
        [Hz].
    torque : float or None
        Largest torque on the load in stiffness and bench tests [N m]; None for the motor's largest, at the load.
    corners : Corners
        Sets of parameters for the reference sines, besides the actuator as it is.
    biases : tuple of float
        Bias loads for the reference sines, besides none [N m].
    """

    mask: Mask
    stroke: float
    amplitudes: tuple[float, ...]
    frequencies: tuple[float, ...]
    torque: float | None = None
    corners: Corners = field(default_factory=Corners)
    biases: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        wrong = [f"{100 * value:g} %" for value in self.amplitudes if not 0 < value <= 0.5]  # noqa: PLR2004 - half
        if not self.amplitudes or wrong:
            raise StudyError(
                f"amplitudes must be > 0 and <= 50 % of the stroke, at least one, got {', '.join(wrong) or 'none'}"
            )
        if not self.frequencies or min(self.frequencies) <= 0:
            raise StudyError(f"at least one frequency is needed, each > 0 Hz, got {list(self.frequencies)}")
        if not all(map(math.isfinite, self.biases)):
            raise StudyError(f"bias loads are numbers in N m, got {', '.join(map(str, self.biases))}")
        for k, limit in enumerate(self.mask.limits):
            low, high = limit.frequencies[0], limit.frequencies[-1]
            if not any(low <= frequency <= high for frequency in self.frequencies):
                raise StudyError(
                    f"no frequency is within limit {k + 1} of the mask, {low:g} to {high:g} Hz; choose other "
                    "--frequencies or another mask"
                )

    @property
    def all_amplitudes(self) -> tuple[float, ...]:
        """The amplitudes and those of the mask, ascending."""
        return tuple(sorted({*self.amplitudes, *(limit.amplitude for limit in self.mask.limits)}))

    @property
    def all_biases(self) -> tuple[float, ...]:
        """Zero first, then the bias loads [N m]."""
        return tuple(dict.fromkeys((0.0, *self.biases)))

    @property
    def torque_frequencies(self) -> tuple[float, ...]:
        """Frequencies of the torque on the load [Hz]."""
        return tuple(sorted(self.frequencies)[::EVERY])

    @property
    def threshold_frequencies(self) -> tuple[float, ...]:
        """The lowest, the middle and the highest [Hz]."""
        ordered = sorted(self.frequencies)
        return tuple(dict.fromkeys((ordered[0], ordered[len(ordered) // 2], ordered[-1])))

    def places(self, actuator: Actuator) -> list[Place]:
        """Every corner with every bias load; the first is the actuator as it is."""
        return [Place(corner, bias) for bias in self.all_biases for corner in self.corners.sets_of(actuator)]

    def sines(self, actuator: Actuator) -> int:
        """Number of reference sines for one actuator."""
        return len(self.places(actuator)) * len(self.all_amplitudes) * len(self.frequencies)

    def points(self, actuator: Actuator) -> int:
        """Number of points computed for one actuator."""
        return self.sines(actuator) + 2 * len(PARTS) * len(self.torque_frequencies) + len(TESTS)


def load_positioner(case: str | Path) -> Case:
    """Load a case with a position controller.

    Raises
    ------
    StudyError
        For a file that cannot be read, or a case without one.
    """
    loaded = load_case(case)
    if "reference" not in [quantity.name for quantity in loaded.actuator.system().inputs]:
        raise StudyError(
            f"{loaded.name} has no position controller, hence no response to a reference; choose another case"
        )
    return loaded


def locate_case(name: str) -> str | Path:
    """The name of a built-in case, or a path, for `load_case`."""
    return name if name in built_in() else Path(name)


def load_second(name: str, first: Case) -> Case:
    """Load a case by name or path, or the first case with the gains in the result.json of a tuning.

    Raises
    ------
    StudyError
        For a file that cannot be read or is neither; for a case that lacks such gains, or is the first again.
    """
    if not name.endswith(TUNING):
        other = load_positioner(locate_case(name))
        if other.name == first.name:
            raise StudyError(f"both cases are called {first.name}; choose another case for --against")
        return other
    label = f"{first.name}-tuned"
    try:
        plant = add_dead_band(first.actuator)
        gains = read_tuned_gains(Path(name), plant)
        controller = with_values(plant.controller, "controller", gains.values)
    except StudyError:
        raise
    except ValueError as error:  # a gain that breaks a rule
        raise StudyError(f"{name}: {error}") from None
    actuator = replace(first.actuator, controller=controller, name=label)
    return replace(first, name=label, title=f"{first.title}, {gains.label}", actuator=actuator)
