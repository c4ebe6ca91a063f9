"""Builds the model of sampled control over one period of all clocks, with its derivatives by named parameters.

What happens between ticks is a matrix exponential, a tick is a Jacobian, and their derivatives go along the way on
which the operating point moves with the gains.
"""

from collections.abc import Sequence
from functools import lru_cache

import casadi as ca
import numpy as np
from scipy.linalg import expm, expm_frechet

from actuator.linear.derivatives.sampled import SampledGainModel
from actuator.linear.derivatives.slopes import along, flow_slopes, indices_of, point_sensitivity, split, symbols
from actuator.linear.jacobians import require_smooth
from actuator.linear.loop import ticks_between
from actuator.linear.operating_point import OperatingPoint
from actuator.system.hybrid import HybridSystem
from gear.quantities.roles import LoopSignal

SAME = 1e-13  # relative change of what flows between ticks that is none


def sampled_gain_model(
    point: OperatingPoint,
    gains: Sequence[str],
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    resting: OperatingPoint | None = None,
) -> SampledGainModel:
    """Exact model of sampled control in the point's contact mode, with its derivatives by named parameters.

    Parameters as for `gain_model`, of which this is the counterpart.

    Raises
    ------
    ValueError
        For a controller in continuous time, or sensors that count.
    """
    system = point.system
    if not system.clocks:
        raise ValueError(f"{system.name}: sampled_gain_model takes sampled controllers; gain_model is for the others")
    require_smooth(system)
    where, picked = indices_of(system, gains, inputs, outputs)
    moves, base = point_sensitivity(resting or point, where), system.tick_period(point.p)
    n, k = len(point.x), len(inputs)
    scale = np.array([quantity.nominal for quantity in system.states])
    (a, b, c, d), (da, db, dc, dd) = flow_slopes(point, where, picked, moves, scale)

    # between ticks: [A B; 0 0], whose exponential holds Phi and Gamma
    def flowing(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.block([[a, b], [np.zeros((k, n + k))]]) * base

    def changed(a_changed: np.ndarray, b_changed: np.ndarray) -> np.ndarray:
        direction = flowing(a_changed, b_changed)
        # sampled laws act at ticks; between them the model changes only with an operating point that moves
        if abs(direction).max() <= SAME * abs(whole).max():
            return np.zeros_like(whole)
        return np.asarray(expm_frechet(whole, direction, compute_expm=False))

    whole = flowing(a, b)
    between, changes = np.asarray(expm(whole)), np.array([changed(*each) for each in zip(da, db, strict=True)])
    ticks, g = system.hyperperiod, len(gains)
    state, forced = np.eye(n), np.zeros((n, ticks * k))
    of_state, of_forced = np.zeros((g, n, n)), np.zeros((g, n, ticks * k))
    seen: list[tuple[np.ndarray, ...]] = []

    def through(x: np.ndarray, u: np.ndarray, dx: np.ndarray, du: np.ndarray, now: slice) -> None:
        """Follow state and inputs of this tick through one linear map, by the rule of products."""
        nonlocal state, forced, of_state, of_forced
        of_state, of_forced = dx @ state + x @ of_state, dx @ forced + x @ of_forced
        state, forced = x @ state, x @ forced
        forced[:, now] += u
        of_forced[:, :, now] += du

    for tick in range(ticks):
        now = slice(tick * k, (tick + 1) * k)
        through(*_tick(point, where, picked[1], moves, scale, tick), now)
        direct, of_direct = c @ forced, dc @ forced + c @ of_forced
        direct[:, now] += d
        of_direct[:, :, now] += dd
        seen.append((c @ state, direct, dc @ state + c @ of_state, of_direct))
        through(between[:n, :n], between[:n, n:], changes[:, :n, :n], changes[:, :n, n:], now)
    of_states, direct, of_states_changed, direct_changed = (np.array(part) for part in zip(*seen, strict=True))
    named = {quantity.name: quantity for quantity in system.inputs}
    injected = [role.signal for name in inputs if (role := named[name].role(LoopSignal))]
    return SampledGainModel(
        gains=tuple(gains),
        given=tuple(inputs),
        seen=tuple(outputs),
        base=base,
        renewed={name: ticks_between(system, name) for name in injected},
        a=state,
        b=forced.reshape(n, ticks, k),
        c=of_states,
        d=direct.reshape(ticks, -1, ticks, k),
        slopes=(
            of_state,
            of_forced.reshape(g, n, ticks, k),
            np.moveaxis(of_states_changed, 0, 1),
            np.moveaxis(direct_changed, 0, 1).reshape(g, ticks, -1, ticks, k),
        ),
    )


def _tick(  # noqa: PLR0913, PLR0917 - a point, along what it moves, and which tick
    point: OperatingPoint,
    where: tuple[int, ...],
    columns: tuple[int, ...],
    moves: np.ndarray,
    scale: np.ndarray,
    tick: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Tx, Tu of a tick, and their derivatives."""
    due = point.system.due(np.array([tick]))
    flat, slopes = _of_tick(point.system, where, columns)(due, point.x, point.m, point.u, point.p, moves)
    n, k = len(scale), len(columns)
    nominal = (scale[None, :] / scale[:, None], 1 / scale[:, None])
    values, changes = split(flat.full(), slopes.full(), ((n, n), (n, k)), nominal)
    return values[0], values[1], changes[0], changes[1]


@lru_cache(maxsize=32)
def _of_tick(system: HybridSystem, where: tuple[int, ...], columns: tuple[int, ...]) -> ca.Function:
    assert system.tick is not None
    x, m, u, p = symbols(system)
    due = ca.SX.sym("due", len(system.clocks))
    after = system.tick(due, x, m, u, p)
    return along([due, x, m, u, p], [(after, x), (after, u[list(columns)])], where)
