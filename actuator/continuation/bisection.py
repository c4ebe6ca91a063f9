"""Where hunting ends over one parameter, by bisection of simulations."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from actuator.actuator import Actuator
from actuator.orbits.flow import NoOrbit
from actuator.simulation.run import Run
from actuator.system.hybrid import HybridSystem
from actuator.verdict.verdict import DIVERGING, REST, Hunting, decide

RESOLVED = 2e-3  # of the larger bound: bisection stops
BISECTIONS = 40
POINTS = 5000  # output points of a run


def moves(verdict: Hunting) -> bool:
    """Whether motion goes on; irregular motion counts, motion that grows without bound does not."""
    return verdict.verdict not in (REST, DIVERGING)


class Runs:
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

    def bisect(  # noqa: PLR0913, PLR0917 - two runs
        self, hunts: float, run: Run, rests: float, verdict: Hunting, bounds: tuple[float, float]
    ) -> tuple[float, float, Hunting]:
        """The bracket between a value that hunts and one that does not, and the verdict on the latter."""
        for _ in range(BISECTIONS):
            if abs(hunts - rests) < RESOLVED * max(abs(bounds[0]), abs(bounds[1])):
                break
            middle = (hunts + rests) / 2
            trial, found = self.at(middle, run.state())
            if moves(found):
                hunts, run = middle, trial
            else:
                rests, verdict = middle, found
        return hunts, rests, verdict


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
    runs = Runs(plant, parameter, inputs, parameters, duration, compiled)
    found = [runs.at(value, start) for value in bounds]
    # of two, the one that does not hunt by itself may still do so if it is set going
    for here, other in ((0, 1), (1, 0)):
        if moves(found[here][1]) and not moves(found[other][1]):
            found[other] = runs.at(bounds[other], found[here][0].state())
            break
    if moves(found[0][1]) == moves(found[1][1]):
        raise NoOrbit(f"{parameter}: the two bounds are not on two sides of a boundary: {runs.log}")
    inside, outside = (0, 1) if moves(found[0][1]) else (1, 0)
    hunts, rests, _ = runs.bisect(bounds[inside], found[inside][0], bounds[outside], found[outside][1], bounds)
    return Bisection(hunts=hunts, rests=rests, runs=tuple(runs.log))
