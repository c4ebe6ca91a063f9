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

import numpy as np
from scipy.optimize import minimize, nnls

from actuator.actuator import Actuator
from controllers.cascade import Cascade
from controllers.integral import IntegralRemedies
from controllers.pid import PI, P
from studies.specification import Corner, Demand, Specification
from studies.tuning_check import CornerCheck, check_corners
from studies.tuning_measures import CornerModes, Measure, corner_modes, defaults_of, measures, worst

POSITION, SPEED, INTEGRAL = "controller.position.gain", "controller.speed.proportional", "controller.speed.integral"
DEAD_BAND = "controller.speed.remedies.dead_band"
ROOM = 1.5  # bandwidth of the position loop at the start, over the demanded one
APART = 4.0  # speed bandwidth over that of the position loop, and over the rate of the integral
ROUNDS, EXCHANGES, ITERATIONS = 6, 8, 12
MISSED = 1e-3  # a slack below minus this is missed
ACCURACY = 1e-7  # of the logarithm of the standing error
LEAST = 1e-6  # multiplier that is one
STEP, STEPS = 1.0, 12  # of the logarithms of gains, and how many
NEAR = 0.7  # slack below which a demand is looked at from the beginning; the others, once they are missed
SAME = 1e-3  # change of them that ends the search
ACTIVE = 1e-4  # a slack below this is active
TIGHTER = 1.25  # factor on the slip where a corner hunts all the same
BEYOND = 1.02  # and on the bandwidth, over what is missing
FROZEN = "standing error"
DECIBEL = math.log(10) / 20


class NotTunable(ValueError):
    """No gains meet the demands, or the actuator is not one that can be tuned here."""


class Active(NamedTuple):
    """A demand that keeps the standing error from being smaller.

    `multiplier` is d ln(standing error) by a tightening of the demand: of its logarithm, for phases [rad] and
    overshoots of itself, for delays of its ratio.
    """

    name: str
    corner: str
    mode: str
    limit: float
    unit: str
    multiplier: float

    @property
    def cost(self) -> str:
        """What it costs, in words."""
        if "phase" in self.name:
            step, words = math.radians(1), "1 deg more"
        elif "delay" in self.name:
            step, words = 0.1, "10 % more"
        elif "gain margin" in self.name:
            step, words = DECIBEL, "1 dB more"
        elif self.name == "overshoot":
            step, words = 0.01, "1 % less overshoot"
        elif self.name == "slip":
            step, words = 0.01, "1 % more slip (friction, stiction margin)"
        elif self.name in ("peak current", FROZEN) or self.name in (POSITION, SPEED, INTEGRAL):
            step, words = 0.01, "a limit 1 % tighter"
        else:
            step, words = 0.01, "1 % more"
        return f"{words} costs {100 * math.expm1(self.multiplier * step):.3g} % of standing error"


@dataclass(frozen=True, kw_only=True)
class Design:
    """Gains that meet every demand on the linear models.

    Attributes
    ----------
    gains : dict of str to float
        By name, without the dead band.
    standing_error : float
        Of the dead band [rad at the load].
    measures : tuple of Measure
        In every corner and mode.
    active : tuple of Active
        The demands that decide, the costliest first.
    """

    gains: dict[str, float]
    standing_error: float
    measures: tuple[Measure, ...] = field(repr=False)
    active: tuple[Active, ...]


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


# -- the optimization -------------------------------------------------------------------------------------


class _Problem:
    """The demands in a few corners and modes, as functions of the logarithms of the gains and of the standing error."""

    def __init__(self, start: Mapping[str, float], demand: Demand, tightening: Mapping[str, float]) -> None:
        self.start, self.demand, self.tightening = dict(start), demand, dict(tightening)
        self.modes: dict[tuple[str, str], CornerModes] = {}
        self._last: tuple[bytes, list[Measure]] = b"", []

    def gains(self, y: np.ndarray) -> dict[str, float]:
        return {name: value * math.exp(z) for (name, value), z in zip(self.start.items(), y, strict=False)}

    def add(self, modes: CornerModes, mode: str) -> bool:
        """Take a mode of a corner into account; whether it is new."""
        new = (modes.corner.name, mode) not in self.modes
        needed = {name: point for name, point in modes.points.items() if name in (mode, mode.split(",", maxsplit=1)[0])}
        self.modes[modes.corner.name, mode] = replace(modes, points=needed)
        self._last = b"", []
        return new

    def measured(self, y: np.ndarray) -> list[Measure]:
        key = y[:-1].tobytes()
        if key != self._last[0]:
            self._last = (
                key,
                [
                    found
                    for (_, mode), modes in self.modes.items()
                    for found in measures(modes, self.gains(y), self.demand, self.tightening)
                    if found.mode == mode
                ],
            )
        return self._last[1]

    def slacks(self, y: np.ndarray) -> np.ndarray:
        return np.array([*(m.slack + (m.name == "slip") * y[-1] for m in self.measured(y)), -y[-1]])

    def jacobian(self, y: np.ndarray) -> np.ndarray:
        rows = [[*m.slopes, float(m.name == "slip")] for m in self.measured(y)]
        return np.array([*rows, [*np.zeros(len(y) - 1), -1.0]])

    def solved(self, y: np.ndarray, reach: float) -> np.ndarray:
        """The best point within `reach`, in steps no longer than STEP, in which the linear models are trusted."""
        least = -min(m.slack for m in self.measured(y) if m.name == "slip")
        y = np.array([*y[:-1], least + STEP])  # with room to fall: an objective that stands still ends the search
        for _ in range(STEPS):
            low = np.array([*np.maximum(y[:-1] - STEP, -reach), y[-1] - 2 * STEP])
            high = np.array([*np.minimum(y[:-1] + STEP, reach), y[-1] + 2 * STEP])
            after = minimize(
                lambda y: y[-1],
                y,
                jac=lambda y: np.array([0.0] * (len(y) - 1) + [1.0]),
                bounds=list(zip(low, high, strict=True)),
                constraints={"type": "ineq", "fun": self.slacks, "jac": self.jacobian},
                method="SLSQP",
                options={"maxiter": ITERATIONS, "ftol": ACCURACY},
            ).x
            moved, y = abs(after - y).max(), after
            if moved < SAME:
                break
        return y


def design(
    everywhere: Sequence[CornerModes],
    start: Mapping[str, float],
    specification: Specification,
    tightening: Mapping[str, float] | None = None,
) -> Design:
    """Gains with the least standing error that meet all demands on the linear models.

    Parameters
    ----------
    everywhere : sequence of CornerModes
        All corners.
    start : mapping of str to float
        Gains to begin with.
    specification : Specification
        Demands and range.
    tightening : mapping of str to float
        Factors on demands by name of the measure.

    Raises
    ------
    NotTunable
        Where no gains near the start meet them, with the demands that are missed most.
    """
    demand, tightening = specification.demand, dict(tightening or {})
    problem, gains = _Problem(start, demand, tightening), dict(start)
    y, reach = np.zeros(len(start) + 1), math.log(specification.tuning.range)
    by_name = {modes.corner.name: modes for modes in everywhere}
    found = _everything(everywhere, gains, demand, tightening)
    deciding = [each for each in worst(found).values() if each.slack < NEAR or each.name == "slip"]
    for _ in range(EXCHANGES):
        if not any([problem.add(by_name[each.corner], each.mode) for each in deciding]):
            break
        y = problem.solved(y, reach)
        gains = problem.gains(y)
        found = _everything(everywhere, gains, demand, tightening)
        deciding = _violated(found, y[-1])
    missed = _violated(found, y[-1])
    if missed or y[-1] > MISSED:
        raise NotTunable(_missed(missed, y[-1], demand))
    return Design(
        gains=gains,
        standing_error=demand.standing_error * math.exp(y[-1]),
        measures=tuple(found),
        active=tuple(_active(problem, y, reach)),
    )


def _everything(
    everywhere: Sequence[CornerModes], gains: Mapping[str, float], demand: Demand, tightening: Mapping[str, float]
) -> list[Measure]:
    return [each for modes in everywhere for each in measures(modes, gains, demand, tightening)]


def _violated(found: Sequence[Measure], error: float) -> list[Measure]:
    """Demands that are missed; the slip is held against the standing error of the design."""
    return [m for m in worst(found).values() if m.slack + (m.name == "slip") * error < -MISSED]


def _missed(missed: Sequence[Measure], error: float, demand: Demand) -> str:
    parts = [
        f"{m.name} {m.value:.4g} instead of {m.limit:.4g} {m.unit} ({m.corner}, {m.mode})"
        for m in sorted(missed, key=lambda m: m.slack)
    ]
    if error > MISSED:
        parts.append(
            f"standing error {demand.standing_error * math.exp(error):.4g} instead of {demand.standing_error:.4g} rad"
        )
    return f"no gains meet all demands at once; nearest: {'; '.join(parts)}; relax one of them, or widen tuning.range"


def _active(problem: _Problem, y: np.ndarray, reach: float) -> list[Active]:
    """Multipliers of the active demands: gradient of the objective = sum of multiplier * slope, none negative."""
    found, slacks, slopes = problem.measured(y), problem.slacks(y), problem.jacobian(y)
    rows: list[tuple[np.ndarray, Active]] = []
    for m, slack, slope in zip(found, slacks[:-1], slopes[:-1], strict=True):
        if slack < ACTIVE:
            rows.append((slope, Active(m.name, m.corner, m.mode, m.limit, m.unit, 0.0)))
    if slacks[-1] < ACTIVE:
        rows.append((slopes[-1], Active(FROZEN, "", "", problem.demand.standing_error, "rad", 0.0)))
    for k, name in enumerate(problem.start):
        for side in (1.0, -1.0):
            if reach - side * y[k] < ACTIVE:
                row = np.zeros(len(y))
                row[k] = -side
                rows.append((row, Active(name, "end of its range", "", problem.gains(y)[name], "", 0.0)))
    if not rows:
        return []
    gradient = np.zeros(len(y))
    gradient[-1] = 1.0
    weights, _ = nnls(np.array([row for row, _ in rows]).T, gradient)
    named = [each._replace(multiplier=float(w)) for (_, each), w in zip(rows, weights, strict=True) if w > LEAST]
    return sorted(named, key=lambda each: -each.multiplier)


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
