"""The stiction margin of a design, by simulation in every corner: in steps upward, then by bisection.

Hunting may end again where the motor is too weak to break away, so factors are tried from the lowest upward, in steps;
hunting in a window of factors narrower than a step can be missed.
"""

import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from actuator.actuator import Actuator
from actuator.simulation.many import run_many
from actuator.stiction.margins import find_onset
from actuator.system.parameters import Parameter, breakaway_floor
from actuator.verdict.verdict import REST
from studies.cache import fingerprint
from studies.corners import Corner
from studies.specification import Demand
from studies.tuning.check import Bench, step_trials

MOST = 4.0  # largest factor on all breakaway friction
STEP = 1.25  # ratio of successive factors on the way up
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
    def label(self) -> str:
        """Where hunting begins, in words."""
        if self.hunts is None:
            return f"none up to factor {MOST:g}"
        if self.rests is None:
            return "already at the lowest factor, where breakaway friction equals sliding friction"
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

    def hunts(self, search: Search, factor: float) -> bool:
        """Whether a step does not come to rest; the largest is tried first, as it tells most often."""
        parameters = self.bench.plant.system().parameters
        steps = step_trials(search.corner, search.design, search.demand, parameters, factor)
        return any(self.bench(trial)["verdict"] != REST for trial in reversed(steps.values()))

    def lowest(self, search: Search) -> float:
        """The factor from which on is searched."""
        return lowest_factor(self.bench.plant.system().parameters, search.corner.parameters)

    def __call__(self, search: Search) -> dict[str, Any]:
        """Factors between which hunting begins, from below; None where it does not on this side."""
        factors = make_ladder(self.lowest(search), search.demand.stiction_margin)
        if self.hunts(search, factors[0]):
            return {"rests": None, "hunts": factors[0]}
        return find_onset(partial(self.hunts, search), factors, tolerance=ACCURACY, first=False)._asdict()


def make_ladder(lowest: float, demanded: float) -> list[float]:
    """Factors to try, from the lowest to MOST: no further apart than STEP, with 1 and the demanded one."""
    count = math.ceil(math.log(MOST / lowest) / math.log(STEP))
    return sorted({MOST, 1.0, demanded} | {lowest * STEP**k for k in range(count)})


def lowest_factor(parameters: Sequence[Parameter], changed: Mapping[str, float]) -> float:
    """The factor on breakaway friction at which none of it exceeds sliding friction."""
    values = {parameter.name: float(parameter.default) for parameter in parameters} | dict(changed)
    floors = [(breakaway_floor(parameter, values), values[parameter.name]) for parameter in parameters]
    return max(min([1.0, *(floor / value for floor, value in floors if floor is not None and value > 0)]), 1e-3)


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
    model, demanded = fingerprint(plant), (demand.sine, demand.stiction_margin)
    keys = {
        name: fingerprint("stiction", model, search.corner.parameters, search.design, demanded, MOST, STEP, ACCURACY)
        for name, search in searches.items()
    }
    points = {keys[name]: search for name, search in searches.items()}
    results = run_many(Seeker(plant), points, done=done, workers=workers, progress=progress)
    return [StictionMargin(name, **results[key]) for name, key in keys.items()]


def least_margin(found: Sequence[StictionMargin]) -> StictionMargin:
    """The corner in which hunting begins first."""
    return min(found, key=lambda each: (each.hunts or math.inf, each.rests or 0.0))
