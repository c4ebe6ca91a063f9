"""From a specification to the gains of a cascade or a PID: closed-form start, optimization, check by simulation.

The least standing error is sought at which the integral may have its dead band, so that the actuator holds its load as
stiffly as the demands leave room for:

    minimize    ln e over ln gains    subject to    slip D(gains) <= e <= standing error demanded,
                                                    all other demands, in every corner and contact mode

by sequential quadratic programming with the exact derivatives of `measures`. Few corners and modes decide; the
problem is solved with those, held against all, and solved again with the ones it violates until there are none. What
the simulation of a corner then shows to be short of its demand tightens that demand by as much, and all is done again.
At last the stiction margin that the design really has is looked for by simulation.

A sampled controller is designed on its exact model from tick to tick, with delays and holds in it, and simulated with
its ticks and counts.
"""

import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from actuator.actuator import Actuator
from studies.specification import Corner, Demand, Specification
from studies.tuning.check import CornerCheck, check_corners
from studies.tuning.design import FROZEN, Design, design
from studies.tuning.measures import Measure, measures, worst
from studies.tuning.modes import CornerModes, corner_modes
from studies.tuning.plant import (
    NotTunable,
    closed_form,
    dead_banded,
    defaults_of,
    efforts_of,
    for_linear_models,
    gains_of,
    with_dead_band,
)
from studies.tuning.stiction import StictionMargin, stiction_margins

TIGHTER = 1.25  # factor on the slip where a corner hunts all the same
BEYOND = 1.02  # and on what else is demanded, over what is missing
SHORT = 1e-3  # relative, by which a simulation may miss a demand: it is sampled, and settles slowly
SMALL = 0.01  # overshoot [-] by which what is more than demanded is divided at least
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
    margins_before, margins : list of StictionMargin
        Factors on breakaway friction at which hunting begins in every corner, as it was and tuned.
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
    margins_before: list[StictionMargin] = field(repr=False)
    margins: list[StictionMargin] = field(repr=False)
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


def shortfalls(checks: Sequence[CornerCheck], demand: Demand) -> dict[str, float]:
    """Factors on demands that the simulations ask for, by name of the measure; empty where all is well.

    Overshoot, current and torque are those of the step of the demanded amplitude, with friction as it is, in the corner
    in which they are largest; a corner that hunts is asked for less slip, and for nothing that the hunting spoils.
    """
    asked = {}
    if any(check.hunts(1.0) or check.hunts(demand.stiction_margin) for check in checks):
        asked["slip"] = TIGHTER
    least = min(check.followed for check in checks)
    if not least >= 1 / math.sqrt(2):
        asked["bandwidth"] = BEYOND / (math.sqrt(2) * max(least, 0.1))
    calm = [check for check in checks if not check.hunts(1.0)]
    shown = {
        "overshoot": (demand.overshoot, [check.overshoot for check in calm]),
        "peak current": (demand.peak_current, [check.peak_current for check in calm]),
        "peak torque": (demand.peak_torque, [check.peak_torque for check in calm]),
        FROZEN: (demand.standing_error, [check.standing_error for check in calm]),
    }
    for name, (limit, values) in shown.items():
        if limit is None or not values:
            continue
        most, room = max(values), SHORT if name == "overshoot" else SHORT * limit
        if most > limit + room:
            asked[name] = BEYOND * most / (max(limit, SMALL) if name == "overshoot" else limit)
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
        Finished simulations, as for `run_many`.
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
    require_tunable(specification, original)
    demand, linear, plant = specification.demand, for_linear_models(original), dead_banded(original)
    corners = specification.all_corners(original)
    defaults = defaults_of(plant.system().parameters)
    before = {name: defaults[name] for name in specification.tuning.gains}
    start = {name: value for name, value in closed_form(original, demand).items() if name in before}
    everywhere = [
        corner_modes(linear, corner, demand.stiction_margin, before)
        for k, corner in enumerate(corners)
        if tell("operating points", k / len(corners)) is None
    ]
    before_measures = tuple(m for modes in everywhere for m in measures(modes, before, demand, {}))

    def simulated(what: str, work: Callable[..., Any], parameters: Mapping[str, float]) -> Any:
        shares = lambda n, of: tell(what, n / of)  # noqa: E731 - one line
        return work(plant, corners, parameters, demand, done=done, workers=workers, progress=shares)

    def designed(k: int, tightening: Mapping[str, float], first: Mapping[str, float] | None) -> Design:
        tell(f"optimization {k}", 0.0)
        found = design(distinct, start, specification, tightening, first)
        return replace(
            found, measures=tuple(m._replace(corner=name) for m in found.measures for name in twins[m.corner])
        )

    def checked(found: Design) -> list[CornerCheck]:
        return simulated("tuned", check_corners, with_dead_band(original, found.gains, found.standing_error))

    before_checks = simulated("as it is", check_corners, before)
    twins = twins_of(before_measures)
    distinct = [modes for modes in everywhere if modes.corner.name in twins]
    rounds = _rounds(designed, checked, demand)
    last = rounds[-1].design
    margins_before = simulated("margin as it is", stiction_margins, before)
    margins_found = simulated(
        "margin tuned", stiction_margins, with_dead_band(original, last.gains, last.standing_error)
    )
    curve = trade_off(
        linear, distinct, start, rounds[-1], specification, margins, lambda share: tell("trade-off", share)
    )
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


def _rounds(
    designed: Callable[[int, Mapping[str, float], Mapping[str, float] | None], Design],
    checked: Callable[[Design], list[CornerCheck]],
    demand: Demand,
) -> list[Round]:
    """Designs, each with its demands tightened by what the simulations of the one before have missed, until none is.

    `designed` is from the number of the round, the tightening and the gains of the last one.
    """
    tightening: dict[str, float] = {}
    rounds: list[Round] = []
    for k in range(ROUNDS):
        found = designed(k + 1, tightening, rounds[-1].design.gains if rounds else None)
        checks = checked(found)
        rounds.append(Round(dict(tightening), found, checks))
        asked = shortfalls(checks, demand)
        if not asked:
            return rounds
        for name, factor in asked.items():
            tightening[name] = tightening.get(name, 1.0) * factor
    factors = ", ".join(f"{name} by a factor of {factor:.3g}" for name, factor in asked.items())
    raise NotTunable(f"after {ROUNDS} rounds the simulations still miss what is demanded: {factors}")


def require_tunable(specification: Specification, plant: Actuator) -> None:
    """Raise NotTunable where a task cannot be done with an actuator, whatever the gains."""
    if not specification.tuning.dead_band:
        raise NotTunable(
            "integral action hunts after some small move wherever breakaway friction exceeds sliding friction, "
            "whatever the gains; allow tuning.dead_band"
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
    start: Mapping[str, float],
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
        found = design(corners, start, relaxed, last.tightening, last.design.gains)
        curve.append((margin, found.standing_error))
    return tuple(curve)
