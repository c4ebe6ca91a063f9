"""Simulate until the verdict on hunting is decided."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from actuator.actuator import Actuator
from actuator.simulation.run import Run
from actuator.simulation.signals import Signal
from actuator.simulation.simulate import simulate
from actuator.system.hybrid import HybridSystem
from actuator.verdict.verdict import Hunting, classify

LONGEST = 4.0  # times the first duration


class Decision(NamedTuple):
    """The last run, and the verdict on it."""

    run: Run
    hunting: Hunting


def decide(
    plant: Actuator | HybridSystem,
    duration: float,
    *,
    inputs: Mapping[str, Signal | float] | None = None,
    longest: float = LONGEST,
    **options: Any,
) -> Decision:
    """Simulate, and where that does not decide, go on from there for as long as the verdict asks for.

    Parameters
    ----------
    plant, duration, inputs
        As for `simulate`.
    longest : float
        Times the duration that may be simulated in all; what is not decided then stays "irregular".
    **options
        Of `simulate`.
    """
    run = simulate(plant, duration, inputs=inputs, **options)
    hunting, left = classify(run), (longest - 1) * duration
    while not hunting.decided and left > 0:
        more = min(hunting.longer_s, left)
        left -= more
        held = {quantity.name: float(run[quantity.name][-1]) for quantity in run.system.inputs}
        again: dict[str, Any] = options | {"start": run.state()}
        run = simulate(plant, more, inputs=held, **again)
        hunting = classify(run)
    return Decision(run, hunting)
