"""Runs of one plant over the values of one parameter, and bisection between one that hunts and one that does not."""

from collections.abc import Mapping
from typing import Any

from actuator.actuator import Actuator
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
