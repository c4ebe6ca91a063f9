"""Bench tests of the frequency-response study, by name: each an outcome of numbers and a picture that can be kept."""

import base64
import io
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from actuator import (
    Actuator,
    Bench,
    SimulationError,
    SinePoint,
    SineStream,
    back_driving,
    free_play,
    hold_test,
    locked,
    rate_test,
    soak_test,
    staircase_test,
    step_test,
    temperature_sets,
    triangle_test,
    unpowered,
)
from actuator.response.bench import Numbers
from studies.report import DPI

SMALLEST = 1e-5  # of the stroke, from which the threshold is sought
LARGEST = 0.5  # of the stroke, up to which it is
PLAY = 0.5  # of the largest torque, in the test of free play
INCREMENT = 5e-4  # of the stroke, in the staircase


@dataclass(frozen=True, kw_only=True)
class BenchPlan:
    """What the tests need to know besides the actuator.

    Parameters
    ----------
    stroke : float
        From end to end [rad].
    torque : float
        Largest on the load [N m].
    frequencies : tuple of float
        At which the threshold is sought [Hz].
    temperatures : tuple of float
        Of the soak [K].
    inputs : mapping of str to float
        Constant inputs, without the reference.
    """

    stroke: float
    torque: float
    frequencies: tuple[float, ...]
    temperatures: tuple[float, ...]
    inputs: Mapping[str, float]


class BenchWork:
    """The work of a sweep: from the name of a test to what came of it."""

    def __init__(self, actuator: Actuator, plan: BenchPlan) -> None:
        self.actuator, self.plan = actuator, plan

    def __getstate__(self) -> dict[str, Any]:
        """Another process builds its own model: expressions do not travel."""
        return {"actuator": replace(self.actuator), "plan": self.plan}

    def __call__(self, name: str) -> dict[str, Any]:
        """Numbers with units by name, what is found in words, the picture as PNG in base64; and why there is none."""
        try:
            found = TESTS[name](self.actuator, self.plan)
        except (ValueError, SimulationError) as error:
            return {"numbers": {}, "words": "", "picture": "", "reason": str(error)}
        picture = png(found.figure) if found.figure else ""
        return {"numbers": found.numbers, "words": found.words, "picture": picture, "reason": ""}


class Found(NamedTuple):
    """What comes of a test."""

    numbers: Numbers
    figure: Figure | None
    words: str = ""


def _bench(actuator: Actuator, plan: BenchPlan) -> Bench:
    return Bench(plant=actuator, stroke=plan.stroke, inputs=plan.inputs)


def _drawn(test: Any) -> Found:
    return Found(test.numbers, test.plot())


def _hold(actuator: Actuator, plan: BenchPlan) -> Found:
    test = hold_test(_bench(actuator, plan))
    return Found(test.numbers, test.plot(), f"{test.verdict.verdict} ({test.verdict.reason})")


def _threshold(actuator: Actuator, plan: BenchPlan) -> Found:
    stream = SineStream(plant=actuator)
    found: Numbers = {}
    for frequency in plan.frequencies:
        point = SinePoint(amplitude=1.0, frequency=frequency, inputs=plan.inputs)
        value = stream.threshold(point, SMALLEST * plan.stroke, LARGEST * plan.stroke, accuracy=1e-2)
        found[f"threshold at {frequency:.3g} Hz"] = (value, "rad")
    return Found(found, None)


def _free_play(actuator: Actuator, plan: BenchPlan) -> Found:
    found = free_play(locked(actuator), torque=PLAY * plan.torque, inputs=_of_load(plan))
    numbers = {
        "free play": (found.width_rad, "rad"),
        "lost motion": (found.lost_motion_rad, "rad"),
        "stiffness of the gear": (found.stiffness, "N m/rad"),
    }
    return Found(numbers, found.plot())


def _back_driving(actuator: Actuator, plan: BenchPlan) -> Found:
    found: Numbers = {}
    figure = None
    for word, sign in (("forward", 1), ("backward", -1)):
        test = back_driving(unpowered(actuator), highest=sign * plan.torque, inputs=_of_load(plan))
        found[f"torque that drives back, {word}"] = (math.inf if test.locks else test.torque, "N m")
        figure = figure or test.plot()
    return Found(found, figure)


def _of_load(plan: BenchPlan) -> dict[str, float]:
    """The inputs that an actuator without motor and controller still has."""
    return {name: value for name, value in plan.inputs.items() if name == "load_torque"}


TESTS: dict[str, Callable[[Actuator, BenchPlan], Found]] = {
    "threshold": _threshold,
    "step": lambda actuator, plan: _drawn(step_test(_bench(actuator, plan))),
    "slow triangle": lambda actuator, plan: _drawn(triangle_test(_bench(actuator, plan))),
    "staircase": lambda actuator, plan: _drawn(
        staircase_test(_bench(actuator, plan), increment=INCREMENT * plan.stroke)
    ),
    "hold": _hold,
    "rate and stall": lambda actuator, plan: _drawn(rate_test(_bench(actuator, plan), highest=2 * plan.torque)),
    "temperature soak": lambda actuator, plan: _drawn(
        soak_test(_bench(actuator, plan), temperature_sets(actuator, plan.temperatures))
    ),
    "free play": _free_play,
    "back driving": _back_driving,
}


def png(figure: Figure) -> str:
    """A picture as PNG in base64."""
    memory = io.BytesIO()
    figure.savefig(memory, format="png", dpi=DPI)
    return base64.b64encode(memory.getvalue()).decode()
