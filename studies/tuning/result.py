"""The result of a tuning: gains, the designs on the way to them, and their checks; and its gains for other studies."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from actuator.actuator import Actuator
from studies.corners import Corner
from studies.files import CaseError
from studies.specification import Criterion, Demand, Specification
from studies.tuning.check import CornerCheck
from studies.tuning.design import Design
from studies.tuning.measures import Measure
from studies.tuning.plant import defaults_of, with_dead_band
from studies.tuning.stiction import StictionMargin

TIGHTER = 1.25  # factor on the slip where a corner hunts nevertheless
BEYOND = 1.02  # factor on other demands, on top of what is missing
TOLERATED = 1e-3  # relative, by which a simulation may miss a demand: it is sampled, and settles slowly
LEAST_OVERSHOOT = 0.01  # [-] by which an excess of overshoot is divided at least


class Round(NamedTuple):
    """One design and its simulations."""

    tightening: dict[Criterion, float]
    design: Design
    checks: list[CornerCheck]


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """A finished tuning.

    Attributes
    ----------
    specification : Specification
        The task.
    original, plant : Actuator
        Before and after tuning.
    corners : tuple of Corner
        All corners.
    before : dict of str to float
        Gains before tuning.
    start : dict of str to float
        Gains in closed form.
    before_measures : tuple of Measure
        With the gains before tuning.
    before_checks : list of CornerCheck
        Likewise.
    rounds : tuple of Round
        Designs and their checks, the last with the tuned gains.
    margins_before, margins : list of StictionMargin
        Factors on breakaway friction at which hunting begins in every corner, before and after tuning.
    trade_off : tuple of (float, float)
        Stiction margins, each with the least standing error [rad].
    """

    specification: Specification
    original: Actuator = field(repr=False)
    plant: Actuator = field(repr=False)
    corners: tuple[Corner, ...] = field(repr=False)
    before: dict[str, float]
    start: dict[str, float]
    before_measures: tuple[Measure, ...] = field(repr=False)
    before_checks: list[CornerCheck] = field(repr=False)
    rounds: tuple[Round, ...] = field(repr=False)
    margins_before: list[StictionMargin] = field(repr=False)
    margins: list[StictionMargin] = field(repr=False)
    trade_off: tuple[tuple[float, float], ...]

    @property
    def design(self) -> Design:
        """The last design."""
        return self.rounds[-1].design

    @property
    def parameters(self) -> dict[str, float]:
        """Gains and dead band by name."""
        return with_dead_band(self.original, self.design.gains, self.design.standing_error)

    @property
    def met(self) -> bool:
        """Whether the simulations meet every demand."""
        return not shortfalls(self.rounds[-1].checks, self.specification.demand)


def shortfalls(checks: Sequence[CornerCheck], demand: Demand) -> dict[Criterion, float]:
    """Factors by which the simulations require demands to be tightened; empty where all are met.

    Overshoot, current and torque are those of the step of the demanded amplitude, with friction as it is, in the corner
    in which they are largest; a corner that hunts needs less slip, and its other numbers are not used.
    """
    asked: dict[Criterion, float] = {}
    if any(check.hunts(1.0) or check.hunts(demand.stiction_margin) for check in checks):
        asked[Criterion.SLIP] = TIGHTER
    least = min(check.followed for check in checks)
    if not least >= 1 / math.sqrt(2):
        asked[Criterion.BANDWIDTH] = BEYOND / (math.sqrt(2) * max(least, 0.1))
    calm = [check for check in checks if not check.hunts(1.0)]
    shown = {
        Criterion.OVERSHOOT: (demand.overshoot, [check.overshoot for check in calm]),
        Criterion.PEAK_CURRENT: (demand.peak_current, [check.peak_current for check in calm]),
        Criterion.PEAK_TORQUE: (demand.peak_torque, [check.peak_torque for check in calm]),
        Criterion.STANDING_ERROR: (demand.standing_error, [check.standing_error for check in calm]),
    }
    for criterion, (limit, values) in shown.items():
        if limit is None or not values:
            continue
        most, absolute = max(values), criterion is Criterion.OVERSHOOT
        if most > limit + (TOLERATED if absolute else TOLERATED * limit):
            asked[criterion] = BEYOND * most / (max(limit, LEAST_OVERSHOOT) if absolute else limit)
    return asked


class TunedGains(NamedTuple):
    """Gains and dead band by name, and the case for which they were tuned."""

    values: dict[str, float]
    case: str
    path: Path

    @property
    def label(self) -> str:
        """Their origin."""
        return f"gains of {self.path}, tuned for {self.case}"


def read_tuned_gains(path: Path, plant: Actuator) -> TunedGains:
    """Read the gains in the result.json of a tuning, for an actuator that has these parameters.

    It need not be the actuator that was tuned.

    Raises
    ------
    CaseError
        Where the file is not the result of a tuning, or the actuator lacks a parameter or refuses its value.
    """
    try:
        result = json.loads(path.read_bytes())
        values = {name: float(value) for name, value in result["gains"]["tuned"].items()}
        found = TunedGains(values, str(result["case"]), path)
    except OSError as error:
        raise CaseError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise CaseError(f"{path}: is not the result.json of a tuning") from None
    known = defaults_of(plant.system().parameters)
    for name in found.values:
        if name not in known:
            raise CaseError(f"{path}: {name} is not a parameter of {plant.name}")
    return found
