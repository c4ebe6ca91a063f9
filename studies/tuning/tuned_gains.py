"""The gains of a tuning, as its result.json has them, for other studies."""

import json
from pathlib import Path
from typing import NamedTuple

from actuator.actuator import Actuator
from studies.files import CaseError
from studies.tuning.plant import defaults_of


class TunedGains(NamedTuple):
    """Gains and dead band by name, with what they were tuned for."""

    values: dict[str, float]
    case: str
    path: Path

    @property
    def words(self) -> str:
        """Where they are from."""
        return f"gains of {self.path}, tuned for {self.case}"


def tuned_gains(path: Path, plant: Actuator) -> TunedGains:
    """Read them, for an actuator that has these parameters; it need not be the one that was tuned.

    Raises
    ------
    CaseError
        Where the file is no result of a tuning, or the actuator has no such parameter.
    """
    try:
        result = json.loads(path.read_bytes())
        values = {name: float(value) for name, value in result["gains"]["tuned"].items()}
        found = TunedGains(values, str(result["case"]), path)
    except OSError as error:
        raise CaseError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise CaseError(f"{path}: is no result.json of a tuning") from None
    known = defaults_of(plant.system().parameters)
    for name in found.values:
        if name not in known:
            raise CaseError(f"{path}: {name} is no parameter of {plant.name}")
    return found
