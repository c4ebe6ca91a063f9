"""A map of hunting over two settings and any number of corners: every point simulated and classified."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from actuator import SimulationError
from actuator.simulation.many import run_many
from actuator.simulation.run import Run
from actuator.verdict.verdict import FAILED, REST, Hunting, Verdict, decide
from studies.cache import Steps, fingerprint
from studies.cases import Case, load_case
from studies.corners import AS_IS, CornerSettings, Selection, Setting, find_corner, select
from studies.files import StudyError

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")
Index = tuple[int, int, int]  # corner, row, column
LABELS = tuple(Verdict)
POINTS = 5000  # output points of a run
FURTHER_STEP = 0.02  # part of the travel so far: the further step given to a run that came to rest
LONGEST = 4.0  # times the duration that a point may take to be decided
NUMBERS = {  # what is kept of a point besides its verdict: unit, and what it is
    "amplitude": ("rad", "half of peak to peak at the load, of a cycle"),
    "motor_amplitude": ("rad", "half of peak to peak at the motor, of a cycle"),
    "period": ("s", "period of a cycle"),
    "stick_fraction": ("-", "part of the period with every contact stuck"),
    "standing_error": ("rad", "reference less load angle, at rest or averaged over a cycle"),
    "reversals": ("1/h", "reversals of the load"),
    "travel": ("rad/h", "travel of the load, forward and backward"),
    "current_rms": ("A", "rms current"),
    "mean_loss": ("W", "losses of motor, inverter and gear"),
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
    corners : tuple of CornerSettings
        Sets of parameters; by default the case as it is.
    duration : float or None
        Of each run [s]; None for that of the case.
    """

    case: str | Path
    x: Axis
    y: Axis
    corners: tuple[CornerSettings, ...] = (CornerSettings(AS_IS),)
    duration: float | None = None

    def indices(self) -> list[Index]:
        """Corner, row and column of every point."""
        shape = (len(self.corners), len(self.y.values), len(self.x.values))
        return [(c, j, i) for c, j, i in np.ndindex(shape)]

    def parameters(self, index: Index) -> dict[str, float]:
        """The parameters of a point that differ from the case; StudyError where they break a rule."""
        corner, j, i = index
        axes = Setting(self.y.name, self.y.values[j]), Setting(self.x.name, self.x.values[i])
        at = CornerSettings(self.label(corner), (*self.corners[corner].settings, *axes))
        return find_corner(load(self.case).actuator.system(), at).parameters

    def selection(self, axis: Axis) -> Selection:
        """The parameters that an axis varies."""
        return select(load(self.case).actuator.system().parameters, axis.name)

    def label(self, corner: int) -> str:
        """The name of a corner."""
        return self.corners[corner].name

    def fingerprint(self) -> str:
        """A hash of all that the points depend on."""
        case, settings = load(self.case), [corner.settings for corner in self.corners]
        return fingerprint(case.actuator, case.inputs, self.x, self.y, settings, self.duration or case.duration)

    def check(self) -> None:
        """Raise StudyError where a name is unknown or a value breaks a rule of its component."""
        if self.x.name == self.y.name:
            raise StudyError(f"both axes are {self.x.name!r}; choose two")
        for index in self.indices():
            self.parameters(index)


@cache
def load(case: str | Path) -> Case:
    """Load a case, once in every process."""
    return load_case(case)


class Judged(NamedTuple):
    """The last run of a point, its verdict, and the reason."""

    run: Run
    hunting: Hunting
    reason: str


def judge_point(plan: Plan, index: Index) -> Judged:
    """Simulate and classify one point.

    Rest and a cycle may coexist, and a large step often ends at rest by chance: a run that comes to rest is given a
    further small step, after which the integrator must build up until stiction breaks away.
    """
    case = load(plan.case)
    duration = plan.duration or case.duration
    options: dict[str, Any] = {
        "parameters": plan.parameters(index),
        "resolution": duration / POINTS,
        "longest": LONGEST,
    }
    run, found = decide(case.actuator, duration, inputs=case.inputs, **options)
    if found.verdict == REST and "reference" in run.signals:
        held = {quantity.name: float(run[quantity.name][-1]) for quantity in run.system.inputs}
        step = FURTHER_STEP * float(abs(run["load_angle"]).max())
        held["reference"] += step
        again = decide(case.actuator, duration, inputs=held, start=run.state(), **options)
        if again.hunting.cycles:
            return Judged(*again, f"after a further step of {step:.3g} rad {again.hunting.reason}")
    return Judged(run, found, found.reason)


def compute_point(plan: Plan, index: Index) -> dict[str, Any]:
    """Verdict, reason and numbers of one point; None in place of numbers that it does not have."""
    try:
        judged = judge_point(plan, index)
    except SimulationError as error:
        return {"verdict": FAILED, "reason": str(error)}
    return {"verdict": judged.hunting.verdict, "reason": judged.reason, **_numbers(judged.hunting)}


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
    plan: Plan, steps: Steps, *, jobs: int, progress: Callable[[int, int], None] | None = None
) -> dict[Index, dict[str, Any]]:
    """All points of a map: from the cache, or simulated and put there; parameters as of `run_many`."""
    return compute_at(partial(compute_point, plan), dict, "point", plan.indices(), steps, jobs=jobs, progress=progress)


def compute_at(  # noqa: PLR0913 - what, where, and how
    work: Callable[[Index], T],
    kind: type[T],
    name: str,
    indices: Sequence[Index],
    steps: Steps,
    *,
    jobs: int,
    progress: Callable[[int, int], None] | None = None,
) -> dict[Index, T]:
    """The results of some work at indices of a map, each a step called by a name and its index."""
    points = {f"{name} {index}": index for index in indices}
    found = run_many(work, points, done=steps.results(kind), workers=jobs, first_here=True, progress=progress)
    return dict(zip(indices, found.values(), strict=True))


def dataset(plan: Plan, points: Mapping[Index, Mapping[str, Any]]) -> "xarray.Dataset":
    """The map as labeled arrays over corner, y and x; verdicts as integers, named by `flag_meanings`."""
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
        chosen = plan.selection(along)
        named = {
            "long_name": along.name,
            "units": chosen.unit,
            "parameters": " ".join(chosen.parameters),
            "factor": np.int8(chosen.factor),
        }
        variables[axis] = (axis, np.array(along.values), named)
    corners = np.arange(shape[0], dtype=np.int32)
    labels = [plan.label(k) for k in range(shape[0])]
    named = {"long_name": "set of parameters", "flag_values": corners, "flag_meanings": flags(labels)}
    variables["corner"] = ("corner", corners, named)
    found = xarray.Dataset(variables, attrs={"case": str(plan.case), "system": system.name})
    return found.set_coords(dimensions)


def flags(labels: Iterable[str]) -> str:
    """Names of the values of a coded variable as of the CF conventions: separated by blanks, none within."""
    return " ".join(label.replace(", ", ",").replace(" ", "_") for label in labels)
