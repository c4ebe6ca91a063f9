"""A design held against its demands by simulation, in every corner: does it hunt, does it follow, what does it draw."""

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
from actuator.stiction.margins import SLIDING, at_least_sliding
from actuator.stiction.standstill import rest_of
from actuator.verdict.verdict import FAILED, REST, Hunting, classify, decide
from studies.cache import fingerprint
from studies.specification import Corner, Demand
from studies.tuning.plant import defaults_of

STEPS = (0.1, 1.0, 10.0)  # of the demanded amplitude: a small move, the move itself, a large one
BEFORE, DURATION = 0.05, 10.0  # s, when the step comes and how long is looked at first
RESOLUTION = 2.5e-3  # s
LONGEST = 6.0  # times the duration, for runs that do not decide
STEP, SINE = "step", "sine"


class Trial(NamedTuple):
    """One simulation: a step of a size [rad], or a sine of an amplitude [rad] and frequency [Hz]."""

    kind: str
    parameters: dict[str, float]
    size: float
    frequency: float = 0.0


@dataclass(frozen=True, kw_only=True)
class CornerCheck:
    """What the simulations of one corner show.

    Attributes
    ----------
    corner : str
        Its name.
    verdicts : dict of str to str
        By step size over the demanded amplitude and factor on breakaway friction, "x0.1, 1.3 breakaway".
    cycle : float
        Largest amplitude of a cycle at the factor 1 [rad]; zero where nothing hunts.
    standing_error : float
        Largest error at rest [rad], of those runs that rest.
    followed : float
        Load angle over reference at the demanded bandwidth and amplitude [-]; zero where the simulation failed.
    settled : bool
        Whether that sine has settled.
    overshoot : float
        Of the step of the demanded amplitude, over the way from where the load was at rest [-].
    peak_current, peak_torque : float
        Of the motor in the step of the demanded amplitude, once it has begun [A], [N m]; nan where there is no current.
    """

    corner: str
    verdicts: dict[str, str]
    cycle: float
    standing_error: float
    followed: float
    settled: bool
    overshoot: float
    peak_current: float
    peak_torque: float

    def hunts(self, factor: float) -> bool:
        """Whether a run with this factor on breakaway friction does not come to rest."""
        return any(verdict != REST for name, verdict in self.verdicts.items() if name.endswith(_label(factor)))


def _label(factor: float) -> str:
    return f"{factor:.4g} breakaway"


class Bench:
    """Runs trials of one actuator.

    Parameters
    ----------
    plant : Actuator
        What is tried.
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
        start = rest_of(self.plant, {"reference": 0.0}, trial.parameters)
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
    corner: Corner, design: Mapping[str, float], demand: Demand, defaults: Mapping[str, float], factor: float
) -> dict[str, Trial]:
    """Steps of all sizes in a corner, with a factor on breakaway friction; that is never below sliding friction."""
    parameters = corner.parameters | dict(design)
    values = dict(defaults) | parameters
    names = [name for name in values if name.endswith(tuple(SLIDING))]
    sticky = {name: at_least_sliding(name, factor * values[name], values) for name in names}
    return {f"x{part:g}, {_label(factor)}": Trial(STEP, parameters | sticky, part * demand.sine) for part in STEPS}


def trials(
    corner: Corner, design: Mapping[str, float], demand: Demand, defaults: Mapping[str, float]
) -> dict[str, Trial]:
    """What is simulated in a corner, by what it is called."""
    found = {}
    for factor in dict.fromkeys((1.0, demand.stiction_margin)):
        found |= step_trials(corner, design, demand, defaults, factor)
    found[SINE] = Trial(SINE, corner.parameters | dict(design), demand.sine, demand.bandwidth)
    return found


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
    """Simulate a design in every corner.

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
    defaults, model = defaults_of(plant.system().parameters), repr(plant)
    wanted = {corner.name: trials(corner, design, demand, defaults) for corner in corners}
    keys = {
        (corner, name): fingerprint([model, *trial])
        for corner, named in wanted.items()
        for name, trial in named.items()
    }
    points = {keys[corner, name]: trial for corner, named in wanted.items() for name, trial in named.items()}
    results = run_many(Bench(plant), points, done=done, workers=workers, progress=progress)
    return [_summed(corner, {name: results[keys[corner, name]] for name in named}) for corner, named in wanted.items()]


def _summed(corner: str, found: Mapping[str, dict[str, Any]]) -> CornerCheck:
    steps = {name: result for name, result in found.items() if name != SINE}
    plain = [result for name, result in steps.items() if name.endswith(_label(1.0))]
    own = steps[f"x1, {_label(1.0)}"]
    return CornerCheck(
        corner=corner,
        verdicts={name: result["verdict"] for name, result in steps.items()},
        cycle=max(result.get("amplitude", 0.0) for result in plain),
        standing_error=max(result.get("error", 0.0) for result in steps.values()),
        followed=found[SINE]["followed"],
        settled=found[SINE]["settled"],
        overshoot=own.get("overshoot", math.nan),
        peak_current=own.get("peak_current", math.nan),
        peak_torque=own.get("peak_torque", math.nan),
    )
