"""A design checked against its demands by simulation in every corner: hunting, following, current and torque."""

import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.response.sine import SinePoint, SineStream
from actuator.simulation.failures import SimulationError
from actuator.simulation.many import run_many
from actuator.simulation.run import Run
from actuator.simulation.signals import Step
from actuator.simulation.simulate import simulate
from actuator.stiction.standstill import rest_state
from actuator.system.parameters import Parameter, scaled_breakaway
from actuator.verdict.verdict import FAILED, REST, Hunting, Verdict, classify, decide
from studies.cache import fingerprint
from studies.corners import Corner
from studies.specification import Demand

STEPS = (0.1, 1.0, 10.0)  # of the demanded amplitude: a small move, the move itself, a large one
BEFORE, DURATION = 0.05, 10.0  # s, time of the step and first duration
RESOLUTION = 2.5e-3  # s
LONGEST = 6.0  # times the duration, for runs without a verdict
STEP, SINE = "step", "sine"  # kinds of trials


class Trial(NamedTuple):
    """One simulation: a step of a size [rad], or a sine of an amplitude [rad] and frequency [Hz]."""

    kind: str
    parameters: dict[str, float]
    size: float
    frequency: float = 0.0


class StepCase(NamedTuple):
    """A step by its size over the demanded amplitude, and the factor on breakaway friction."""

    size: float
    breakaway: float

    @property
    def label(self) -> str:
        """As of tables."""
        return f"x{self.size:g}, {self.breakaway:.4g} breakaway"


@dataclass(frozen=True, kw_only=True)
class CornerCheck:
    """Results of the simulations of one corner.

    Attributes
    ----------
    corner : str
        Its name.
    verdicts : dict of StepCase to Verdict
        Of every step.
    cycle : float
        Largest amplitude of a cycle at the factor 1 [rad]; zero without a cycle.
    standing_error : float
        Largest error at rest [rad], of the runs that come to rest.
    followed : float
        Load angle over reference at the demanded bandwidth and amplitude [-]; zero where the simulation failed.
    settled : bool
        Whether that sine has settled.
    overshoot : float
        Of the step of the demanded amplitude, over the travel from where the load was at rest [-].
    peak_current, peak_torque : float
        Of the motor from the step of the demanded amplitude on [A], [N m]; nan where there is no current.
    """

    corner: str
    verdicts: dict[StepCase, Verdict]
    cycle: float
    standing_error: float
    followed: float
    settled: bool
    overshoot: float
    peak_current: float
    peak_torque: float

    def hunts(self, factor: float) -> bool:
        """Whether a run with this factor on breakaway friction does not come to rest."""
        return any(verdict != REST for case, verdict in self.verdicts.items() if case.breakaway == factor)


class Bench:
    """Runs trials of one actuator.

    Parameters
    ----------
    plant : Actuator
        What is simulated.
    """

    def __init__(self, plant: Actuator) -> None:
        self.plant, self.stream = plant, SineStream(plant=plant)

    def __call__(self, trial: Trial) -> dict[str, Any]:
        """Verdict and numbers of a step, or gain of a sine."""
        if trial.kind == SINE:
            found = self.stream.measure(
                SinePoint(amplitude=trial.size, frequency=trial.frequency, parameters=trial.parameters)
            )
            value = abs(complex(*found.harmonics[0][1])) / trial.size
            return {"followed": value if math.isfinite(value) else 0.0, "settled": found.settled}
        try:
            first, run, hunting = self.stepped(trial)
        except SimulationError as error:
            return {"verdict": FAILED, "reason": str(error)}
        after = first.t >= BEFORE
        current = first["current"][after] if "current" in first.signals else np.array([math.nan])
        load = first["load_angle"][after]
        return {
            "verdict": hunting.verdict,
            "reason": hunting.reason,
            "amplitude": hunting.amplitude_rad if hunting.cycles else 0.0,
            "error": abs(float(run["position_error"][-1])) if hunting.verdict == REST else 0.0,
            "overshoot": float((load.max() - load[0]) / (trial.size - load[0])) - 1,
            "peak_current": float(abs(current).max()),
            "peak_torque": float(abs(first["motor_torque"][after]).max()),
        }

    def stepped(self, trial: Trial) -> tuple[Run, Run, Hunting]:
        """The step from rest, the run that decides (the same, or what follows it), and the verdict."""
        common = {"parameters": trial.parameters, "resolution": RESOLUTION}
        start = rest_state(self.plant, {"reference": 0.0}, trial.parameters)
        step = Step(time=BEFORE, after=trial.size)
        first = simulate(self.plant, DURATION, inputs={"reference": step}, start=start, **common)
        hunting = classify(first)
        if hunting.decided:
            return first, first, hunting
        left = (LONGEST - 1) * DURATION
        more, held = min(hunting.longer_s, left), {"reference": trial.size}
        run, hunting = decide(self.plant, more, inputs=held, longest=left / more, start=first.state(), **common)
        return first, run, hunting


def step_trials(
    corner: Corner, design: Mapping[str, float], demand: Demand, parameters: Sequence[Parameter], factor: float
) -> dict[StepCase, Trial]:
    """Steps of all sizes in a corner, with a factor on breakaway friction, which does not fall below sliding."""
    changed = corner.parameters | dict(design)
    values = {parameter.name: float(parameter.default) for parameter in parameters} | changed
    sticky = scaled_breakaway(parameters, factor, values)
    return {StepCase(size, factor): Trial(STEP, changed | sticky, size * demand.sine) for size in STEPS}


def check_corners(  # noqa: PLR0913 - what is checked, and how it is run
    plant: Actuator,
    corners: Sequence[Corner],
    design: Mapping[str, float],
    demand: Demand,
    *,
    done: MutableMapping[str, dict[str, Any]] | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[CornerCheck]:
    """Simulate a design in every corner: steps with breakaway friction as it is and with its margin, and a sine.

    Parameters
    ----------
    plant : Actuator
        With all parameters of the design.
    corners : sequence of Corner
        Where.
    design : mapping of str to float
        Gains by name.
    demand : Demand
        Amplitude, bandwidth and stiction margin.
    done, workers, progress
        As for `run_many`.
    """
    parameters, model = plant.system().parameters, fingerprint(plant)
    factors = tuple(dict.fromkeys((1.0, demand.stiction_margin)))
    trials: dict[tuple[str, StepCase | None], Trial] = {}
    for corner in corners:
        for factor in factors:
            steps = step_trials(corner, design, demand, parameters, factor)
            trials |= {(corner.name, case): trial for case, trial in steps.items()}
        sine = Trial(SINE, corner.parameters | dict(design), demand.sine, demand.bandwidth)
        trials[corner.name, None] = sine
    keys = {place: fingerprint(model, trial) for place, trial in trials.items()}
    points = {keys[place]: trial for place, trial in trials.items()}
    results = run_many(Bench(plant), points, done=done, workers=workers, progress=progress)
    return [
        _check_corner(
            corner.name,
            {case: results[keys[name, case]] for name, case in trials if name == corner.name and case is not None},
            results[keys[corner.name, None]],
        )
        for corner in corners
    ]


def _check_corner(corner: str, steps: Mapping[StepCase, dict[str, Any]], sine: Mapping[str, Any]) -> CornerCheck:
    own = steps[StepCase(1.0, 1.0)]
    return CornerCheck(
        corner=corner,
        verdicts={case: Verdict(result["verdict"]) for case, result in steps.items()},
        cycle=max(result.get("amplitude", 0.0) for case, result in steps.items() if case.breakaway == 1.0),
        standing_error=max(result.get("error", 0.0) for result in steps.values()),
        followed=sine["followed"],
        settled=sine["settled"],
        overshoot=own.get("overshoot", math.nan),
        peak_current=own.get("peak_current", math.nan),
        peak_torque=own.get("peak_torque", math.nan),
    )
