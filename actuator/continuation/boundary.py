"""Where hunting ends over one parameter: as the exact ends of families of orbits.

A family of orbits may end while hunting goes on: a slip more or less in a period is another family. So where one ends a
run is begun on its last orbit, a little beyond. If it still hunts, the family it leads to is followed; if it hunts
irregularly, runs alone lead on; hunting ends where it comes to rest, or grows without bound.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from actuator.actuator import Actuator
from actuator.continuation.bifurcations import BOUND, Branch, End
from actuator.continuation.bisection import Runs, moves
from actuator.continuation.continuation import continue_orbit
from actuator.orbits.find import find_orbit
from actuator.orbits.flow import NoOrbit
from actuator.simulation.run import Run
from actuator.system.hybrid import HybridSystem
from actuator.verdict.verdict import Hunting

BEYOND = 0.01  # of the larger bound: how far behind the end of a family it is asked whether hunting goes on
STEPS = 25  # of runs alone, from bound to bound
MOST = 20  # intervals
RUNS = "by runs alone"  # how a interval without orbits ends where hunting goes on


class Interval(NamedTuple):
    """A range of the parameter in which one kind of hunting goes on."""

    begins: float
    ends: float
    branch: Branch | None  # the family of exact orbits; None where only runs show that it hunts
    end: End


@dataclass(frozen=True, kw_only=True)
class Boundary:
    """The value of a parameter at which hunting ends.

    Attributes
    ----------
    parameter : str
        Its name.
    value : float
        Where hunting ends.
    end : End
        How it ends there: as the last family of orbits does, or by "rest" or "diverging" of runs alone.
    intervals : tuple of Interval
        What hunts up to there, in the order in which it was followed.
    """

    parameter: str
    value: float
    end: End
    intervals: tuple[Interval, ...] = field(repr=False)

    @property
    def exact(self) -> bool:
        """Whether the value is the end of a family of orbits, and not resolved by runs."""
        return self.intervals[-1].branch is not None

    @property
    def branches(self) -> tuple[Branch, ...]:
        """The families, each with its own end."""
        return tuple(interval.branch for interval in self.intervals if interval.branch is not None)


def hunting_boundary(  # noqa: PLR0913 - what is simulated to find a cycle, and where
    plant: Actuator | HybridSystem,
    parameter: str,
    bounds: tuple[float, float],
    *,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    duration: float = 20.0,
    compiled: bool | None = None,
) -> Boundary:
    """Where the hunting that is found at one bound ends on the way to the other.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        It must hunt at one of the bounds.
    parameter : str
        Name.
    bounds : (float, float)
        Between which the boundary lies.
    inputs, parameters, start : mapping of str to float
        Constant inputs, other parameters and initial states by name.
    duration : float
        Of the runs [s]; those that do not decide are gone on with.
    compiled : bool or None
        As for `simulate`.

    Raises
    ------
    NoOrbit
        Where neither bound hunts, or hunting goes on up to the other bound.
    """
    runs = Runs(plant, parameter, inputs, parameters, duration, compiled)
    reasons = []
    for value, upward in ((bounds[0], True), (bounds[1], False)):
        run, verdict = runs.at(value, start)
        if verdict.cycles:
            intervals = _walk(runs, run, verdict, value, bounds, upward)
            last = intervals[-1]
            return Boundary(parameter=parameter, value=last.end.value, end=last.end, intervals=tuple(intervals))
        reasons.append(f"at {value:g} it is {verdict.verdict!r} ({verdict.reason})")
    raise NoOrbit(f"no cycle at either bound of {parameter}: {'; '.join(reasons)}")


def _family(runs: Runs, run: Run, bounds: tuple[float, float], upward: bool) -> Branch:
    """The family of the orbit that a run ends on."""
    orbit = find_orbit(runs.system, run, compiled=runs.compiled)
    return continue_orbit(orbit, runs.parameter, bounds, upward=upward, compiled=runs.compiled)


def _walk(  # noqa: PLR0913, PLR0917 - from where, in which direction
    runs: Runs, run: Run, verdict: Hunting, value: float, bounds: tuple[float, float], upward: bool
) -> list[Interval]:
    """Intervals of hunting from a run at a value to where it ends."""
    sign, goal = (1, bounds[1]) if upward else (-1, bounds[0])
    margin = BEYOND * max(abs(bounds[0]), abs(bounds[1]))
    found: list[Interval] = []
    while len(found) < MOST:
        branch, why = None, verdict.reason
        if verdict.cycles:
            try:
                branch = _family(runs, run, bounds, upward)
            except NoOrbit as error:
                why = str(error)
        if branch is not None:
            last, end = branch.orbits[-1], branch.end
            found.append(Interval(value, end.value, branch, end))
            begin = dict(zip((state.name for state in runs.system.states), last.x0.tolist(), strict=True))
            ahead, step = end.value, margin
        else:
            begin, ahead, step = run.state(), value, max(margin, (bounds[1] - bounds[0]) / STEPS)
        if (branch is not None and branch.end.kind == BOUND) or ahead == goal:
            raise NoOrbit(f"{runs.system.name}: hunting goes on up to the other bound, {runs.parameter} = {goal:g}")
        before, previous, value = run, ahead, sign * min(sign * (ahead + sign * step), sign * goal)
        run, verdict = runs.at(value, begin)
        if branch is not None:
            if not moves(verdict):
                return found
            continue
        interval = (
            found[-1] if found and found[-1].branch is None else Interval(previous, value, None, End("", value, ""))
        )
        if not moves(verdict):
            hunts, rests, verdict = runs.bisect(previous, before, value, verdict, bounds)
            middle = (hunts + rests) / 2
            end = End(verdict.verdict, middle, f"between runs at {hunts:.6g} and {rests:.6g}; {verdict.reason}")
        else:
            middle, end = value, End(RUNS, value, why)
        merged = interval._replace(ends=middle, end=end)
        found = [*(found[:-1] if interval in found else found), merged]
        if not moves(verdict):
            return found
    raise NoOrbit(f"{runs.system.name}: hunting changes its kind {MOST} times up to {runs.parameter} = {value:.6g}")
