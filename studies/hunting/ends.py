"""The exact boundary in a map: where the family of orbits through its hunting points ends, along one axis."""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from actuator import NoOrbit, SimulationError, continue_orbit, find_orbit
from actuator.continuation.bifurcations import BOUND
from actuator.verdict.verdict import CYCLES, IRREGULAR, REST, UNDECIDED
from studies.cache import Stages
from studies.corners import meaning
from studies.hunting.map import Index, Plan, load, made_once, seen_at

if TYPE_CHECKING:
    import xarray

NO_END, GOES_ON = "no orbit", "goes on"


class EndPoint(NamedTuple):
    """Where the family ends along an axis, and how; nan and why where no end was found."""

    value: float
    kind: str
    reason: str


def along(plan: Plan) -> str:
    """The axis that is the value of one parameter, "x" before "y"; empty where neither is."""
    system = load(plan.case).actuator.system()
    return next((name for name in ("x", "y") if meaning(system, getattr(plan, name).name).single), "")


def crossings(plan: Plan, points: Mapping[Index, Mapping[str, Any]]) -> list[Index]:
    """One hunting point beside one without a cycle along the axis, for every line of the map that has such a pair."""
    axis = along(plan)
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


def end_of(plan: Plan, index: Index) -> EndPoint:
    """Follow the cycle of a hunting point towards both ends of the axis, to the nearest end of its family."""
    case, axis = load(plan.case), getattr(plan, along(plan))
    try:
        orbit = find_orbit(case.actuator, seen_at(plan, index).run)
        ends = []
        bounds = (min(axis.values), max(axis.values))
        for upward in _ways(plan, index):
            branch = continue_orbit(orbit, axis.name, bounds, upward=upward)
            ends.append(EndPoint(float(branch.end.value), branch.end.kind, branch.end.reason))
    except (NoOrbit, SimulationError) as error:
        return EndPoint(math.nan, NO_END, str(error))
    inside = [end for end in ends if end.kind != BOUND]
    return inside[0] if inside else EndPoint(math.nan, GOES_ON, "the family goes on to the ends of the axis")


def _ways(plan: Plan, index: Index) -> tuple[bool, ...]:
    """Directions to follow in: not from an end of the axis outward."""
    axis = getattr(plan, along(plan))
    value = axis.values[index[2] if along(plan) == "x" else index[1]]
    return tuple(up for up in (False, True) if value != (max if up else min)(axis.values))


def ends(
    plan: Plan, indices: list[Index], stages: Stages, *, jobs: int, progress: Callable[[int], None]
) -> dict[Index, EndPoint]:
    """Ends of the families through hunting points, each found once."""
    return made_once(end_of, EndPoint, "end", plan, indices, stages, jobs=jobs, progress=progress)


def with_boundary(plan: Plan, data: "xarray.Dataset", found: Mapping[Index, EndPoint]) -> "xarray.Dataset":
    """The map with the exact boundary: values on the axis that it was followed along, over the other."""
    axis = along(plan)
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
