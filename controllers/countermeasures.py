"""Countermeasures against stick-slip hunting that several controllers offer, with their settings.

Settings follow from the cycle and from what stiction holds: with A the amplitude and H half of the range of motor
torques that stiction holds,

    dead band          BAND * A                    rests wherever it stops inside
    leakage            total gain at rest SHARE * H/A, so that no error of size A breaks away
    compensation       COMPENSATED * H             less than all, or it pushes the drive on by itself
    dither, knocker    OVER * H                    nothing sticks for longer than one interval
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import reduce
from typing import Any, NamedTuple

from controllers.controller import Controller, integrating_law
from controllers.integral import IntegralRemedies
from controllers.sampling import Sampling

BAND, SHARE, COMPENSATED, OVER = 1.5, 0.5, 0.7, 1.2
FASTER = 10.0  # factor on back-calculation
UNKNOWN = math.nan


class StickingCycle(NamedTuple):
    """What the settings rest on: a cycle, and what stiction holds in it."""

    amplitude: float  # rad at the load
    half: float  # half of the range of motor torques that stiction holds, N m
    worst_error: Callable[[float], float]  # largest error at rest [rad] for a gain at rest [N m/rad] at the motor
    speed: float  # largest of the motor, rad/s
    lost: float  # largest difference of motor and load, rad at the load
    ratio: float  # motor turns per load turn
    sampling: Sampling | None


class Countermeasure(NamedTuple):
    """One thing to do, and what is predicted of it.

    `numbers` are values of fields of `controller` by their path from it: one controller that several share is
    compiled once. `error` is the largest error at rest [rad] and `period` the one [s] of a motion that it makes
    itself, nan where there is none.
    """

    name: str
    setting: str
    controller: Controller
    numbers: dict[str, float]
    error: float = UNKNOWN
    period: float = UNKNOWN


def with_integral(controller: Any, **changes: Any) -> Any:
    """The controller with another integrating law."""
    path = controller.integrating_path()
    return replace(controller, **{path: replace(getattr(controller, path), **changes)} if path else changes)


def with_switchable_integral(controller: Any) -> Any:
    """The controller with all that a number switches on at its integral there, and off."""
    law = integrating_law(controller)
    old = law.remedies or IntegralRemedies()
    off = replace(old, dead_band=old.dead_band or 0.0, leakage=old.leakage or 0.0)
    rate = law.integral / law.proportional if law.back_calculation is None else law.back_calculation
    follows = {"back_calculation": rate} if law.anti_windup == "back-calculation" else {}
    return with_integral(controller, remedies=off, **follows)


def at_the_integral(
    ready: Controller, cycle: StickingCycle, *, gain: float, integral: float, unit: str
) -> list[Countermeasure]:
    """What numbers do at the integral of a controller that has them ready.

    Parameters
    ----------
    ready : Controller
        `with_switchable_integral`.
    cycle : StickingCycle
        What the settings rest on.
    gain, integral : float
        Torque at the motor per rad of position error without integral action [N m/rad], and of it [N m/(rad s)].
    unit : str
        Of the error that is integrated.
    """
    law, path = integrating_law(ready), ready.integrating_path()
    prefix, found = f"{path}." if path else "", []
    if integral <= 0:
        return found
    band = BAND * cycle.amplitude
    error = band * abs(ready.error_at_integral(cycle.ratio))
    found.append(
        Countermeasure(
            "integrator dead band", f"{error:.3g} {unit}", ready, {f"{prefix}remedies.dead_band": error}, band
        )
    )
    total = SHARE * cycle.half / cycle.amplitude
    if total > gain:
        rate = integral / (total - gain)
        numbers = {f"{prefix}remedies.leakage": rate}
        found.append(Countermeasure("leaking integrator", f"{rate:.3g} 1/s", ready, numbers, cycle.worst_error(total)))
    if law.back_calculation is not None:
        rate = FASTER * law.back_calculation
        numbers = {f"{prefix}back_calculation": rate}
        found.append(Countermeasure("faster anti-windup", f"{rate:.3g} 1/s", ready, numbers))
    return found


def retune(controller: Controller, options: Mapping[str, Mapping[str, float]]) -> list[Countermeasure]:
    """The same structure with gains by factors: text -> path from the controller -> factor."""
    found = []
    for text, factors in options.items():
        values = {path: value_at(controller, path) for path in factors}
        numbers = {path: factors[path] * value for path, value in values.items() if value}
        if numbers:
            found.append(Countermeasure("retuning", text, controller, numbers))
    return found


def reset_on_reversal(controller: Controller, cycle: StickingCycle) -> list[Countermeasure]:
    """The integral started again at each reversal, where the controller is sampled and integrates."""
    law = integrating_law(controller)
    if cycle.sampling is None or not law.integral > 0:
        return []
    again = replace(law.remedies or IntegralRemedies(), reset_on_reversal=True)
    return [Countermeasure("integrator reset on reversal", "", with_integral(controller, remedies=again), {})]


def value_at(part: Any, path: str) -> Any:
    """A field by its path from a part; None where there is none."""
    return reduce(lambda found, name: getattr(found, name, None), path.split("."), part)
