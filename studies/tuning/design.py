"""Gains with the least standing error that meet every demand on the linear models, and the cost of each demand."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize, nnls

from studies.specification import Criterion, Demand, Specification
from studies.tuning.measures import Measure, measures, worst
from studies.tuning.modes import CornerModes
from studies.tuning.plant import NotTunable

EXCHANGES, ITERATIONS = 8, 12
MISSED = 1e-3  # a demand with a slack below minus this is missed
ACCURACY = 1e-7  # of the logarithm of the standing error
LEAST_MULTIPLIER = 1e-6  # below is zero
STEP, STEPS = 1.0, 12  # largest step of the logarithms of gains, and number of steps
NEAR = 0.7  # slack below which a demand is included from the beginning; the others once they are missed
UNCHANGED = 1e-3  # change of the logarithms of gains that ends the search
ACTIVE = 1e-4  # a demand with a slack below this is active
AT_END = "end of its range"
DECIBEL = math.log(10) / 20
COSTS = {  # a step of the multiplier that is quoted, and the step in words
    Criterion.PHASE_MARGIN: (math.radians(1), "1 deg more"),
    Criterion.DELAY_MARGIN: (0.1, "10 % more"),
    Criterion.GAIN_MARGIN: (DECIBEL, "1 dB more"),
    Criterion.OVERSHOOT: (0.01, "1 % less overshoot"),
    Criterion.SLIP: (0.01, "1 % more slip (friction, stiction margin)"),
    **dict.fromkeys(
        (Criterion.PEAK_CURRENT, Criterion.PEAK_TORQUE, Criterion.STANDING_ERROR, Criterion.GAIN_RANGE),
        (0.01, "a limit 1 % tighter"),
    ),
    **dict.fromkeys((Criterion.BANDWIDTH, Criterion.STIFFNESS), (0.01, "1 % more")),
}


class Active(NamedTuple):
    """An active demand: one that limits how small the standing error can be.

    `multiplier` is d ln(standing error) by a tightening of the demand: of its logarithm, for phases [rad] and
    overshoots of itself, for delays of its ratio.
    """

    criterion: Criterion
    name: str
    corner: str
    mode: str
    limit: float
    unit: str
    multiplier: float

    @property
    def cost(self) -> str:
        """The cost of tightening it, in words."""
        step, words = COSTS[self.criterion]
        return f"{words} costs {100 * math.expm1(self.multiplier * step):.3g} % of standing error"


@dataclass(frozen=True, kw_only=True)
class Design:
    """Gains that meet every demand on the linear models.

    Attributes
    ----------
    gains : dict of str to float
        By name, without the dead band.
    standing_error : float
        Standing error that the dead band allows [rad at the load].
    measures : tuple of Measure
        In every corner and mode.
    active : tuple of Active
        Active demands, the costliest first.
    """

    gains: dict[str, float]
    standing_error: float
    measures: tuple[Measure, ...] = field(repr=False)
    active: tuple[Active, ...]


class _Problem:
    """The demands in a few corners and modes, as functions of the logarithms of the gains and of the standing error."""

    def __init__(self, start: Mapping[str, float], demand: Demand, tightening: Mapping[Criterion, float]) -> None:
        self.start, self.demand, self.tightening = dict(start), demand, dict(tightening)
        self.modes: dict[tuple[str, str], CornerModes] = {}
        self._last: tuple[bytes, list[Measure]] = b"", []

    def gains(self, y: np.ndarray) -> dict[str, float]:
        return {name: value * math.exp(z) for (name, value), z in zip(self.start.items(), y, strict=False)}

    def add(self, modes: CornerModes, mode: str) -> bool:
        """Include a mode of a corner; returns whether it is new."""
        new = (modes.corner.name, mode) not in self.modes
        self.modes[modes.corner.name, mode] = modes
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
                    for found in measures(modes, self.gains(y), self.demand, self.tightening, mode)
                ],
            )
        return self._last[1]

    def slacks(self, y: np.ndarray) -> np.ndarray:
        return np.array([*(m.slack + (m.criterion is Criterion.SLIP) * y[-1] for m in self.measured(y)), -y[-1]])

    def jacobian(self, y: np.ndarray) -> np.ndarray:
        rows = [[*m.slopes, float(m.criterion is Criterion.SLIP)] for m in self.measured(y)]
        return np.array([*rows, [*np.zeros(len(y) - 1), -1.0]])

    def solve(self, y: np.ndarray, reach: float) -> np.ndarray:
        """The best point within `reach`, in steps no longer than STEP, in which the linear models are trusted."""
        least = -min(m.slack for m in self.measured(y) if m.criterion is Criterion.SLIP)
        y = np.array([*y[:-1], least + STEP])  # with room to decrease: an objective that does not ends the search
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
            if moved < UNCHANGED:
                break
        return y


def design(
    everywhere: Sequence[CornerModes],
    start: Mapping[str, float],
    specification: Specification,
    tightening: Mapping[Criterion, float] | None = None,
    first: Mapping[str, float] | None = None,
) -> Design:
    """Gains with the least standing error that meet all demands on the linear models.

    Parameters
    ----------
    everywhere : sequence of CornerModes
        All corners.
    start : mapping of str to float
        Gains from which those of the design may differ by the range of the specification.
    specification : Specification
        Demands and range.
    tightening : mapping of Criterion to float
        Factors on demands.
    first : mapping of str to float
        Gains within that range to begin with; else `start`.

    Raises
    ------
    NotTunable
        Where no gains near the start meet them, with the demands missed most.
    """
    tightening = dict(tightening or {})
    demand = specification.demand
    demand = replace(demand, standing_error=demand.standing_error / tightening.get(Criterion.STANDING_ERROR, 1.0))
    problem, gains = _Problem(start, demand, tightening), dict(first or start)
    y = np.array([*(math.log(gains[name] / value) for name, value in start.items()), 0.0])
    reach = math.log(specification.tuning.range)
    by_name = {modes.corner.name: modes for modes in everywhere}
    found = _measure_all(everywhere, gains, demand, tightening)
    deciding = [each for each in worst(found).values() if each.slack < NEAR or each.criterion is Criterion.SLIP]
    for _ in range(EXCHANGES):
        if not any([problem.add(by_name[each.corner], each.mode) for each in deciding]):
            break
        y = problem.solve(y, reach)
        gains = problem.gains(y)
        found = _measure_all(everywhere, gains, demand, tightening)
        deciding = _violated(found, y[-1])
    missed = _violated(found, y[-1])
    if missed or y[-1] > MISSED:
        raise NotTunable(_describe_missed(missed, y[-1], demand))
    return Design(
        gains=gains,
        standing_error=demand.standing_error * math.exp(y[-1]),
        measures=tuple(found),
        active=tuple(_find_active(problem, y, reach)),
    )


def _measure_all(
    everywhere: Sequence[CornerModes], gains: Mapping[str, float], demand: Demand, tightening: Mapping[Criterion, float]
) -> list[Measure]:
    return [each for modes in everywhere for each in measures(modes, gains, demand, tightening)]


def _violated(found: Sequence[Measure], error: float) -> list[Measure]:
    """Demands that are missed; the slip is compared with the standing error of the design."""
    return [m for m in worst(found).values() if m.slack + (m.criterion is Criterion.SLIP) * error < -MISSED]


def _describe_missed(missed: Sequence[Measure], error: float, demand: Demand) -> str:
    parts = [
        f"{m.name} {m.value:.4g} instead of {m.limit:.4g} {m.unit} ({m.corner}, {m.mode})"
        for m in sorted(missed, key=lambda m: m.slack)
    ]
    if error > MISSED:
        parts.append(
            f"standing error {demand.standing_error * math.exp(error):.4g} instead of {demand.standing_error:.4g} rad"
        )
    return f"no gains meet all demands at once; nearest: {'; '.join(parts)}; relax one of them, or widen tuning.range"


def _find_active(problem: _Problem, y: np.ndarray, reach: float) -> list[Active]:
    """Multipliers of the active demands: gradient of the objective = sum of multiplier * slope, none negative."""
    found, slacks, slopes = problem.measured(y), problem.slacks(y), problem.jacobian(y)
    rows: list[tuple[np.ndarray, Active]] = []
    for m, slack, slope in zip(found, slacks[:-1], slopes[:-1], strict=True):
        if slack < ACTIVE:
            rows.append((slope, Active(m.criterion, m.name, m.corner, m.mode, m.limit, m.unit, 0.0)))
    if slacks[-1] < ACTIVE:
        rows.append(
            (
                slopes[-1],
                Active(
                    Criterion.STANDING_ERROR,
                    Criterion.STANDING_ERROR.value,
                    "",
                    "",
                    problem.demand.standing_error,
                    "rad",
                    0.0,
                ),
            )
        )
    for k, name in enumerate(problem.start):
        for side in (1.0, -1.0):
            if reach - side * y[k] < ACTIVE:
                row = np.zeros(len(y))
                row[k] = -side
                rows.append((row, Active(Criterion.GAIN_RANGE, name, AT_END, "", problem.gains(y)[name], "", 0.0)))
    if not rows:
        return []
    gradient = np.zeros(len(y))
    gradient[-1] = 1.0
    weights, _ = nnls(np.array([row for row, _ in rows]).T, gradient)
    named = [
        each._replace(multiplier=float(w)) for (_, each), w in zip(rows, weights, strict=True) if w > LEAST_MULTIPLIER
    ]
    return sorted(named, key=lambda each: -each.multiplier)
