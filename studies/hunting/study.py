"""Where does it hunt? A map over two settings and any number of corners, with pictures, numbers and a data set."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

from actuator.verdict.verdict import CYCLES, FAILED
from studies.cache import Steps
from studies.corners import AS_IS, ROLES, CornerSettings, read_corners
from studies.files import StudyError
from studies.findings import Findings
from studies.hunting.ends import EndPoint, add_boundary, find_axis, find_crossings, find_ends
from studies.hunting.map import LABELS, Axis, Plan, compute, dataset, load
from studies.hunting.pictures import plot_map
from studies.study import Work

DEFAULT_X = (0.1, 2.0, 12)  # of the integral gain of the case: first, last, count
DEFAULT_Y = (0.5, 2.0, 8)  # of all breakaway friction
DATA = "hunting.nc"
POINTS_SHARE = 0.7  # of the work, where the exact boundary follows


def make_plan(  # noqa: PLR0913 - a map has this many choices
    case: str | Path,
    *,
    x: tuple[str, float, float, int] | None = None,
    y: tuple[str, float, float, int] | None = None,
    corners: tuple[str, ...] = (),
    duration: float | None = None,
) -> Plan:
    """The plan of a map, checked; by default the integral gain over all breakaway friction.

    Raises
    ------
    StudyError
        For a name that is unknown or a value that breaks a rule.
    """
    system = load(case).actuator.system()
    if x is None:
        acting = [each for each in ROLES["integral"](system.parameters) if each.default]
        if not acting:
            raise StudyError(f"{system.name} has no integral gain to vary; choose two names with --x and --y")
        first, last, count = DEFAULT_X
        if len(acting) == 1:
            gain = float(acting[0].default)
            x = (acting[0].name, first * gain, last * gain, count)
        else:
            x = ("integral", *DEFAULT_X)
    if y is None:
        if not ROLES["breakaway"](system.parameters):
            raise StudyError(f"{system.name} has no breakaway friction to vary; choose another name with --y")
        y = ("breakaway", *DEFAULT_Y)
    at = read_corners(corners) or (CornerSettings(AS_IS),)
    plan = Plan(case=case, x=Axis.between(*x), y=Axis.between(*y), corners=at, duration=duration)
    plan.check()
    return plan


def hunting_map(plan: Plan, work: Work, *, exact: bool = False) -> Findings:
    """Compute a map, or finish one that was begun.

    Parameters
    ----------
    plan : Plan
        What is varied.
    work : Work
        Cache, processes and progress.
    exact : bool
        Whether the exact boundary is continued along the axis that is one parameter.
    """
    steps, share = Steps(work.cache, plan.fingerprint()), POINTS_SHARE if exact else 1.0
    points = compute(plan, steps, jobs=work.jobs, progress=work.part(0.0, share))
    data, found = dataset(plan, points), {}
    if exact:
        starts = find_crossings(plan, points)
        found = find_ends(plan, starts, steps, jobs=work.jobs, progress=work.part(share, 1.0))
        data = add_boundary(plan, data, found)
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
    if exact and not find_axis(plan):
        text.append("No exact boundary: neither axis is a single parameter.")
    known = [end for end in found.values() if math.isfinite(end.value)]
    if found:
        kinds = ", ".join(f"{kind} at {count}" for kind, count in Counter(end.kind for end in known).most_common())
        text.append(f"Exact boundary on {len(known)} of {len(found)} lines" + (f": {kinds}." if known else "."))
    return text
