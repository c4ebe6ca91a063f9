"""The stiction margin that a design really has, simulated in every corner: in steps upward, then by bisection.

Hunting may end again where the motor is too weak to break away, so every factor from the lowest on is tried, in steps;
hunting in a window of factors that is narrower than a step can be missed.
"""

import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from typing import Any, NamedTuple

from actuator.actuator import Actuator
from actuator.simulation.many import run_many
from actuator.stiction.margins import sliding_of
from actuator.verdict.verdict import REST
from studies.cache import fingerprint
from studies.specification import Corner, Demand
from studies.tuning.check import Bench, step_trials
from studies.tuning.plant import defaults_of

MOST = 4.0  # factor on all breakaway friction up to which hunting is looked for
STEP = 1.25  # ratio of the factors that are tried on the way up
ACCURACY = 1.05  # ratio of the factors between which hunting begins


class StictionMargin(NamedTuple):
    """Between which factors on all breakaway friction hunting begins in a corner.

    Attributes
    ----------
    corner : str
        Its name.
    rests : float or None
        The largest factor up to which all steps come to rest; None where one does not at the lowest factor, with
        breakaway friction no more than sliding friction.
    hunts : float or None
        The smallest found at which one does not; None where all come to rest at the factors tried up to MOST.
    """

    corner: str
    rests: float | None
    hunts: float | None

    @property
    def words(self) -> str:
        """What was found."""
        if self.hunts is None:
            return f"none up to factor {MOST:g}"
        if self.rests is None:
            return "at the lowest factor too, with breakaway friction no more than sliding friction"
        return f"between factors {self.rests:.3g} and {self.hunts:.3g}"


class Search(NamedTuple):
    """One corner of a design."""

    corner: Corner
    design: dict[str, float]
    demand: Demand


class Seeker:
    """Finds where hunting begins in a corner, for one actuator.

    Parameters
    ----------
    plant : Actuator
        With all parameters of the design.
    """

    def __init__(self, plant: Actuator) -> None:
        self.bench = Bench(plant)
        self.defaults = defaults_of(plant.system().parameters)

    def hunts(self, search: Search, factor: float) -> bool:
        """Whether a step does not come to rest; the largest is tried first, as it tells most often."""
        steps = step_trials(search.corner, search.design, search.demand, self.defaults, factor)
        return any(self.bench(trial)["verdict"] != REST for trial in reversed(steps.values()))

    def __call__(self, search: Search) -> dict[str, Any]:
        """Factors between which hunting begins, from below; None where it does not on this side."""
        low, *others = rungs(least(self.defaults | search.corner.parameters), search.demand.stiction_margin)
        if self.hunts(search, low):
            return {"rests": None, "hunts": low}
        for high in others:
            if self.hunts(search, high):
                break
            low = high
        else:
            return {"rests": low, "hunts": None}
        while high > ACCURACY * low:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if self.hunts(search, middle) else (middle, high)
        return {"rests": low, "hunts": high}


def rungs(lowest: float, demanded: float) -> list[float]:
    """The factors that are tried, from the lowest to MOST: no further apart than STEP, with 1 and what is demanded."""
    count = math.ceil(math.log(MOST / lowest) / math.log(STEP))
    return sorted({MOST, 1.0, demanded} | {lowest * STEP**k for k in range(count)})


def least(values: Mapping[str, float]) -> float:
    """The factor on breakaway friction at which none of it exceeds sliding friction."""
    found = [1.0]
    for name, value in values.items():
        sliding = sliding_of(name, values)
        if sliding is not None and value > 0:
            found.append(values[sliding] / value)
    return max(min(found), 1e-3)


def stiction_margins(  # noqa: PLR0913 - what is searched, and how it is run
    plant: Actuator,
    corners: Sequence[Corner],
    design: Mapping[str, float],
    demand: Demand,
    *,
    done: MutableMapping[str, dict[str, Any]] | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[StictionMargin]:
    """Where hunting begins in every corner, to an ACCURACY, by the steps of `check_corners`.

    Parameters as for `check_corners`.
    """
    searches = {corner.name: Search(corner, dict(design), demand) for corner in corners}
    model, demanded = repr(plant), (demand.sine, demand.stiction_margin)
    keys = {
        name: fingerprint(["stiction", model, search.corner.parameters, search.design, *demanded, MOST, STEP, ACCURACY])
        for name, search in searches.items()
    }
    points = {keys[name]: search for name, search in searches.items()}
    results = run_many(Seeker(plant), points, done=done, workers=workers, progress=progress)
    return [StictionMargin(name, **results[key]) for name, key in keys.items()]


def least_margin(found: Sequence[StictionMargin]) -> StictionMargin:
    """The corner in which hunting begins first."""
    return min(found, key=lambda each: (each.hunts or math.inf, each.rests or 0.0))
