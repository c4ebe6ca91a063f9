"""Periodic orbits under sampled control: fixed points of the map over a whole number of ticks.

A clock that goes on ticking belongs to the system, so an orbit closes only after a whole number of ticks, and a shift
in time is no symmetry any more:

    P(x) - x = 0,     P: from before one tick to before the tick N later

What would be the trivial multiplier 1 is now a number like the others, and tells something new: how the cycle moves
against the clock. Between the slips of a stiction cycle the integral grows in steps, so a slip begins up to one step
late, and the next one depends on how late. With that multiplier outside the unit circle the cycle goes on, but its
period jitters by about a tick; the other multipliers say whether the cycle itself is stable.

References
----------
M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, "Piecewise-smooth Dynamical Systems" (2008), chapter 2.
"""

import contextlib
import io
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from actuator.actuator import Actuator
from actuator.hunting.flow_map import NoOrbit
from actuator.hunting.trace import stuck_fraction
from actuator.hunting.verdict import classify
from actuator.hybrid import HybridSystem
from actuator.simulation.compiled import compile_function
from actuator.simulation.input_form import InputForm
from actuator.simulation.mode_code import ModeCode
from actuator.simulation.run import STUCK, ModeChange, Run
from actuator.simulation.signals import Piece
from actuator.simulation.simulate import simulate
from actuator.simulation.window import VIOLATION, ticks_function

TOLERANCE = 1e-11  # local error of each state over its nominal size
CHUNK, STRIDE = 200, 20  # ticks run at once, and between two points at which margins are checked
BLOCK = 4  # directions differentiated at once
NEWTON_STEPS = 8
PERIODS_ON = 1.2  # that a run is gone on with, to see every tick of a cycle
PATIENCE = 3  # steps that may pass without a better residual
CLOSED = 1e-8  # residual over nominal sizes at which an orbit is closed
FINISHED = 1e-10  # at which more steps are not tried
DIVERGES = 1e6  # residual over nominal sizes at which the search ends
PERIODS = 5  # how many numbers of ticks are tried


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledOrbit:
    """A periodic orbit of a system with sampled controllers at constant inputs.

    Attributes
    ----------
    system : HybridSystem
        To which it belongs.
    u, p : ndarray
        Inputs and parameters.
    ticks : int
        Of the fastest clock in one period.
    x0, m0 : ndarray
        State and modes before the tick at which it starts.
    residual : float
        Largest difference of a state after one period from the start, over its nominal size.
    multipliers : ndarray of complex
        Of the map over one period, without the one that belongs to the clock, largest first.
    clock_multiplier : complex
        What becomes of a shift against the clock in one period.
    """

    system: HybridSystem = field(repr=False)
    u: np.ndarray = field(repr=False)
    p: np.ndarray = field(repr=False)
    ticks: int
    x0: np.ndarray = field(repr=False)
    m0: np.ndarray = field(repr=False)
    residual: float
    multipliers: np.ndarray
    clock_multiplier: complex

    @property
    def period(self) -> float:
        """[s]."""
        return self.ticks * self.system.tick_period(self.p)

    @property
    def stable(self) -> bool:
        """Whether the cycle persists: all multipliers but that of the clock lie inside the unit circle."""
        return bool((abs(self.multipliers) < 1).all())

    @property
    def jitters(self) -> bool:
        """Whether it moves against the clock, so that its period changes from cycle to cycle by about a tick."""
        return abs(self.clock_multiplier) > 1

    @cached_property
    def run(self) -> Run:
        """One period from its start."""
        start = {q.name: float(value) for q, value in zip(self.system.states, self.x0, strict=True)}
        return continued(self.system, start, self.u, self.p, self.period, None)

    @property
    def events(self) -> tuple[ModeChange, ...]:
        """Mode changes of the contacts in one period, with their times after its start [s]."""
        return self.run.changes

    @property
    def stick_fraction(self) -> float:
        """Part of the period in which every contact is stuck."""
        return stuck_fraction(self.run, 0.0, self.period)

    @property
    def load_amplitude(self) -> float:
        """Half of peak to peak at the load [rad]."""
        return float(np.ptp(self.run["load_angle"]) / 2)

    @property
    def motor_amplitude(self) -> float:
        """Half of peak to peak at the motor [rad]."""
        return float(np.ptp(self.run["motor_angle"]) / 2)


def find_sampled_orbit(
    plant: Actuator | HybridSystem,
    run: Run,
    *,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    compiled: bool | None = None,
) -> SampledOrbit:
    """The exact periodic orbit near the cycle that a run of a sampled system ends in.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        The system of the run, with clocks.
    run : Run
        It must end in a cycle (`classify` says so).
    inputs, parameters : mapping of str to float
        By name where they are to differ from those at the end of the run.
    compiled : bool or None
        As for `simulate`.

    Returns
    -------
    SampledOrbit
        With the number of ticks nearest to the period of the cycle with which it closes.

    Raises
    ------
    NoOrbit
        Where the run does not end in a cycle, or no number of ticks near its period closes it.
    """
    system = plant.system() if isinstance(plant, Actuator) else plant
    verdict = classify(run)
    if not verdict.cycles:
        raise NoOrbit(f"{system.name}: the run does not end in a cycle but in {verdict.verdict!r}: {verdict.reason}")
    u = system.input_vector({q.name: float(run[q.name][-1]) for q in system.inputs} | dict(inputs or {}))
    before = {q.name: float(value) for q, value in zip(system.parameters, run.parameters, strict=True)}
    p = system.parameter_values(before | dict(parameters or {}))
    more = continued(system, run.state(), u, p, PERIODS_ON * verdict.period_s, compiled)
    x, m = resting_point(more, verdict.period_s)
    return close_sampled(system, x, m, u, p, verdict.period_s, compiled=compiled)


def continued(  # noqa: PLR0913, PLR0917 - from where, with what, how long
    system: HybridSystem,
    start: Mapping[str, float],
    u: np.ndarray,
    p: np.ndarray,
    duration: float,
    compiled: bool | None,
) -> Run:
    """A run with an output point at every tick."""
    changed = {q.name: float(value) for q, value in zip(system.parameters, p, strict=True) if value != q.default}
    return simulate(
        system,
        duration,
        inputs={quantity.name: float(value) for quantity, value in zip(system.inputs, u, strict=True)},
        start=start,
        parameters=changed,
        resolution=system.tick_period(p),
        tolerance=TOLERANCE,
        compiled=compiled,
    )


def close_sampled(  # noqa: PLR0913, PLR0917 - where to search, and how
    system: HybridSystem,
    x: np.ndarray,
    m: np.ndarray,
    u: np.ndarray,
    p: np.ndarray,
    period: float,
    *,
    compiled: bool | None = None,
) -> SampledOrbit:
    """The orbit through the neighborhood of a state before a tick, by Newton's method.

    Errors as `find_sampled_orbit`.
    """
    ticks = tick_map(system, compiled)
    hyper = system.hyperperiod
    nearest = max(round(period / (hyper * system.tick_period(p))), 1)
    reasons = []
    for count in itertools.islice(_outward(nearest), PERIODS):
        try:
            return _closed(ticks, x, m, u, p, count * hyper)
        except NoOrbit as error:
            reasons.append(f"{count * hyper} ticks: {error}")
    raise NoOrbit(
        f"{system.name}: no orbit of {PERIODS} numbers of ticks about {period:.6g} s closes; {'; '.join(reasons[:3])}"
    )


def _outward(start: int) -> Iterator[int]:
    """start, start + 1, start - 1, start + 2, ..., none below 1."""
    yield start
    for step in itertools.count(1):
        yield start + step
        if start - step >= 1:
            yield start - step


def resting_point(run: Run, period: float) -> tuple[np.ndarray, np.ndarray]:
    """State and modes before the tick in the middle of the longest standstill of the last period.

    Without a standstill before the start of that period. The run has an output point at every tick, which is the state
    after it: what is held is still that of the point before.
    """
    inside = run.t >= run.t[-1] - period
    resting = inside.copy()
    for modes in run.modes.values():
        resting &= modes == STUCK
    spans = np.flatnonzero(np.diff(np.concatenate([[False], resting, [False]]))).reshape(-1, 2)
    if len(spans):
        first, last = spans[np.argmax(spans[:, 1] - spans[:, 0])]
        index = int(first + last) // 2
    else:
        index = int(np.argmax(inside))
    index = max(index, 1)
    held = [state.held for state in run.system.states]
    after, before = (run.system.state_vector(run.state(k)) for k in (index, index - 1))
    return np.where(held, before, after), run.mode_values[:, index]


def _closed(ticks: "TickMap", x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray, count: int) -> SampledOrbit:
    scale, best, since = ticks.scale, math.inf, 0
    for _ in range(NEWTON_STEPS):
        end, modes, moved = ticks.passage(x, m, u, p, count)
        residual = float(np.abs((end - x) / scale).max())
        if not np.array_equal(modes, m) or not residual < DIVERGES:
            raise NoOrbit(f"the modes do not return, or the residual grew to {residual:.3g}")
        if residual < FINISHED or (best < CLOSED and residual >= best / 2):
            return _finished(ticks, x, m, u, p, count, residual, moved)
        since = 0 if residual < best else since + 1
        if since >= PATIENCE:
            break
        best = min(best, residual)
        matrix = moved / scale[:, None] * scale
        x = x - np.linalg.lstsq(matrix - np.eye(x.size), (end - x) / scale, rcond=1e-13)[0] * scale
    raise NoOrbit(f"the residual over nominal sizes stays at {best:.3g}")


def _finished(  # noqa: PLR0913, PLR0917 - all that an orbit is
    ticks: "TickMap",
    x: np.ndarray,
    m: np.ndarray,
    u: np.ndarray,
    p: np.ndarray,
    count: int,
    residual: float,
    moved: np.ndarray,
) -> SampledOrbit:
    values, vectors = np.linalg.eig(moved / ticks.scale[:, None] * ticks.scale)
    # the multiplier of the clock is that of the direction in which the cycle moves from tick to tick
    along = (ticks.passage(x, m, u, p, ticks.system.hyperperiod, derivatives=False)[0] - x) / ticks.scale
    shares = np.abs(np.linalg.lstsq(vectors, along.astype(complex), rcond=None)[0])
    clock = int(np.argmax(shares * np.abs(values)))
    others = np.delete(values, clock).astype(complex)
    return SampledOrbit(
        system=ticks.system,
        u=u,
        p=p,
        ticks=count,
        x0=x,
        m0=m,
        residual=residual,
        multipliers=others[np.argsort(-abs(others))],
        clock_multiplier=complex(values[clock]),
    )


@lru_cache(maxsize=8)
def tick_map(system: HybridSystem, compiled: bool | None = None) -> "TickMap":
    """The tick map of a system, built once."""
    return TickMap(system, compiled)


class TickMap:
    """The motion over a number of ticks, with its derivatives with respect to the state before the first."""

    def __init__(self, system: HybridSystem, compiled: bool | None) -> None:
        if not system.clocks:
            raise ValueError(f"{system.name} has no clock: its orbits are found by find_orbit")
        self.system = system
        self.scale = np.array([state.nominal for state in system.states])
        self._form = InputForm(len(system.inputs), 0)
        function = ticks_function(system, self._form, ModeCode(len(system.modes)), TOLERANCE, CHUNK, 1, STRIDE)
        with contextlib.redirect_stderr(io.StringIO()):  # "Event support is experimental", once per integrator
            tangent = function.forward(BLOCK)
        self._ticks, self._tangent = (
            (None if compiled is False else compile_function(part)) or part for part in (function, tangent)
        )

    def passage(  # noqa: PLR0913, PLR0917 - from where, with what, how far
        self, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray, ticks: int, *, derivatives: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State and modes before the tick that follows, and the derivative of the state, (nx, nx).

        Raises
        ------
        NoOrbit
            Where the engine loses an event on the way.
        """
        system, count = self.system, CHUNK
        wave = self._form.coefficients([Piece(float(value)) for value in u])
        period, moved, done = system.tick_period(p), np.eye(x.size), 0
        while done < ticks:
            n = min(count, ticks - done)
            due = system.due(done + np.arange(count))
            due[:, n:] = -1  # passed over
            known = [x, m, p, due, period, wave]
            results = self._ticks(*known)
            margins, faults, ends, end_modes = (results[k].full() for k in (3, 5, 6, 7))
            seen = math.ceil(n / STRIDE)
            if faults[0, :n].any() or (margins.size and margins[:, :seen].min() < -VIOLATION):
                raise NoOrbit(f"an event was lost {done * period:.6g} s after the start")
            if derivatives:
                moved = self._moved(known, list(results), moved, n)
            x, m, done = ends[:, n - 1], end_modes[:, n - 1], done + n
        return x, np.round(m), moved

    def _moved(self, known: list, results: list, seeds: np.ndarray, n: int) -> np.ndarray:
        """Derivatives after n ticks in the directions `seeds`, BLOCK of them at a time."""
        count, found = seeds.shape[1], []
        none = [np.zeros((np.shape(value)[0] if np.ndim(value) else 1, BLOCK)) for value in known]
        none[3] = np.zeros((known[3].shape[0], CHUNK * BLOCK))
        for k in range(0, count, BLOCK):
            part = np.pad(seeds[:, k : k + BLOCK], ((0, 0), (0, max(0, k + BLOCK - count))))
            tangents = self._tangent(*known, *results, part, *none[1:])[6].full()
            found.append(tangents[:, [j * CHUNK + n - 1 for j in range(BLOCK)]])
        return np.hstack(found)[:, :count]
