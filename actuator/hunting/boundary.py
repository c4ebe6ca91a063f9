"""Where hunting ends over one parameter: as the exact ends of families of orbits, and by bisection of simulations.

A family of orbits may end while hunting goes on: a slip more or less in a period is another family. So where one ends a
run is begun on its last orbit, a little beyond. If it still hunts, the family it leads to is followed; if it hunts
irregularly, runs alone lead on; hunting ends where it comes to rest, or grows without bound.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from actuator.actuator import Actuator
from actuator.hunting.continuation import BOUND, Branch, End, follow
from actuator.hunting.decide import decide
from actuator.hunting.find_orbit import find_orbit
from actuator.hunting.flow_map import NoOrbit
from actuator.hunting.sampled_boundary import SampledBranch, follow_sampled
from actuator.hunting.verdict import DIVERGING, REST, Hunting
from actuator.hybrid import HybridSystem
from actuator.simulation.run import Run

BEYOND = 0.01  # of the larger bound: how far behind the end of a family it is asked whether hunting goes on
STEPS = 25  # of runs alone, from bound to bound
RESOLVED = 2e-3  # of the larger bound: bisection stops
BISECTIONS = 40
POINTS = 5000  # output points of a run
MOST = 20  # stretches
RUNS = "by runs alone"  # how a stretch without orbits ends where hunting goes on


class Stretch(NamedTuple):
    """A range of the parameter in which one kind of hunting goes on."""

    begins: float
    ends: float
    branch: Branch | SampledBranch | None  # the family of exact orbits; None where only runs show that it hunts
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
    stretches : tuple of Stretch
        What hunts up to there, in the order in which it was followed.
    """

    parameter: str
    value: float
    end: End
    stretches: tuple[Stretch, ...] = field(repr=False)

    @property
    def exact(self) -> bool:
        """Whether the value is the end of a family of orbits, and not resolved by runs."""
        return self.stretches[-1].branch is not None

    @property
    def branches(self) -> tuple[Branch | SampledBranch, ...]:
        """The families, each with its own end."""
        return tuple(stretch.branch for stretch in self.stretches if stretch.branch is not None)


@dataclass(frozen=True, kw_only=True)
class Bisection:
    """The value of a parameter between a run that hunts and one that does not.

    Attributes
    ----------
    hunts, rests : float
        The nearest values on both sides.
    runs : tuple of (float, str)
        Value and verdict of every run.
    """

    hunts: float
    rests: float
    runs: tuple[tuple[float, str], ...] = field(repr=False)

    @property
    def value(self) -> float:
        """The middle of the bracket."""
        return (self.hunts + self.rests) / 2


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
        It must hunt at one of the bounds; with sampled controllers, the families are those of `follow_sampled`.
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
    runs = _Runs(plant, parameter, inputs, parameters, duration, compiled)
    reasons = []
    for value, upward in ((bounds[0], True), (bounds[1], False)):
        run, verdict = runs.at(value, start)
        if verdict.cycles:
            stretches = _walk(runs, run, verdict, value, bounds, upward)
            last = stretches[-1]
            return Boundary(parameter=parameter, value=last.end.value, end=last.end, stretches=tuple(stretches))
        reasons.append(f"at {value:g} it is {verdict.verdict!r} ({verdict.reason})")
    raise NoOrbit(f"no cycle at either bound of {parameter}: {'; '.join(reasons)}")


def bisect_by_simulation(  # noqa: PLR0913 - as `hunting_boundary`
    plant: Actuator | HybridSystem,
    parameter: str,
    bounds: tuple[float, float],
    *,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    duration: float = 20.0,
    compiled: bool | None = None,
) -> Bisection:
    """Bracket the end of hunting by runs alone, each begun from the last state that hunted.

    Irregular motion counts as hunting; rest, and motion that grows without bound, do not. Arguments as for
    `hunting_boundary`.

    Raises
    ------
    NoOrbit
        Where both bounds, or neither, hunt.
    """
    runs = _Runs(plant, parameter, inputs, parameters, duration, compiled)
    found = [runs.at(value, start) for value in bounds]
    # of two, the one that does not hunt by itself may still do so if it is set going
    for here, other in ((0, 1), (1, 0)):
        if _moves(found[here][1]) and not _moves(found[other][1]):
            found[other] = runs.at(bounds[other], found[here][0].state())
            break
    if _moves(found[0][1]) == _moves(found[1][1]):
        raise NoOrbit(f"{parameter}: the two bounds are not on two sides of a boundary: {runs.log}")
    inside, outside = (0, 1) if _moves(found[0][1]) else (1, 0)
    hunts, rests, _ = runs.bisect(bounds[inside], found[inside][0], bounds[outside], found[outside][1], bounds)
    return Bisection(hunts=hunts, rests=rests, runs=tuple(runs.log))


def _moves(verdict: Hunting) -> bool:
    return verdict.verdict not in (REST, DIVERGING)


class _Runs:
    """Runs of one plant at values of one parameter."""

    def __init__(  # noqa: PLR0913, PLR0917 - as `hunting_boundary`
        self,
        plant: Actuator | HybridSystem,
        parameter: str,
        inputs: Mapping[str, float] | None,
        parameters: Mapping[str, float] | None,
        duration: float,
        compiled: bool | None,
    ) -> None:
        self.plant, self.parameter, self.parameters = plant, parameter, dict(parameters or {})
        self.system = plant.system() if isinstance(plant, Actuator) else plant
        self.duration, self.compiled = duration, compiled
        self.options: dict[str, Any] = {"inputs": dict(inputs or {}), "resolution": duration / POINTS}
        self.log: list[tuple[float, str]] = []

    def at(self, value: float, start: Mapping[str, float] | None) -> tuple[Run, Hunting]:
        """A run at a value, long enough to decide, and its verdict."""
        changed = {**self.parameters, self.parameter: value}
        run, verdict = decide(
            self.plant, self.duration, parameters=changed, start=start, compiled=self.compiled, **self.options
        )
        self.log.append((value, verdict.verdict))
        return run, verdict

    def family(self, run: Run, bounds: tuple[float, float], upward: bool) -> Branch | SampledBranch:
        """The family of the orbit that a run ends on."""
        if self.system.clocks:
            return follow_sampled(self.system, run, self.parameter, bounds, upward=upward, compiled=self.compiled)
        return follow(find_orbit(self.system, run, compiled=self.compiled), self.parameter, bounds, upward=upward)

    def bisect(  # noqa: PLR0913, PLR0917 - two runs
        self, hunts: float, run: Run, rests: float, verdict: Hunting, bounds: tuple[float, float]
    ) -> tuple[float, float, Hunting]:
        """The bracket between a value that hunts and one that does not, and the verdict on the latter."""
        for _ in range(BISECTIONS):
            if abs(hunts - rests) < RESOLVED * max(abs(bounds[0]), abs(bounds[1])):
                break
            middle = (hunts + rests) / 2
            trial, found = self.at(middle, run.state())
            if _moves(found):
                hunts, run = middle, trial
            else:
                rests, verdict = middle, found
        return hunts, rests, verdict


def _walk(  # noqa: PLR0913, PLR0917 - from where, in which direction
    runs: _Runs, run: Run, verdict: Hunting, value: float, bounds: tuple[float, float], upward: bool
) -> list[Stretch]:
    """Stretches of hunting from a run at a value to where it ends."""
    sign, goal = (1, bounds[1]) if upward else (-1, bounds[0])
    margin = BEYOND * max(abs(bounds[0]), abs(bounds[1]))
    found: list[Stretch] = []
    while len(found) < MOST:
        branch, why = None, verdict.reason
        if verdict.cycles:
            try:
                branch = runs.family(run, bounds, upward)
            except NoOrbit as error:
                why = str(error)
        if branch is not None:
            last, end = branch.orbits[-1], branch.end
            found.append(Stretch(value, end.value, branch, end))
            begin = dict(zip((state.name for state in runs.system.states), last.x0.tolist(), strict=True))
            ahead, step = end.value, margin
        else:
            begin, ahead, step = run.state(), value, max(margin, (bounds[1] - bounds[0]) / STEPS)
        if (branch is not None and branch.end.kind == BOUND) or ahead == goal:
            raise NoOrbit(f"{runs.system.name}: hunting goes on up to the other bound, {runs.parameter} = {goal:g}")
        before, previous, value = run, ahead, sign * min(sign * (ahead + sign * step), sign * goal)
        run, verdict = runs.at(value, begin)
        if branch is not None:
            if not _moves(verdict):
                return found
            continue
        stretch = (
            found[-1] if found and found[-1].branch is None else Stretch(previous, value, None, End("", value, ""))
        )
        if not _moves(verdict):
            hunts, rests, verdict = runs.bisect(previous, before, value, verdict, bounds)
            middle = (hunts + rests) / 2
            end = End(verdict.verdict, middle, f"between runs at {hunts:.6g} and {rests:.6g}; {verdict.reason}")
        else:
            middle, end = value, End("by runs alone", value, why)
        merged = stretch._replace(ends=middle, end=end)
        found = [*(found[:-1] if stretch in found else found), merged]
        if not _moves(verdict):
            return found
    raise NoOrbit(f"{runs.system.name}: hunting changes its kind {MOST} times up to {runs.parameter} = {value:.6g}")
