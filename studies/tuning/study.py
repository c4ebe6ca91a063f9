"""From a specification to the gains of a cascade or a PID: closed-form start, optimization, check by simulation.

The dead band of the integral is to allow the least standing error, so that the actuator holds its load as stiffly as
the demands permit:

    minimize    ln e over ln gains    subject to    slip D(gains) <= e <= standing error demanded,
                                                    all other demands, in every corner and contact mode

by sequential quadratic programming with the exact derivatives of `measures`. Few corners and modes are active; the
problem is solved with those, checked against all, and solved again with those that are violated until there are none.
A demand that the simulation of a corner then misses is tightened by as much as it was missed, and all is repeated.
Finally the stiction margin of the design is found by simulation.

A sampled controller is designed on its exact discrete model, including delays and holds, and simulated with its ticks
and quantization.
"""

from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from typing import Any

from actuator.actuator import Actuator
from studies.specification import Criterion, Demand, Specification
from studies.tuning.check import CornerCheck, check_corners
from studies.tuning.design import Design, design
from studies.tuning.measures import Measure, measures, worst
from studies.tuning.modes import CornerModes, corner_modes
from studies.tuning.plant import (
    NotTunable,
    add_dead_band,
    defaults_of,
    efforts_of,
    gains_of,
    initial_gains,
    prepare_linear,
    with_dead_band,
)
from studies.tuning.result import Round, Tuned, shortfalls
from studies.tuning.stiction import stiction_margins

ROUNDS = 6


class Phase(StrEnum):
    """What a tuning does, in this order; designs and their checks are repeated."""

    POINTS = "operating points"
    BEFORE = "simulations as it is"
    DESIGN = "optimization"
    CHECK = "simulations as tuned"
    MARGIN_BEFORE = "stiction margin as it is"
    MARGIN = "stiction margin as tuned"
    TRADE_OFF = "trade-off"


def tune(  # noqa: PLR0913 - the task, and how it is run
    specification: Specification,
    original: Actuator,
    *,
    margins: Sequence[float] = (1.0, 1.5, 2.0, 2.5),
    done: MutableMapping[str, dict[str, Any]] | None = None,
    workers: int | None = None,
    progress: Callable[[Phase, float], None] | None = None,
) -> Tuned:
    """Tune an actuator, and check it before and after against its demands by simulation in every corner.

    Parameters
    ----------
    specification : Specification
        The task.
    original : Actuator
        Before tuning.
    margins : sequence of float
        Stiction margins of the trade-off curve.
    done, workers
        As for `run_many`.
    progress : callable or None
        Called with the present phase and the share of it that is done.

    Raises
    ------
    NotTunable
        Where the actuator cannot be tuned here, no gains meet the demands, or the simulations still miss demands
        after all rounds.
    """
    tell = progress or (lambda phase, share: None)
    require_tunable(specification, original)
    demand, linear, plant = specification.demand, prepare_linear(original), add_dead_band(original)
    corners = specification.all_corners(original)
    defaults = defaults_of(plant.system().parameters)
    before = {name: defaults[name] for name in specification.tuning.gains}
    start = {name: value for name, value in initial_gains(original, demand).items() if name in before}
    everywhere = [
        corner_modes(linear, corner, demand.stiction_margin, before)
        for k, corner in enumerate(corners)
        if tell(Phase.POINTS, k / len(corners)) is None
    ]
    before_measures = tuple(m for modes in everywhere for m in measures(modes, before, demand, {}))

    def simulate(phase: Phase, work: Callable[..., Any], parameters: Mapping[str, float]) -> Any:
        def advance(finished: int, count: int) -> None:
            tell(phase, finished / count)

        return work(plant, corners, parameters, demand, done=done, workers=workers, progress=advance)

    def design_once(tightening: Mapping[Criterion, float], first: Mapping[str, float] | None) -> Design:
        tell(Phase.DESIGN, 0.0)
        found = design(distinct, start, specification, tightening, first)
        return replace(
            found, measures=tuple(m._replace(corner=name) for m in found.measures for name in twins[m.corner])
        )

    def check(found: Design) -> list[CornerCheck]:
        return simulate(Phase.CHECK, check_corners, with_dead_band(original, found.gains, found.standing_error))

    before_checks = simulate(Phase.BEFORE, check_corners, before)
    twins = find_twins(before_measures)
    distinct = [modes for modes in everywhere if modes.corner.name in twins]
    rounds = _iterate(design_once, check, demand)
    last = rounds[-1].design
    margins_before = simulate(Phase.MARGIN_BEFORE, stiction_margins, before)
    margins_found = simulate(Phase.MARGIN, stiction_margins, with_dead_band(original, last.gains, last.standing_error))
    curve = trade_off(linear, distinct, start, rounds[-1], specification, margins, partial(tell, Phase.TRADE_OFF))
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
        margins_before=margins_before,
        margins=margins_found,
        trade_off=curve,
    )


def _iterate(
    design_once: Callable[[Mapping[Criterion, float], Mapping[str, float] | None], Design],
    check: Callable[[Design], list[CornerCheck]],
    demand: Demand,
) -> list[Round]:
    """Design and check, with demands tightened by as much as the simulations have missed them, until they are met.

    `design_once` takes the tightening and the gains of the last round.
    """
    tightening: dict[Criterion, float] = {}
    rounds: list[Round] = []
    asked: dict[Criterion, float] = {}
    for _ in range(ROUNDS):
        found = design_once(tightening, rounds[-1].design.gains if rounds else None)
        checks = check(found)
        rounds.append(Round(dict(tightening), found, checks))
        asked = shortfalls(checks, demand)
        if not asked:
            return rounds
        for name, factor in asked.items():
            tightening[name] = tightening.get(name, 1.0) * factor
    factors = ", ".join(f"{name} by a factor of {factor:.3g}" for name, factor in asked.items())
    raise NotTunable(f"after {ROUNDS} rounds the simulations still miss demands: {factors}")


def require_tunable(specification: Specification, plant: Actuator) -> None:
    """Raise NotTunable where a task is impossible with an actuator, whatever the gains."""
    if not specification.tuning.dead_band:
        raise NotTunable(
            "with integral action and breakaway friction above sliding friction the actuator hunts after some small "
            "move, whatever the gains; allow tuning.dead_band"
        )
    known = gains_of(plant)
    wrong = [name for name in specification.tuning.gains if name not in known]
    if wrong:
        raise NotTunable(f"tuning.gains may name {', '.join(known)}, not {', '.join(wrong)}")
    efforts_of(specification.demand, plant.system())
    sampling, bandwidth = plant.sampling, specification.demand.bandwidth
    slowest = 0.0 if sampling is None else max(sampling.position or 0.0, sampling.speed or 0.0)
    if 2 * bandwidth * slowest >= 1:
        raise NotTunable(
            f"{plant.name}: a bandwidth of {bandwidth:g} Hz is more than half the rate of a loop that is sampled every "
            f"{1e3 * slowest:g} ms; demand less, or sample faster"
        )


def find_twins(found: Sequence[Measure]) -> dict[str, list[str]]:
    """Corners with equal linear models, by the first of them: backlash, for one, does not affect these models."""
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
    start: Mapping[str, float],
    last: Round,
    specification: Specification,
    margins: Sequence[float],
    progress: Callable[[float], None],
) -> tuple[tuple[float, float], ...]:
    """Least standing error [rad] over the stiction margin, all other demands met, in the deciding corners."""
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
        found = design(corners, start, relaxed, last.tightening, last.design.gains)
        curve.append((margin, found.standing_error))
    return tuple(curve)
