"""What a frequency-response study measures, the same for every actuator that is laid beside another."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

from actuator import Actuator
from actuator.system.parameters import with_values
from studies.cases import Case, built_in, load_case
from studies.files import CaseError
from studies.frequency.bench import TESTS
from studies.frequency.corners import Corners, Place, WrongRequest
from studies.frequency.mask import Mask
from studies.tuning.plant import dead_banded
from studies.tuning.tuned_gains import tuned_gains

PARTS = (0.1, 0.2, 0.4)  # of the largest torque, in the sines of torque on the load
EVERY = 2  # so many frequencies of the reference to one of the torque


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is measured.

    Parameters
    ----------
    mask : Mask
        What the response has to keep to; its amplitudes are measured too.
    stroke : float
        From end to end [rad].
    amplitudes : tuple of float
        Of the sines of the reference, over the stroke [-].
    frequencies : tuple of float
        [Hz].
    torque : float or None
        Largest on the load in stiffness and bench tests [N m]; None for what the motor has at most, at the load.
    corners : Corners
        Sets of parameters with which the sines of the reference run, besides the actuator as it is.
    biases : tuple of float
        Bias loads with which they run, besides none [N m].
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
            raise WrongRequest(
                f"amplitudes are > 0 and at most 50 % of the stroke, and at least one, got {', '.join(wrong) or 'none'}"
            )
        if not self.frequencies or min(self.frequencies) <= 0:
            raise WrongRequest(f"frequencies are > 0 Hz, and at least one, got {list(self.frequencies)}")
        if not all(map(math.isfinite, self.biases)):
            raise WrongRequest(f"bias loads are numbers in N m, got {', '.join(map(str, self.biases))}")
        for k, limit in enumerate(self.mask.limits):
            low, high = limit.frequencies[0], limit.frequencies[-1]
            if not any(low <= frequency <= high for frequency in self.frequencies):
                raise WrongRequest(
                    f"no frequency is within limit {k + 1} of the mask, {low:g} to {high:g} Hz; choose others with "
                    "--frequencies, or another mask"
                )

    @property
    def all_amplitudes(self) -> tuple[float, ...]:
        """Those asked for and those of the mask, ascending."""
        return tuple(sorted({*self.amplitudes, *(limit.amplitude for limit in self.mask.limits)}))

    @property
    def all_biases(self) -> tuple[float, ...]:
        """None first, then those asked for [N m]."""
        return tuple(dict.fromkeys((0.0, *self.biases)))

    @property
    def torque_frequencies(self) -> tuple[float, ...]:
        """Of the torque on the load [Hz]."""
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
        """Sines of the reference."""
        return len(self.places(actuator)) * len(self.all_amplitudes) * len(self.frequencies)

    def points(self, actuator: Actuator) -> int:
        """That are computed for one actuator."""
        return self.sines(actuator) + 2 * len(PARTS) * len(self.torque_frequencies) + len(TESTS)


TUNING = ".json"  # ending of the result of a tuning


def load_positioner(case: str | Path) -> Case:
    """A case with a position controller.

    Raises
    ------
    CaseError, WrongRequest
        For a file that cannot be read; for a case without one.
    """
    loaded = load_case(case)
    if "reference" not in [quantity.name for quantity in loaded.actuator.system().inputs]:
        raise WrongRequest(
            f"{loaded.name}: has no position controller, so no response to a reference; choose another case"
        )
    return loaded


def source_of(name: str) -> str | Path:
    """A case as `load_case` takes it."""
    return name if name in built_in() else Path(name)


def second(name: str, first: Case) -> Case:
    """A case by name or path, or the first with the gains in the result.json of a tuning.

    Raises
    ------
    CaseError, WrongRequest
        For a file that cannot be read or is neither; for a case that has no such gains, or is the first again.
    """
    if not name.endswith(TUNING):
        other = load_positioner(source_of(name))
        if other.name == first.name:
            raise WrongRequest(f"both cases are called {first.name}; a case is not laid beside itself")
        return other
    label = f"{first.name}-tuned"
    try:
        plant = dead_banded(first.actuator)
        gains = tuned_gains(Path(name), plant)
        controller = with_values(plant.controller, "controller", gains.values)
    except CaseError:
        raise
    except ValueError as error:  # an actuator that is not one to be tuned, or a gain that breaks a rule
        raise WrongRequest(f"{name}: {error}") from None
    actuator = replace(first.actuator, controller=controller, name=label)
    return replace(first, name=label, title=f"{first.title}, {gains.words}", actuator=actuator)
