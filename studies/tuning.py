"""From a specification to the gains of a cascade: closed-form start, constrained optimization, check by simulation.

The least standing error is sought at which the integral may have its dead band, so that the actuator holds its load as
stiffly as the demands leave room for:

    minimize    ln e over ln gains    subject to    slip D(gains) <= e <= standing error demanded,
                                                    all other demands, in every corner and contact mode

by sequential quadratic programming with the exact derivatives of `tuning_measures`. Few corners and modes decide; the
problem is solved with those, held against all, and solved again with the ones it violates until there are none. What
the simulation of a corner then shows to be short of its demand tightens that demand by as much, and all is done again.
"""

import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from actuator.actuator import Actuator
from controllers.cascade import Cascade
from controllers.integral import IntegralRemedies
from controllers.pid import PI, P
from studies.specification import Corner, Demand, Specification
from studies.tuning_check import CornerCheck, check_corners
from studies.tuning_design import INTEGRAL, POSITION, SPEED, Design, NotTunable, design
from studies.tuning_measures import CornerModes, Measure, corner_modes, defaults_of, measures, worst

DEAD_BAND = "controller.speed.remedies.dead_band"
ROOM = 1.5  # bandwidth of the position loop at the start, over the demanded one
APART = 4.0  # speed bandwidth over that of the position loop, and over the rate of the integral
TIGHTER = 1.25  # factor on the slip where a corner hunts all the same
BEYOND = 1.02  # and on the bandwidth, over what is missing
ROUNDS = 6


class Round(NamedTuple):
    """One design and what the simulations of it showed."""

    tightening: dict[str, float]
    design: Design
    checks: list[CornerCheck]


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """The answer.

    Attributes
    ----------
    specification : Specification
        What was asked for.
    original, plant : Actuator
        As it was, and tuned.
    corners : tuple of Corner
        All of them.
    before : dict of str to float
        Gains as they were.
    start : dict of str to float
        Gains in closed form.
    before_measures : tuple of Measure
        Of the gains as they were.
    before_checks : list of CornerCheck
        Likewise.
    rounds : tuple of Round
        The last is the answer.
    trade_off : tuple of (float, float)
        Stiction margin and least standing error [rad] with it.
    """

    specification: Specification
    original: Actuator = field(repr=False)
    plant: Actuator = field(repr=False)
    corners: tuple[Corner, ...] = field(repr=False)
    before: dict[str, float]
    start: dict[str, float]
    before_measures: tuple[Measure, ...] = field(repr=False)
    before_checks: list[CornerCheck] = field(repr=False)
    rounds: tuple[Round, ...] = field(repr=False)
    trade_off: tuple[tuple[float, float], ...]

    @property
    def design(self) -> Design:
        """The last one."""
        return self.rounds[-1].design

    @property
    def parameters(self) -> dict[str, float]:
        """Gains and dead band by name."""
        return with_dead_band(self.original, self.design.gains, self.design.standing_error)

    @property
    def met(self) -> bool:
        """Whether the simulations show every demand to be met."""
        return not shortfalls(self.rounds[-1].checks, self.specification.demand)


# -- the actuator -----------------------------------------------------------------------------------------


def inertia_at_motor(plant: Actuator) -> float:
    """Inertia of motor, gear and load that the motor turns [kg m^2]."""
    turns = {name: float(value) for name, value in plant.gear.travel().items()}
    own = turns[plant.gear.input]
    total = sum(shaft.inertia * (turns[name] / own) ** 2 for name, shaft in plant.gear.shafts.items())
    return (
        total
        + getattr(plant.motor, "inertia", 0.0)
        + plant.load.inertia_at(0.0) * (turns[plant.gear.output] / own) ** 2
    )


def closed_form(plant: Actuator, demand: Demand) -> dict[str, float]:
    """Gains by loop shaping: bandwidths apart by a factor of four, on the inertia that the motor turns."""
    position = 2 * math.pi * demand.bandwidth * ROOM
    law = PI.for_inertia(
        inertia=inertia_at_motor(plant), bandwidth=APART * position, integral_bandwidth=APART * position / APART
    )
    return {POSITION: position, SPEED: law.proportional, INTEGRAL: law.integral}


def tunable(plant: Actuator) -> Cascade:
    """The cascade of an actuator; NotTunable with the reason where it is not one that can be tuned here."""
    controller = plant.controller
    if not isinstance(controller, Cascade) or not isinstance(controller.position, P):
        raise NotTunable(f"{plant.name}: tuning takes a Cascade with a P position law, not {type(controller).__name__}")
    if plant.sampling is not None:
        raise NotTunable(
            f"{plant.name}: tuning takes a controller in continuous time; leave `sampling` out of the case"
        )
    return controller


def without_dead_band(plant: Actuator) -> Actuator:
    """With the integral at work everywhere, for the linear models."""
    controller = tunable(plant)
    return replace(plant, controller=replace(controller, speed=replace(controller.speed, remedies=None)))


def dead_banded(plant: Actuator) -> Actuator:
    """With a dead band of the integral, of width zero."""
    controller = tunable(plant)
    remedies = replace(controller.speed.remedies or IntegralRemedies(), dead_band=0.0)
    return replace(plant, controller=replace(controller, speed=replace(controller.speed, remedies=remedies)))


def with_dead_band(plant: Actuator, gains: Mapping[str, float], error: float) -> dict[str, float]:
    """Gains and the dead band [rad/s at the motor] that leaves this error [rad] at the load."""
    defaults = defaults_of(plant.system().parameters)
    return {**gains, DEAD_BAND: abs(plant.gear.ratio()) * gains.get(POSITION, defaults[POSITION]) * error}


# -- the study --------------------------------------------------------------------------------------------


def shortfalls(checks: Sequence[CornerCheck], demand: Demand) -> dict[str, float]:
    """Factors on demands that the simulations ask for, by name of the measure; empty where all is well."""
    asked = {}
    if any(check.hunts(1.0) or check.hunts(demand.stiction_margin) for check in checks):
        asked["slip"] = TIGHTER
    least = min(check.followed for check in checks)
    if not least >= 1 / math.sqrt(2):
        asked["bandwidth"] = BEYOND / (math.sqrt(2) * max(least, 0.1))
    return asked


def tune(  # noqa: PLR0913 - the task, and how it is run
    specification: Specification,
    original: Actuator,
    *,
    margins: Sequence[float] = (1.0, 1.5, 2.0, 2.5),
    done: MutableMapping[str, dict[str, Any]] | None = None,
    workers: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Tuned:
    """Tune an actuator, and hold it before and after against its demands by simulation in every corner.

    Parameters
    ----------
    specification : Specification
        The task.
    original : Actuator
        As it is.
    margins : sequence of float
        Stiction margins of the trade-off curve.
    done : mutable mapping of str to dict or None
        Finished simulations, as for `sweep`.
    workers : int or None
        Processes.
    progress : callable or None
        Called with what is done at present and the share of it that is.

    Raises
    ------
    NotTunable
        Where the actuator is not one that can be tuned here, or no gains meet the demands, or simulations go on to
        show less than the linear models.
    """
    tell = progress or (lambda what, share: None)
    if not specification.tuning.dead_band:
        raise NotTunable(
            "integral action hunts after some small move wherever breakaway friction exceeds sliding friction, "
            "whatever the gains; allow tuning.dead_band"
        )
    demand, linear, plant = specification.demand, without_dead_band(original), dead_banded(original)
    wrong = [name for name in specification.tuning.gains if name not in (POSITION, SPEED, INTEGRAL)]
    if wrong:
        raise NotTunable(f"tuning.gains may name {POSITION}, {SPEED} and {INTEGRAL}, not {', '.join(wrong)}")
    corners = specification.all_corners(original)
    defaults = defaults_of(original.system().parameters)
    before = {name: defaults[name] for name in specification.tuning.gains}
    start = {name: value for name, value in closed_form(original, demand).items() if name in before}
    everywhere = [
        corner_modes(linear, corner, demand.stiction_margin, before)
        for k, corner in enumerate(corners)
        if tell("operating points", k / len(corners)) is None
    ]
    before_measures = tuple(m for modes in everywhere for m in measures(modes, before, demand, {}))
    options = {"done": done, "workers": workers}
    before_checks = check_corners(
        plant, corners, before, demand, **options, progress=lambda n, of: tell("as it is", n / of)
    )
    twins = twins_of(before_measures)
    distinct = [modes for modes in everywhere if modes.corner.name in twins]
    tightening: dict[str, float] = {}
    rounds: list[Round] = []
    for k in range(ROUNDS):
        tell(f"optimization {k + 1}", 0.0)
        found = design(distinct, rounds[-1].design.gains if rounds else start, specification, tightening)
        found = replace(
            found, measures=tuple(m._replace(corner=name) for m in found.measures for name in twins[m.corner])
        )
        parameters = with_dead_band(original, found.gains, found.standing_error)
        checks = check_corners(
            plant, corners, parameters, demand, **options, progress=lambda n, of: tell("tuned", n / of)
        )
        rounds.append(Round(dict(tightening), found, checks))
        asked = shortfalls(checks, demand)
        if not asked:
            break
        for name, factor in asked.items():
            tightening[name] = tightening.get(name, 1.0) * factor
    else:
        raise NotTunable(f"after {ROUNDS} rounds the simulations still show less than demanded: {', '.join(asked)}")
    curve = trade_off(linear, distinct, rounds[-1], specification, margins, lambda share: tell("trade-off", share))
    return Tuned(
        specification=specification,
        original=original,
        plant=plant,
        corners=tuple(corners),
        before=before,
        start=start,
        before_measures=before_measures,
        before_checks=before_checks,
        rounds=tuple(rounds),
        trade_off=curve,
    )


def twins_of(found: Sequence[Measure]) -> dict[str, list[str]]:
    """Corners whose linear models are the same, by the first of them: backlash, for one, is not seen by them."""
    seen: dict[str, list[tuple]] = {}
    for m in found:
        row = (m.name, m.mode, *(f"{value:.8g}" for value in (m.value, *m.slopes + 1.0)))
        seen.setdefault(m.corner, []).append(row)
    twins: dict[str, list[str]] = {}
    for corner, rows in seen.items():
        first = next((name for name in twins if seen[name] == rows), corner)
        twins.setdefault(first, []).append(corner)
    return twins


def trade_off(  # noqa: PLR0913, PLR0917 - a design, and along what it is varied
    linear: Actuator,
    everywhere: Sequence[CornerModes],
    last: Round,
    specification: Specification,
    margins: Sequence[float],
    progress: Callable[[float], None],
) -> tuple[tuple[float, float], ...]:
    """Least standing error [rad] over the stiction margin, all other demands met, in the corners that decide."""
    deciding = {measure.corner for measure in worst(last.design.measures).values()}
    demand, curve = specification.demand, []
    for k, margin in enumerate(margins):
        progress(k / len(margins))
        relaxed = replace(specification, demand=replace(demand, standing_error=demand.stroke, stiction_margin=margin))
        corners = [
            corner_modes(linear, modes.corner, margin, last.design.gains)
            for modes in everywhere
            if modes.corner.name in deciding
        ]
        found = design(corners, last.design.gains, relaxed, last.tightening)
        curve.append((margin, found.standing_error))
    return tuple(curve)
