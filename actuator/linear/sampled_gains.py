"""Builds the model of sampled control over one period of all clocks, with its derivatives by named parameters.

What happens between ticks is a matrix exponential, a tick is a Jacobian, and their derivatives go along the way on
which the operating point moves with the gains.
"""

from collections.abc import Sequence
from functools import lru_cache

import casadi as ca
import numpy as np
from scipy.linalg import expm, expm_frechet

from actuator.hybrid import HybridSystem
from actuator.ledger import PREFIX
from actuator.linear.balance import rates_function
from actuator.linear.jacobians import require_smooth
from actuator.linear.model import ticks_between
from actuator.linear.operating_point import OperatingPoint
from actuator.linear.sampled_gain_model import SampledGainModel
from actuator.parameters import require_known

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
    names = [parameter.name for parameter in system.parameters]
    rows = [*(quantity.name for quantity in system.outputs), *(quantity.name for quantity in system.states)]
    columns = [quantity.name for quantity in system.inputs]
    for wanted, valid, what in ((gains, names, "parameter"), (inputs, columns, "input"), (outputs, rows, "output")):
        require_known(wanted, valid, what)
    where = tuple(names.index(name) for name in gains)
    picked = tuple(rows.index(name) for name in outputs), tuple(columns.index(name) for name in inputs)
    moves, base = _moves(resting or point, where), system.tick_period(point.p)
    n, k = len(point.x), len(inputs)
    scale = np.array([quantity.nominal for quantity in system.states])
    (a, b, c, d), (da, db, dc, dd) = _flow(point, where, picked, moves, scale)

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
    injected = [name.removeprefix(PREFIX) for name in inputs if name.startswith(PREFIX)]
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


# -- Jacobians and their derivatives, at the point and along the way it moves with the gains ----------------

Picked = tuple[tuple[int, ...], tuple[int, ...]]


def _moves(point: OperatingPoint, where: tuple[int, ...]) -> np.ndarray:
    """dx0/dp of the operating point, (states, gains), of least norm in nominal sizes: F_x dx0 + F_p = 0."""
    of_state, of_gains = (part.full() for part in _of_rates(point.system, where)(point.x, point.m, point.u, point.p))
    scale = np.array([quantity.nominal for quantity in point.system.states])
    matrix = of_state / scale[:, None] * scale
    rows = 1 / np.maximum(np.linalg.norm(matrix, axis=1), 1e-12)[:, None]  # stiff rows would drown the others
    return scale[:, None] * np.linalg.lstsq(rows * matrix, -rows * of_gains / scale[:, None], rcond=1e-13)[0]


def _flow(
    point: OperatingPoint, where: tuple[int, ...], picked: Picked, moves: np.ndarray, scale: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """A, B, C, D between ticks, and their derivatives."""
    flat, slopes = _of_flow(point.system, where, *picked)(point.x, point.m, point.u, point.p, moves)
    n, r, k = len(scale), *(len(part) for part in picked)
    nominal = (scale[None, :] / scale[:, None], 1 / scale[:, None], scale[None, :], np.ones((1, 1)))
    return _split(flat.full(), slopes.full(), ((n, n), (n, k), (r, n), (r, k)), nominal)


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
    values, changes = _split(flat.full(), slopes.full(), ((n, n), (n, k)), nominal)
    return values[0], values[1], changes[0], changes[1]


def _split(
    flat: np.ndarray, slopes: np.ndarray, sizes: Sequence[tuple[int, int]], nominal: Sequence[np.ndarray]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Matrices from one column, and their derivatives from a column each."""
    ends = np.cumsum([first * second for first, second in sizes])[:-1]
    values, changes = [], []
    for part, change, size, factor in zip(np.split(flat, ends), np.split(slopes, ends), sizes, nominal, strict=True):
        values.append(part.reshape(size, order="F") * factor)
        changes.append(np.array([column.reshape(size, order="F") * factor for column in change.T]))
    return values, changes


def _symbols(system: HybridSystem) -> list[ca.SX]:
    return [ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p"))]


@lru_cache(maxsize=32)
def _of_rates(system: HybridSystem, where: tuple[int, ...]) -> ca.Function:
    x, m, u, p = _symbols(system)
    rate = rates_function(system)(x, m, u, p)
    return ca.Function("rates", [x, m, u, p], [ca.jacobian(rate, x), ca.jacobian(rate, p[list(where)])])


@lru_cache(maxsize=32)
def _of_flow(
    system: HybridSystem, where: tuple[int, ...], rows: tuple[int, ...], columns: tuple[int, ...]
) -> ca.Function:
    x, m, u, p = _symbols(system)
    rate = system.flow(x, m, u, p)
    seen = ca.vertcat(system.outputs_function(x, m, u, p), x)[list(rows)]
    used = u[list(columns)]
    return _along([x, m, u, p], [(rate, x), (rate, used), (seen, x), (seen, used)], where)


@lru_cache(maxsize=32)
def _of_tick(system: HybridSystem, where: tuple[int, ...], columns: tuple[int, ...]) -> ca.Function:
    assert system.tick is not None
    x, m, u, p = _symbols(system)
    due = ca.SX.sym("due", len(system.clocks))
    after = system.tick(due, x, m, u, p)
    return _along([due, x, m, u, p], [(after, x), (after, u[list(columns)])], where)


def _along(arguments: list[ca.SX], jacobians: list[tuple[ca.SX, ca.SX]], where: tuple[int, ...]) -> ca.Function:
    """(arguments, dx0/dp) -> Jacobians in one column, and their derivatives by the gains, a column each."""
    x, p = arguments[-4], arguments[-1]
    flat = ca.vertcat(*(ca.vec(ca.jacobian(of, by)) for of, by in jacobians))
    moves = ca.SX.sym("moves", x.numel(), len(where))
    seeds = ca.vertcat(moves, ca.SX(np.eye(p.numel())[:, list(where)]))
    slopes = ca.jtimes(flat, ca.vertcat(x, p), seeds)
    return ca.Function("with_slopes", [*arguments, moves], [ca.densify(flat), ca.densify(slopes)])
