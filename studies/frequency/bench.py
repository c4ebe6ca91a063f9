"""Bench tests of the frequency-response study by name, each with numbers and a picture that can be cached."""

import base64
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from actuator import (
    Actuator,
    Bench,
    SimulationError,
    SinePoint,
    SineStream,
    back_driving,
    block_motor,
    free_play,
    hold_test,
    rate_test,
    remove_drive,
    soak_test,
    staircase_test,
    step_test,
    triangle_test,
)
from actuator.response.bench.bench import BenchTest, Numbers
from studies.findings import png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMALLEST, LARGEST = 1e-5, 0.5  # of the stroke, between which the threshold is sought
PLAY = 0.5  # of the largest torque, in the test of free play
CORNERS = "every corner"  # the one test that depends on them
INCREMENT = 5e-4  # of the stroke, in the staircase


@dataclass(frozen=True, kw_only=True)
class BenchPlan:
    """Settings of the tests, besides the actuator.

    Parameters
    ----------
    stroke : float
        From end to end [rad].
    torque : float
        Largest on the load [N m].
    frequencies : tuple of float
        At which the threshold is sought [Hz].
    sets : mapping of str to mapping of str to float
        Parameters by name of the corner.
    inputs : mapping of str to float
        Constant inputs, without the reference.
    """

    stroke: float
    torque: float
    frequencies: tuple[float, ...]
    sets: Mapping[str, Mapping[str, float]]
    inputs: Mapping[str, float]


class BenchWork:
    """The work of `run_many`: from the name of a test to its result."""

    def __init__(self, actuator: Actuator, plan: BenchPlan) -> None:
        self.actuator, self.plan = actuator, plan

    def __call__(self, name: str) -> dict[str, Any]:
        """Numbers with units by name, a text, the picture as PNG in base64, and the reason where there is none."""
        try:
            found = TESTS[name](self.actuator, self.plan)
        except (ValueError, SimulationError) as error:
            return {"numbers": {}, "words": "", "picture": "", "reason": str(error)}
        picture = base64.b64encode(png(found.figure)).decode() if found.figure else ""
        return {"numbers": found.numbers, "words": found.words, "picture": picture, "reason": ""}


class BenchResult(NamedTuple):
    """The result of a test."""

    numbers: Numbers
    figure: "Figure | None"
    words: str = ""


def _bench(actuator: Actuator, plan: BenchPlan) -> Bench:
    return Bench(plant=actuator, stroke=plan.stroke, inputs=plan.inputs)


def _plotted(test: BenchTest) -> BenchResult:
    return BenchResult(test.numbers, test.plot())


def _hold(actuator: Actuator, plan: BenchPlan) -> BenchResult:
    test = hold_test(_bench(actuator, plan))
    return BenchResult(test.numbers, test.plot(), f"{test.verdict.verdict} ({test.verdict.reason})")


def _threshold(actuator: Actuator, plan: BenchPlan) -> BenchResult:
    stream = SineStream(plant=actuator)
    found: Numbers = {}
    for frequency in plan.frequencies:
        point = SinePoint(amplitude=1.0, frequency=frequency, inputs=plan.inputs)
        value = stream.threshold(point, SMALLEST * plan.stroke, LARGEST * plan.stroke, accuracy=1e-2)
        found[f"threshold at {frequency:.3g} Hz"] = (value, "rad")
    return BenchResult(found, None)


def _free_play(actuator: Actuator, plan: BenchPlan) -> BenchResult:
    return _plotted(free_play(block_motor(actuator), torque=PLAY * plan.torque, inputs=_of_load(plan)))


def _back_driving(actuator: Actuator, plan: BenchPlan) -> BenchResult:
    found: Numbers = {}
    figure, locked_directions = None, []
    for word, sign in (("forward", 1), ("backward", -1)):
        test = back_driving(remove_drive(actuator), highest=sign * plan.torque, inputs=_of_load(plan))
        found[f"back-driving torque, {word}"] = (math.inf if test.locks else test.torque, "N m")
        figure = figure or test.plot()
        locked_directions += [word] if test.locks else []
    directions = " or ".join(locked_directions)
    words = f"not back-driven {directions} up to {plan.torque:.4g} N m" if directions else ""
    return BenchResult(found, figure, words)


def _soak(actuator: Actuator, plan: BenchPlan) -> BenchResult:
    if len(plan.sets) == 1:
        raise ValueError("the only corner is the actuator as it is; give others with --corner")
    return _plotted(soak_test(_bench(actuator, plan), plan.sets))


def _of_load(plan: BenchPlan) -> dict[str, float]:
    """The inputs that remain without motor and controller."""
    return {name: value for name, value in plan.inputs.items() if name == "load_torque"}


TESTS: dict[str, Callable[[Actuator, BenchPlan], BenchResult]] = {
    "threshold": _threshold,
    "step": lambda actuator, plan: _plotted(step_test(_bench(actuator, plan))),
    "slow triangle": lambda actuator, plan: _plotted(triangle_test(_bench(actuator, plan))),
    "staircase": lambda actuator, plan: _plotted(
        staircase_test(_bench(actuator, plan), increment=INCREMENT * plan.stroke)
    ),
    "hold": _hold,
    "rate and stall": lambda actuator, plan: _plotted(rate_test(_bench(actuator, plan), highest=2 * plan.torque)),
    CORNERS: _soak,
    "free play": _free_play,
    "back driving": _back_driving,
}
