"""The exact boundary in a map: where, along one axis, the family of orbits through its hunting points ends."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from actuator import NoOrbit, SimulationError, continue_orbit, find_orbit
from actuator.continuation.bifurcations import BOUND
from actuator.verdict.verdict import CYCLES, IRREGULAR, REST, UNDECIDED
from studies.cache import Steps
from studies.hunting.map import Index, Plan, compute_at, judge_point, load

if TYPE_CHECKING:
    import xarray

NO_END, CONTINUES = "no orbit", "continues"


class EndPoint(NamedTuple):
    """Where along an axis the family ends, and how; nan and the reason where no end was found."""

    value: float
    kind: str
    reason: str


def find_axis(plan: Plan) -> str:
    """The axis that is the value of one parameter, "x" before "y"; empty where neither is."""
    return next((name for name in ("x", "y") if plan.selection(getattr(plan, name)).single), "")


def find_crossings(plan: Plan, points: Mapping[Index, Mapping[str, Any]]) -> list[Index]:
    """For every line of the map along the axis that has one, a hunting point next to a point without a cycle."""
    axis = find_axis(plan)
    if not axis:
        return []
    found: dict[tuple[int, int], Index] = {}
    for index in plan.indices():
        beside = _beside(index, axis)
        pair = (points[index]["verdict"], points[beside]["verdict"] if beside in points else "")
        line = (index[0], index[1] if axis == "x" else index[2])
        for first, second, hunts in ((*pair, index), (*pair[::-1], beside)):
            if first in CYCLES and second in (REST, IRREGULAR, UNDECIDED):
                found.setdefault(line, hunts)
    return list(found.values())


def _beside(index: Index, axis: str) -> Index:
    corner, j, i = index
    return (corner, j, i + 1) if axis == "x" else (corner, j + 1, i)


def find_end(plan: Plan, index: Index) -> EndPoint:
    """Continue the cycle of a hunting point toward both ends of the axis, to the nearest end of its family."""
    case, axis = load(plan.case), getattr(plan, find_axis(plan))
    try:
        orbit = find_orbit(case.actuator, judge_point(plan, index).run)
        ends = []
        bounds = (min(axis.values), max(axis.values))
        for upward in _directions(plan, index):
            branch = continue_orbit(orbit, axis.name, bounds, upward=upward)
            ends.append(EndPoint(float(branch.end.value), branch.end.kind, branch.end.reason))
    except (NoOrbit, SimulationError) as error:
        return EndPoint(math.nan, NO_END, str(error))
    inside = [end for end in ends if end.kind != BOUND]
    return inside[0] if inside else EndPoint(math.nan, CONTINUES, "the family continues to the ends of the axis")


def _directions(plan: Plan, index: Index) -> tuple[bool, ...]:
    """Directions of continuation: not from an end of the axis outward."""
    axis = getattr(plan, find_axis(plan))
    value = axis.values[index[2] if find_axis(plan) == "x" else index[1]]
    return tuple(up for up in (False, True) if value != (max if up else min)(axis.values))


def find_ends(
    plan: Plan,
    indices: list[Index],
    steps: Steps,
    *,
    jobs: int,
    progress: Callable[[int, int], None] | None = None,
) -> dict[Index, EndPoint]:
    """Ends of the families through hunting points; parameters as of `run_many`."""
    return compute_at(partial(find_end, plan), EndPoint, "end", indices, steps, jobs=jobs, progress=progress)


def add_boundary(plan: Plan, data: "xarray.Dataset", found: Mapping[Index, EndPoint]) -> "xarray.Dataset":
    """The map with the exact boundary: values on the axis along which it was continued, over the other axis."""
    axis = find_axis(plan)
    if not axis:
        return data
    other = "y" if axis == "x" else "x"
    values = np.full((data.sizes["corner"], data.sizes[other]), np.nan)
    for (corner, j, i), end in found.items():
        values[corner, j if axis == "x" else i] = end.value
    text = f"{getattr(plan, axis).name} at which the family of orbits ends"
    return data.assign(
        boundary=(("corner", other), values, {"units": data[axis].units, "long_name": text, "along": axis})
    )
