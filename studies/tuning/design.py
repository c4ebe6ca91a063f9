"""Gains that meet every demand on the linear models with the least standing error, and what each demand costs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize, nnls

from studies.specification import Demand, Specification
from studies.tuning.measures import Measure, measures, worst
from studies.tuning.modes import CornerModes
from studies.tuning.plant import NotTunable

EXCHANGES, ITERATIONS = 8, 12
MISSED = 1e-3  # a slack below minus this is missed
ACCURACY = 1e-7  # of the logarithm of the standing error
LEAST = 1e-6  # multiplier that is one
STEP, STEPS = 1.0, 12  # of the logarithms of gains, and how many
NEAR = 0.7  # slack below which a demand is looked at from the beginning; the others, once they are missed
SAME = 1e-3  # change of them that ends the search
ACTIVE = 1e-4  # a slack below this is active
FROZEN, AT_END = "standing error", "end of its range"
DECIBEL = math.log(10) / 20


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
        elif self.name in ("peak current", "peak torque", FROZEN) or self.corner == AT_END:
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
    first: Mapping[str, float] | None = None,
) -> Design:
    """Gains with the least standing error that meet all demands on the linear models.

    Parameters
    ----------
    everywhere : sequence of CornerModes
        All corners.
    start : mapping of str to float
        Gains about which those of the design lie, within the range of the specification.
    specification : Specification
        Demands and range.
    tightening : mapping of str to float
        Factors on demands by name of the measure.
    first : mapping of str to float
        Gains within that range to begin with; else `start`.

    Raises
    ------
    NotTunable
        Where no gains near the start meet them, with the demands that are missed most.
    """
    tightening = dict(tightening or {})
    demand = specification.demand
    demand = replace(demand, standing_error=demand.standing_error / tightening.get(FROZEN, 1.0))
    problem, gains = _Problem(start, demand, tightening), dict(first or start)
    y = np.array([*(math.log(gains[name] / value) for name, value in start.items()), 0.0])
    reach = math.log(specification.tuning.range)
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
                rows.append((row, Active(name, AT_END, "", problem.gains(y)[name], "", 0.0)))
    if not rows:
        return []
    gradient = np.zeros(len(y))
    gradient[-1] = 1.0
    weights, _ = nnls(np.array([row for row, _ in rows]).T, gradient)
    named = [each._replace(multiplier=float(w)) for (_, each), w in zip(rows, weights, strict=True) if w > LEAST]
    return sorted(named, key=lambda each: -each.multiplier)
