"""How far an actuator is from hunting, in one number each: stiction, backlash and integral-gain margin.

A margin is the factor on one or several parameters at which a cycle begins to exist, by bisection of simulations that
are started on the last cycle and from the given state, with factors from 1/16 to 16:

    margin in dB = 20 log10(factor)

It is positive for an actuator that comes to rest: so much more friction, backlash or gain it takes to hunt. It is
negative for one that hunts: by so much they have to come down. Like gain margins, each is with all else unchanged.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

from actuator.actuator import Actuator
from actuator.simulation.run import Run
from actuator.system.hybrid import HybridSystem, require_sticking
from actuator.system.parameters import Parameter, at_least_sliding, motion_integrals
from actuator.verdict.verdict import REST, UNDECIDED, Hunting, decide
from gear.quantities.roles import Breakaway, Gap

STEPS, MOST = 4, 16.0  # factors of two that are tried, up to the largest factor and down to its inverse: 24 dB
TOLERANCE = 1.02  # ratio of the factors between which hunting begins
POINTS = 5000  # output points of a run
LONGEST = 16.0  # times the duration of a run: a small gain makes long periods
CYCLES = 8  # periods of the last cycle that a run from it needs


class MarginKind(StrEnum):
    """What the factor of a margin is on."""

    STICTION = "stiction"
    BACKLASH = "backlash"
    INTEGRAL = "integral gain"


STICTION, BACKLASH, INTEGRAL = MarginKind
SCALED = {STICTION: "breakaway friction", BACKLASH: "backlash", INTEGRAL: "integral gain"}


class Onset(NamedTuple):
    """The nearest factors found on both sides of where hunting begins; None where there is none on a side."""

    rests: float | None
    hunts: float | None


def find_onset(
    hunts: Callable[[float], bool],
    factors: Sequence[float],
    *,
    tolerance: float = math.inf,
    first: bool | None = None,
    monotonic: bool = False,
) -> Onset:
    """Find between which factors hunting begins or ends: by the given factors, then by geometric bisection.

    Parameters
    ----------
    hunts : callable
        Whether the actuator hunts at a factor.
    factors : sequence of float
        Those to try in turn, upward or downward, until the answer is another than at the first.
    tolerance : float
        Ratio of the two factors down to which it is bisected between them.
    first : bool or None
        The answer at the first factor; None to ask for it.
    monotonic : bool
        Whether the answer changes once at most among the factors, so that not all need to be tried.
    """
    first = hunts(factors[0]) if first is None else first
    near, far = 0, len(factors)
    while far - near > 1:
        k = (near + far) // 2 if monotonic else near + 1
        if hunts(factors[k]) == first:
            near = k
        else:
            far = k
            if not monotonic:
                break
    same, other = factors[near], factors[far] if far < len(factors) else None
    while other is not None and max(same, other) > tolerance * min(same, other):
        middle = math.sqrt(same * other)
        same, other = (middle, other) if hunts(middle) == first else (same, middle)
    return Onset(rests=other, hunts=same) if first else Onset(rests=same, hunts=other)


@dataclass(frozen=True, kw_only=True)
class HuntingMargin:
    """A factor on parameters up to which there is no hunting.

    Attributes
    ----------
    kind : MarginKind
        What it is a margin of.
    parameters : tuple of str
        What the factor is on.
    factor : float
        Infinite where no factor up to 16 makes it hunt, zero where none down to 1/16 ends it.
    runs : tuple of (float, str)
        Factor and verdict of every run.
    """

    kind: MarginKind
    parameters: tuple[str, ...]
    factor: float
    runs: tuple[tuple[float, str], ...] = field(repr=False)

    @property
    def db(self) -> float:
        """The factor in dB: positive, what is left before it hunts; negative, what is too much."""
        return 20 * math.log10(self.factor) if self.factor > 0 else -math.inf


def find_scaled(system: HybridSystem, kind: str) -> tuple[Parameter, ...]:
    """The parameters that the factor of a margin is on: all that have the role, whatever law they belong to."""
    if kind == INTEGRAL:
        return motion_integrals(system.parameters)
    return system.parameters_having(Breakaway if kind == STICTION else Gap)


def hunting_margin(  # noqa: PLR0913 - what is simulated
    plant: Actuator,
    kind: str,
    *,
    inputs: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    duration: float = 20.0,
    compiled: bool | None = None,
) -> HuntingMargin:
    """Largest factor without hunting on all breakaway friction, all backlash, or the integral gains.

    A factor below one on breakaway friction ends at the sliding friction of each contact.

    Parameters
    ----------
    plant : Actuator
        What is asked about.
    kind : str
        "stiction", "backlash" or "integral gain".
    inputs, start, parameters : mapping of str to float
        Constant inputs, initial states and other parameters by name.
    duration : float
        Of the first run [s]. Those begun on a cycle last as many of its periods as a verdict needs; those that do
        not decide are continued, up to 16 times as long; what shows no cycle by then counts as not hunting, and
        has the verdict "undecided" in `runs`. Irregular motion counts as hunting.
    compiled : bool or None
        As for `simulate`.

    Raises
    ------
    ValueError
        Unknown kind, or an actuator without such a parameter.
    """
    if kind not in list(MarginKind):
        raise ValueError(f"hunting_margin: kind must be one of {', '.join(MarginKind)}, got {kind!r}")
    kind, system = MarginKind(kind), plant.system()
    if kind == MarginKind.STICTION:
        require_sticking(system, "the stiction margin")
    values = {q.name: float(q.default) for q in system.parameters} | dict(parameters or {})
    scaled = tuple(parameter for parameter in find_scaled(system, kind) if values[parameter.name] > 0)
    if not scaled:
        raise ValueError(f"{plant.name} has no {SCALED[kind]}, so there is no {kind} margin")
    trials = _Trials(
        plant=plant,
        scaled=scaled,
        values=values,
        changed=dict(parameters or {}),
        start=start,
        duration=duration,
        common={"inputs": dict(inputs or {}), "compiled": compiled},
    )
    first = trials.hunts(1.0)
    step = 0.5 if first else 2.0
    found = find_onset(trials.hunts, [step**k for k in range(STEPS + 1)], tolerance=TOLERANCE, first=first)
    factor = math.inf if found.hunts is None else 0.0 if found.rests is None else math.sqrt(found.rests * found.hunts)
    names = tuple(parameter.name for parameter in scaled)
    return HuntingMargin(kind=kind, parameters=names, factor=factor, runs=tuple(trials.runs))


@dataclass(kw_only=True)
class _Trials:
    """Runs of one plant with a factor on some of its parameters, each from the last cycle on."""

    plant: Actuator
    scaled: Sequence[Parameter]
    values: Mapping[str, float]
    changed: Mapping[str, float]
    start: Mapping[str, float] | None
    duration: float
    common: Mapping[str, Any]

    def __post_init__(self) -> None:
        self.begin, self.length = self.start, self.duration
        self.runs: list[tuple[float, str]] = []

    def hunts(self, factor: float) -> bool:
        """Whether it moves for ever."""
        tried = [factor for factor, _ in self.runs]
        between = bool(tried) and min(tried) < factor < max(tried)
        run, verdict = self._decide(factor, self.begin)
        # a cycle can be lost in too long a step from the last one: beyond what was tried both starts have to rest
        lost = verdict.verdict == UNDECIDED or (verdict.verdict == REST and not between)
        if self.begin is not self.start and lost:
            other = self._decide(factor, self.start)
            if verdict.verdict == UNDECIDED or other[1].verdict != UNDECIDED:
                run, verdict = other
        hunts = verdict.verdict not in (REST, UNDECIDED)
        if hunts:
            self.begin = run.state()
        return hunts

    def _decide(self, factor: float, begin: Mapping[str, float] | None) -> tuple[Run, Hunting]:
        """A run, continued where its verdict waits for a slow controller; what moves irregularly, moves."""
        numbers = {p.name: at_least_sliding(p, factor * self.values[p.name], self.values) for p in self.scaled}
        options = {**self.common, "parameters": {**self.changed, **numbers}}
        step = self.duration / POINTS
        run, verdict = decide(self.plant, self.length, longest=1.0, start=begin, resolution=step, **options)
        if verdict.verdict == UNDECIDED:
            left = LONGEST * self.duration - self.length
            more = min(verdict.longer_s, left)
            step, begin = max(self.duration, more) / POINTS, run.state()
            run, verdict = decide(self.plant, more, longest=left / more, start=begin, resolution=step, **options)
        self.runs.append((factor, verdict.verdict))
        if verdict.cycles:
            self.length = min(self.duration, CYCLES * verdict.period_s)
        return run, verdict


def hunting_margins(plant: Actuator, kinds: Sequence[str] = tuple(MarginKind), **options) -> dict[str, HuntingMargin]:
    """All margins by kind that the actuator has parameters for; options as of `hunting_margin`."""
    return {kind: hunting_margin(plant, kind, **options) for kind in kinds if find_scaled(plant.system(), kind)}
