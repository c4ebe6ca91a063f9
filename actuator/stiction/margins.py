"""How far an actuator is from hunting, in one number each: stiction, backlash and integral-gain margin.

A margin is the factor on one or several parameters at which a cycle begins to exist, by bisection of simulations that
are started on the last cycle and from the given state, with factors from 1/16 to 16:

    margin in dB = 20 log10(factor)

It is positive for an actuator that rests: so much more friction, backlash or gain it takes to hunt. It is negative for
one that hunts: by so much they have to come down. Like gain margins, each is with all else unchanged.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from actuator.actuator import Actuator
from actuator.simulation.run import Run
from actuator.verdict.verdict import REST, UNDECIDED, Hunting, decide

STICTION, BACKLASH, INTEGRAL = "stiction", "backlash", "integral gain"
ENDINGS = {
    STICTION: (".breakaway", ".static"),
    BACKLASH: (".gap",),
    INTEGRAL: ("controller.integral", "controller.speed.integral"),
}
SLIDING = {".breakaway": (".coulomb",), ".static": (".sliding", ".coulomb")}  # what breakaway becomes once it slides
LEAST, MOST = 1 / 16, 16.0  # factors that are tried: 24 dB
RESOLVED = 0.02  # of the factor
POINTS = 5000
LONGEST = 16.0  # times the duration of a run: a small gain makes long periods
CYCLES = 8  # periods of the last cycle that a run from it needs


@dataclass(frozen=True, kw_only=True)
class HuntingMargin:
    """A factor on parameters up to which there is no hunting.

    Attributes
    ----------
    kind : str
        "stiction", "backlash" or "integral gain".
    parameters : tuple of str
        What the factor is on.
    factor : float
        Infinite where no factor up to 16 makes it hunt, zero where none down to 1/16 ends it.
    runs : tuple of (float, str)
        Factor and verdict of every run.
    """

    kind: str
    parameters: tuple[str, ...]
    factor: float
    runs: tuple[tuple[float, str], ...] = field(repr=False)

    @property
    def db(self) -> float:
        """The factor in dB: positive, what is left before it hunts; negative, what is too much."""
        return 20 * math.log10(self.factor) if self.factor > 0 else -math.inf


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
    """Largest factor without hunting on all breakaway friction, all backlash, or the integral gain.

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
        not decide are gone on with, up to 16 times as long; what shows no cycle by then counts as not hunting, and
        has the verdict "undecided" in `runs`; irregular motion counts as hunting.
    compiled : bool or None
        As for `simulate`.

    Raises
    ------
    ValueError
        Unknown kind, or an actuator without such a parameter.
    """
    if kind not in ENDINGS:
        raise ValueError(f"hunting_margin: kind must be one of {', '.join(ENDINGS)}, got {kind!r}")
    defaults = {q.name: float(q.default) for q in plant.system().parameters} | dict(parameters or {})
    names = tuple(name for name, value in defaults.items() if name.endswith(ENDINGS[kind]) and value > 0)
    if not names:
        raise ValueError(f"{plant.name} has no {' or '.join(ENDINGS[kind])} for a {kind} margin")
    trials = _Trials(
        plant,
        kind,
        {name: defaults[name] for name in names},
        defaults,
        dict(parameters or {}),
        start,
        duration,
        {"inputs": dict(inputs or {}), "compiled": compiled},
    )
    run, hunts = trials.at(1.0, start)
    low, high, begin = 1.0, 1.0, run.state() if hunts else start
    step = 0.5 if hunts else 2.0
    while True:
        factor = (low if hunts else high) * step
        if not LEAST <= factor <= MOST:
            return HuntingMargin(
                kind=kind, parameters=names, factor=0.0 if hunts else math.inf, runs=tuple(trials.runs)
            )
        run, now = trials.at(factor, begin)
        if hunts:
            low, high = factor, low
        else:
            low, high = high, factor
        if now:
            begin = run.state()
        if now != hunts:
            break
    trials.coarse = False
    while high - low > RESOLVED * low:
        middle = math.sqrt(low * high)
        run, now = trials.at(middle, begin)
        low, high = (low, middle) if now else (middle, high)
        begin = run.state() if now else begin
    return HuntingMargin(kind=kind, parameters=names, factor=math.sqrt(low * high), runs=tuple(trials.runs))


class _Trials:
    """Runs of one plant with a factor on some of its parameters."""

    def __init__(  # noqa: PLR0913, PLR0917 - what is simulated
        self,
        plant: Actuator,
        kind: str,
        values: Mapping[str, float],
        defaults: Mapping[str, float],
        others: Mapping[str, float],
        start: Mapping[str, float] | None,
        duration: float,
        common: Mapping[str, Any],
    ) -> None:
        self.plant, self.kind, self.values, self.defaults, self.others = plant, kind, values, defaults, others
        self.start, self.duration, self.common = start, duration, common
        self.length, self.coarse = duration, True
        self.runs: list[tuple[float, str]] = []

    def at(self, factor: float, begin: Mapping[str, float] | None) -> tuple[Run, bool]:
        """The run, and whether it moves for ever."""
        run, verdict = self._decided(factor, begin)
        # a cycle can be lost in too long a step from the last one: in the coarse search both starts have to rest
        if begin is not self.start and (verdict.verdict == UNDECIDED or (self.coarse and verdict.verdict == REST)):
            other = self._decided(factor, self.start)
            if verdict.verdict == UNDECIDED or other[1].verdict != UNDECIDED:
                run, verdict = other
        return run, verdict.verdict not in (REST, UNDECIDED)

    def _decided(self, factor: float, begin: Mapping[str, float] | None) -> tuple[Run, Hunting]:
        """A run, gone on with where its verdict waits for a slow controller; what moves irregularly, moves."""
        changed = {name: at_least_sliding(name, factor * value, self.defaults) for name, value in self.values.items()}
        options = {**self.common, "parameters": {**self.others, **changed}}
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


def hunting_margins(plant: Actuator, kinds: Sequence[str] = (STICTION, BACKLASH, INTEGRAL), **options) -> dict:
    """All margins by kind that the actuator has parameters for; options as of `hunting_margin`."""
    names = [quantity.name for quantity in plant.system().parameters]
    return {kind: hunting_margin(plant, kind, **options) for kind in kinds if _has(names, kind)}


def _has(names: Sequence[str], kind: str) -> bool:
    return any(name.endswith(ENDINGS[kind]) for name in names)


def sliding_of(name: str, values: Mapping[str, float]) -> str | None:
    """Name of the sliding friction that belongs to a breakaway friction; None for what is none, or has none."""
    for ending, others in SLIDING.items():
        if name.endswith(ending):
            return next((other for part in others if (other := name.removesuffix(ending) + part) in values), None)
    return None


def at_least_sliding(name: str, value: float, values: Mapping[str, float]) -> float:
    """A value for a parameter; for breakaway friction no less than its sliding friction among the values."""
    other = sliding_of(name, values)
    return value if other is None else max(value, values[other])
