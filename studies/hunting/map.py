"""A map of hunting over two names and any number of corners: every point simulated and classified, on all cores."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from actuator import SimulationError
from actuator.simulation.many import processes
from actuator.simulation.run import Run
from actuator.verdict.verdict import FAILED, REST, Hunting, Verdict, decide
from studies.cache import Stages, actuator_of
from studies.cases import Case, load_case
from studies.corners import Setting, meaning, parameters_of

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")
Index = tuple[int, int, int]  # corner, row, column
LABELS = tuple(Verdict)
POINTS = 5000  # output points of a run
SMALL = 0.02  # part of the way gone so far: the further step that what rests is given
LONGEST = 4.0  # times the duration that a point may take to be decided
NUMBERS = {  # what is kept of a point besides its verdict: unit, and what it is
    "amplitude": ("rad", "half of peak to peak at the load, of a cycle"),
    "motor_amplitude": ("rad", "half of peak to peak at the motor, of a cycle"),
    "period": ("s", "period of a cycle"),
    "stick_fraction": ("-", "part of the period in which every contact is stuck"),
    "standing_error": ("rad", "reference less load, at rest or in the mean of a cycle"),
    "reversals": ("1/h", "reversals of the load"),
    "travel": ("rad/h", "way of the load, forward and backward"),
    "current_rms": ("A", "effective value of the current"),
    "mean_loss": ("W", "heat of motor, inverter and gear"),
}


@dataclass(frozen=True, kw_only=True)
class Axis:
    """A name with the values it takes.

    Parameters
    ----------
    name : str
        As of `studies.corners`.
    values : tuple of float
        In SI units, or factors.
    """

    name: str
    values: tuple[float, ...]

    @classmethod
    def between(cls, name: str, first: float, last: float, count: int) -> "Axis":
        """Evenly from first to last."""
        return cls(name=name, values=tuple(float(value) for value in np.linspace(first, last, count)))


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a map is of.

    Parameters
    ----------
    case : str or Path
        A built-in case or a file.
    x, y : Axis
        What is varied.
    corners : tuple of tuple of Setting
        Each a set of parameters; one empty one for the case as it is.
    duration : float or None
        Of each run [s]; None for that of the case.
    """

    case: str | Path
    x: Axis
    y: Axis
    corners: tuple[tuple[Setting, ...], ...] = ((),)
    duration: float | None = None

    def indices(self) -> list[Index]:
        """Corner, row and column of every point."""
        shape = (len(self.corners), len(self.y.values), len(self.x.values))
        return [(c, j, i) for c, j, i in np.ndindex(shape)]

    def settings(self, index: Index) -> tuple[Setting, ...]:
        """All settings of a point."""
        corner, j, i = index
        return (
            *self.corners[corner],
            Setting(self.y.name, self.y.values[j]),
            Setting(self.x.name, self.x.values[i]),
        )

    def label(self, corner: int) -> str:
        """A corner in words."""
        return ", ".join(f"{name}={value:g}" for name, value in self.corners[corner]) or "as it is"

    def fingerprint(self) -> str:
        """Of all that decides the points."""
        case = load(self.case)
        plan = (self.x, self.y, self.corners, self.duration or case.duration)
        return actuator_of(case.actuator, case.inputs, plan)

    def check(self) -> None:
        """Raise KeyError or ValueError where a name is unknown or a value breaks a rule of its component."""
        system = load(self.case).actuator.system()
        if self.x.name == self.y.name:
            raise ValueError(f"both axes are {self.x.name!r}; choose two")
        for index in self.indices():
            system.parameter_values(parameters_of(system, self.settings(index)))


@cache
def load(case: str | Path) -> Case:
    """A case, built once in every process."""
    return load_case(case)


class Seen(NamedTuple):
    """The last run of a point, the verdict on it, and why."""

    run: Run
    hunting: Hunting
    reason: str


def seen_at(plan: Plan, index: Index) -> Seen:
    """Simulate and classify one point.

    Rest and a cycle may exist side by side, and a large step often ends at rest by chance: what rests is given a small
    step more, behind which the integrator must build up until stiction lets go.
    """
    case = load(plan.case)
    duration = plan.duration or case.duration
    parameters = parameters_of(case.actuator.system(), plan.settings(index))
    options: dict[str, Any] = {"parameters": parameters, "resolution": duration / POINTS, "longest": LONGEST}
    run, found = decide(case.actuator, duration, inputs=case.inputs, **options)
    if found.verdict == REST and "reference" in run.signals:
        held = {quantity.name: float(run[quantity.name][-1]) for quantity in run.system.inputs}
        step = SMALL * float(abs(run["load_angle"]).max())
        held["reference"] += step
        again = decide(case.actuator, duration, inputs=held, start=run.state(), **options)
        if again.hunting.cycles:
            return Seen(*again, f"after a further step of {step:.3g} rad {again.hunting.reason}")
    return Seen(run, found, found.reason)


def point(plan: Plan, index: Index) -> dict[str, Any]:
    """What is kept of one point; numbers that there are not are None."""
    try:
        seen = seen_at(plan, index)
    except SimulationError as error:
        return {"verdict": FAILED, "reason": str(error)}
    return {"verdict": seen.hunting.verdict, "reason": seen.reason, **_numbers(seen.hunting)}


def _numbers(hunting: Hunting) -> dict[str, float | None]:
    duty = hunting.duty
    values = {
        "amplitude": hunting.amplitude_rad,
        "motor_amplitude": hunting.motor_amplitude_rad,
        "period": hunting.period_s,
        "stick_fraction": hunting.stick_fraction,
        "standing_error": hunting.standing_error_rad,
        "reversals": duty.load_reversals_per_h,
        "travel": duty.load_travel_per_h,
        "current_rms": duty.current_rms,
        "mean_loss": duty.mean_loss,
    }
    return {name: float(value) if math.isfinite(value) else None for name, value in values.items()}


def compute(
    plan: Plan, stages: Stages, *, jobs: int, progress: Callable[[int], None] = lambda count: None
) -> dict[Index, dict[str, Any]]:
    """All points of a map: those that are kept as they are, the others simulated, and kept as they come.

    `progress` is called with how many more are done.
    """
    return made_once(point, dict, "point", plan, plan.indices(), stages, jobs=jobs, progress=progress)


def made_once(  # noqa: PLR0913 - of what, of which, and how
    function: Callable[[Plan, Index], T],
    kind: type[T],
    word: str,
    plan: Plan,
    indices: Sequence[Index],
    stages: Stages,
    *,
    jobs: int,
    progress: Callable[[int], None],
) -> dict[Index, T]:
    """What a function of the plan and an index gives for all indices: kept, or made now in several processes and kept.

    The first is made here, which compiles the model for all. What is kept has its `word` and index for a name.
    """
    names = {index: f"{word} {index}" for index in indices}
    left = [index for index in indices if names[index] not in stages]
    progress(len(indices) - len(left))
    here = left if jobs == 1 else left[:1]
    for index in here:
        stages.keep(names[index], function(plan, index))
        progress(1)
    if there := left[len(here) :]:
        with processes(min(jobs, len(there))) as pool:
            futures = {pool.submit(function, plan, index): index for index in there}
            for future in as_completed(futures):
                stages.keep(names[futures[future]], future.result())
                progress(1)
    return {index: stages.read(name, kind) for index, name in names.items()}


def dataset(plan: Plan, points: Mapping[Index, Mapping[str, Any]]) -> "xarray.Dataset":
    """The map as labelled arrays over corner, y and x; words as whole numbers, told by `flag_meanings`."""
    import xarray

    system = load(plan.case).actuator.system()
    shape = (len(plan.corners), len(plan.y.values), len(plan.x.values))
    verdict = np.full(shape, -1, dtype=np.int8)
    numbers = {name: np.full(shape, np.nan) for name in NUMBERS}
    for index, found in points.items():
        verdict[index] = LABELS.index(found["verdict"])
        for name, values in numbers.items():
            value = found.get(name)
            values[index] = math.nan if value is None else value
    dimensions = ("corner", "y", "x")
    coded = {"flag_values": np.arange(len(LABELS), dtype=np.int8), "flag_meanings": flags(LABELS)}
    variables: dict[str, Any] = {"verdict": (dimensions, verdict, {"long_name": "verdict", **coded})}
    for name, (unit, text) in NUMBERS.items():
        variables[name] = (dimensions, numbers[name], {"units": unit, "long_name": text})
    for axis, along in (("x", plan.x), ("y", plan.y)):
        kind = meaning(system, along.name)
        named = {"long_name": along.name, "units": kind.unit, "parameters": " ".join(kind.parameters)}
        variables[axis] = (axis, np.array(along.values), named)
    corners = np.arange(shape[0], dtype=np.int32)
    labels = [plan.label(k) for k in range(shape[0])]
    named = {"long_name": "set of parameters", "flag_values": corners, "flag_meanings": flags(labels)}
    variables["corner"] = ("corner", corners, named)
    found = xarray.Dataset(variables, attrs={"case": str(plan.case), "system": system.name})
    return found.set_coords(dimensions)


def flags(labels: Iterable[str]) -> str:
    """Words of a coded variable, as the CF conventions have them: blanks between them, none in them."""
    return " ".join(label.replace(", ", ",").replace(" ", "_") for label in labels)
