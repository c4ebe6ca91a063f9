"""Where does it hunt? A map over two names and any number of corners, with pictures, numbers and a data set."""

import math
from collections import Counter
from collections.abc import Callable, MutableMapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from actuator.diagnosis.causes import INTEGRALS
from actuator.verdict.verdict import FAILED
from studies.cache import Stages
from studies.corners import setting_of
from studies.findings import Findings
from studies.hunting.ends import CYCLES, EndPoint, along, crossings, ends, with_boundary
from studies.hunting.map import LABELS, Axis, Plan, compute, dataset, load
from studies.hunting.pictures import plot_map

BREAKAWAY = ("*.breakaway", "*.static")
DEFAULT_X = (0.1, 2.0, 12)  # of the integral gain of the case: first, last, count
DEFAULT_Y = (0.5, 2.0, 8)  # of all breakaway friction
DATA = "hunting.nc"


class WrongPlan(ValueError):
    """A map that cannot be made; the message is one line."""


def plan_of(  # noqa: PLR0913 - a map has this many choices
    case: str | Path,
    *,
    x: tuple[str, float, float, int] | None = None,
    y: tuple[str, float, float, int] | None = None,
    corners: tuple[str, ...] = (),
    duration: float | None = None,
) -> Plan:
    """The plan of a map, checked; without axes the integral gain over the breakaway friction.

    Raises
    ------
    WrongPlan
        For a name that is unknown or a value that breaks a rule.
    """
    system = load(case).actuator.system()
    values = {parameter.name: float(parameter.default) for parameter in system.parameters}
    integral = next((name for name in INTEGRALS if values.get(name)), None)
    if x is None and integral is None:
        raise WrongPlan(f"{system.name} has no integral gain to vary; choose two names with --x and --y")
    if x is None:
        first, last, count = DEFAULT_X
        gain = values[str(integral)]
        x = (str(integral), first * gain, last * gain, count)
    if y is None:
        present = [pattern for pattern in BREAKAWAY if any(fnmatchcase(name, pattern) for name in values)]
        if not present:
            raise WrongPlan(f"{system.name} has no breakaway friction to vary; choose another name with --y")
        y = ("+".join(present), *DEFAULT_Y)
    axes = [Axis.between(*x), Axis.between(*y)]
    try:
        sets = tuple(tuple(setting_of(part) for part in corner.split(",")) for corner in corners) or ((),)
        plan = Plan(case=case, x=axes[0], y=axes[1], corners=sets, duration=duration)
        plan.check()
    except (KeyError, ValueError) as error:
        raise WrongPlan(str(error.args[0])) from None
    return plan


def hunting_map(
    plan: Plan,
    kept: MutableMapping[str, dict[str, Any]],
    *,
    jobs: int,
    exact: bool = False,
    progress: Callable[[int], None] = lambda count: None,
    progress_of_ends: Callable[[int, int], None] = lambda done, count: None,
) -> Findings:
    """Make a map, or finish one that was begun.

    Parameters
    ----------
    plan : Plan
        What is varied.
    kept : mutable mapping of str to dict
        Finished points and ends.
    jobs : int
        Processes.
    exact : bool
        Whether the exact boundary is followed along the axis that is one parameter.
    progress : callable
        Called with how many more points are done.
    progress_of_ends : callable
        Called with how many more ends of how many in all are found.
    """
    stages = Stages(kept, plan.fingerprint())
    points = compute(plan, stages, jobs=jobs, progress=progress)
    data, found = dataset(plan, points), {}
    if exact:
        begun = crossings(plan, points)
        found = ends(plan, begun, stages, jobs=jobs, progress=lambda done: progress_of_ends(done, len(begun)))
        data = with_boundary(plan, data, found)
    corners = range(len(plan.corners))
    names = ["hunting_map"] if len(plan.corners) == 1 else [f"hunting_map_{k + 1}" for k in corners]
    return Findings(
        pictures={name: plot_map(data, k, plan.label(k)) for k, name in zip(corners, names, strict=True)},
        result=_result(plan, points, found),
        text=_sentences(plan, points, found, exact),
        files={DATA: lambda path: data.to_netcdf(path, engine="scipy")},
    )


def _result(plan: Plan, points: dict, found: dict[tuple, EndPoint]) -> dict[str, Any]:
    rows = []
    for index in plan.indices():
        named = {
            "corner": plan.label(index[0]),
            plan.y.name: plan.y.values[index[1]],
            plan.x.name: plan.x.values[index[2]],
        }
        rows.append(named | points[index])
    boundary = [
        {"corner": plan.label(c), plan.y.name: plan.y.values[j], plan.x.name: plan.x.values[i], **end._asdict()}
        for (c, j, i), end in found.items()
    ]
    return {"case": str(plan.case), "x": plan.x.name, "y": plan.y.name, "points": rows, "boundary": boundary}


def _sentences(plan: Plan, points: dict, found: dict[tuple, EndPoint], exact: bool) -> list[str]:
    text = []
    for corner in range(len(plan.corners)):
        here = [point for index, point in points.items() if index[0] == corner]
        counts = Counter(point["verdict"] for point in here)
        largest = max((point["amplitude"] for point in here if point["verdict"] in CYCLES), default=0.0)
        words = ", ".join(f"{verdict} at {counts[verdict]}" for verdict in LABELS if counts[verdict])
        cycle = f"; the largest amplitude is {1e3 * largest:.3g} mrad" if largest else ""
        text.append(f"{plan.label(corner)}: of {len(here)} points {words}{cycle}.")
    failed = [point["reason"] for point in points.values() if point["verdict"] == FAILED]
    if failed:
        text.append(f"{len(failed)} simulations could not be completed; the first: {failed[0]}")
    if exact and not along(plan):
        text.append("No exact boundary: neither axis is the value of one parameter.")
    known = [end for end in found.values() if math.isfinite(end.value)]
    if found:
        kinds = ", ".join(f"{kind} at {count}" for kind, count in Counter(end.kind for end in known).most_common())
        text.append(f"Exact boundary on {len(known)} of {len(found)} lines" + (f": {kinds}." if known else "."))
    return text
