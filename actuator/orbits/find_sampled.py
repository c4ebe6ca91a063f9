"""Periodic orbits under sampled control, closed by Newton's method over the numbers of ticks near a period."""

import itertools
import math
from collections.abc import Iterator

import numpy as np

from actuator.orbits.flow import NoOrbit
from actuator.orbits.sampled import SampledOrbit, TickMap, continue_run, tick_map
from actuator.simulation.run import Run
from actuator.system.contact_modes import find_standstill
from actuator.system.hybrid import HybridSystem

NEWTON_STEPS = 8
PERIODS_ON = 1.2  # that a run is gone on with, to see every tick of a cycle
PATIENCE = 3  # steps that may pass without a better residual
CLOSED = 1e-8  # residual over nominal sizes at which an orbit is closed
FINISHED = 1e-10  # at which more steps are not tried
DIVERGES = 1e6  # residual over nominal sizes at which the search ends
PERIODS = 5  # how many numbers of ticks are tried


def find_sampled(  # noqa: PLR0913, PLR0917 - the cycle at the end of a run
    system: HybridSystem, run: Run, period: float, u: np.ndarray, p: np.ndarray, *, compiled: bool | None
) -> SampledOrbit:
    """The orbit near the cycle of this period that a run ends in, with the nearest number of ticks that closes.

    Raises
    ------
    NoOrbit
        Where no number of ticks near the period closes it.
    """
    more = continue_run(system, run.state(), u, p, PERIODS_ON * period, compiled)
    x, m = resting_point(more, period)
    return close_sampled(system, x, m, u, p, period, compiled=compiled)


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

    Raises
    ------
    NoOrbit
        Where no number of ticks near the period closes it.
    """
    ticks = tick_map(system, compiled)
    hyper = system.hyperperiod
    nearest = max(round(period / (hyper * system.tick_period(p))), 1)
    reasons = []
    for count in itertools.islice(_outward(nearest), PERIODS):
        try:
            return _close(ticks, x, m, u, p, count * hyper)
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
    resting = inside & find_standstill(run.modes)
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


def _close(ticks: TickMap, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray, count: int) -> SampledOrbit:
    scale, best, since = ticks.scale, math.inf, 0
    for _ in range(NEWTON_STEPS):
        end, modes, moved = ticks.passage(x, m, u, p, count)
        residual = float(np.abs((end - x) / scale).max())
        if not np.array_equal(modes, m) or not residual < DIVERGES:
            raise NoOrbit(f"the modes do not return, or the residual grew to {residual:.3g}")
        if residual < FINISHED or (best < CLOSED and residual >= best / 2):
            return _build_orbit(ticks, x, m, u, p, count, residual, moved)
        since = 0 if residual < best else since + 1
        if since >= PATIENCE:
            break
        best = min(best, residual)
        matrix = moved / scale[:, None] * scale
        x = x - np.linalg.lstsq(matrix - np.eye(x.size), (end - x) / scale, rcond=1e-13)[0] * scale
    raise NoOrbit(f"the residual over nominal sizes stays at {best:.3g}")


def _build_orbit(  # noqa: PLR0913, PLR0917 - all that an orbit is
    ticks: TickMap,
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
