"""What is laid beside an actuator: another case, or the same with the gains of a tuning."""

from dataclasses import replace
from pathlib import Path

from actuator.system.parameters import with_values
from studies.cases import Case, built_in, load_case
from studies.files import CaseError
from studies.frequency.corners import WrongRequest
from studies.tuning.plant import dead_banded
from studies.tuning.tuned_gains import tuned_gains

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
