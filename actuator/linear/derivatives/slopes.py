"""Jacobians at an operating point with their derivatives by named parameters, along which the point moves."""

from collections.abc import Sequence
from functools import lru_cache

import casadi as ca
import numpy as np

from actuator.linear.jacobians import rates_function
from actuator.linear.operating_point import OperatingPoint
from actuator.system.hybrid import HybridSystem
from gear.quantities import require_known

Picked = tuple[tuple[int, ...], tuple[int, ...]]  # places of outputs (or states) and of inputs


def indices_of(
    system: HybridSystem, gains: Sequence[str], inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[tuple[int, ...], Picked]:
    """Places of parameters, and of outputs and inputs, by their names; KeyError where there is none."""
    names = [parameter.name for parameter in system.parameters]
    rows = [*(quantity.name for quantity in system.outputs), *(quantity.name for quantity in system.states)]
    columns = [quantity.name for quantity in system.inputs]
    for wanted, valid, what in ((gains, names, "parameter"), (inputs, columns, "input"), (outputs, rows, "output")):
        require_known(wanted, valid, what)
    where = tuple(names.index(name) for name in gains)
    return where, (tuple(rows.index(name) for name in outputs), tuple(columns.index(name) for name in inputs))


def point_sensitivity(point: OperatingPoint, where: tuple[int, ...]) -> np.ndarray:
    """dx0/dp of the operating point, (states, gains), of least norm in nominal sizes: F_x dx0 + F_p = 0."""
    of_state, of_gains = (part.full() for part in _of_rates(point.system, where)(point.x, point.m, point.u, point.p))
    scale = np.array([quantity.nominal for quantity in point.system.states])
    matrix = of_state / scale[:, None] * scale
    rows = 1 / np.maximum(np.linalg.norm(matrix, axis=1), 1e-12)[:, None]  # stiff rows would drown the others
    return scale[:, None] * np.linalg.lstsq(rows * matrix, -rows * of_gains / scale[:, None], rcond=1e-13)[0]


def flow_slopes(
    point: OperatingPoint, where: tuple[int, ...], picked: Picked, moves: np.ndarray, scale: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """A, B, C, D between ticks, and their derivatives."""
    flat, slopes = _of_flow(point.system, where, *picked)(point.x, point.m, point.u, point.p, moves)
    n, r, k = len(scale), *(len(part) for part in picked)
    nominal = (scale[None, :] / scale[:, None], 1 / scale[:, None], scale[None, :], np.ones((1, 1)))
    return split(flat.full(), slopes.full(), ((n, n), (n, k), (r, n), (r, k)), nominal)


def split(
    flat: np.ndarray, slopes: np.ndarray, sizes: Sequence[tuple[int, int]], nominal: Sequence[np.ndarray]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Matrices from one column, and their derivatives from a column each."""
    ends = np.cumsum([first * second for first, second in sizes])[:-1]
    values, changes = [], []
    for part, change, size, factor in zip(np.split(flat, ends), np.split(slopes, ends), sizes, nominal, strict=True):
        values.append(part.reshape(size, order="F") * factor)
        changes.append(
            np.array([column.reshape(size, order="F") * factor for column in change.T]).reshape(change.shape[1], *size)
        )
    return values, changes


def symbols(system: HybridSystem) -> list[ca.SX]:
    """States, modes, inputs and parameters."""
    return [ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p"))]


def along(arguments: list[ca.SX], jacobians: list[tuple[ca.SX, ca.SX]], where: tuple[int, ...]) -> ca.Function:
    """(arguments, dx0/dp) -> Jacobians in one column, and their derivatives by the gains, a column each."""
    x, p = arguments[-4], arguments[-1]
    flat = ca.vertcat(*(ca.vec(ca.jacobian(of, by)) for of, by in jacobians))
    moves = ca.SX.sym("moves", x.numel(), len(where))
    seeds = ca.vertcat(moves, ca.SX(np.eye(p.numel())[:, list(where)]))
    slopes = ca.jtimes(flat, ca.vertcat(x, p), seeds)
    return ca.Function("with_slopes", [*arguments, moves], [ca.densify(flat), ca.densify(slopes)])


@lru_cache(maxsize=32)
def _of_rates(system: HybridSystem, where: tuple[int, ...]) -> ca.Function:
    x, m, u, p = symbols(system)
    rate = rates_function(system)(x, m, u, p)
    return ca.Function("rates", [x, m, u, p], [ca.jacobian(rate, x), ca.jacobian(rate, p[list(where)])])


@lru_cache(maxsize=32)
def _of_flow(
    system: HybridSystem, where: tuple[int, ...], rows: tuple[int, ...], columns: tuple[int, ...]
) -> ca.Function:
    x, m, u, p = symbols(system)
    rate = system.flow(x, m, u, p)
    seen = ca.vertcat(system.outputs_function(x, m, u, p), x)[list(rows)]
    used = u[list(columns)]
    return along([x, m, u, p], [(rate, x), (rate, used), (seen, x), (seen, used)], where)
