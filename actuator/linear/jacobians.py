"""Exact derivatives of a system at an operating point, what rounding leaves of them, and what stuck contacts lock."""

from functools import lru_cache

import casadi as ca
import numpy as np

from actuator.linear.operating_point import OperatingPoint
from actuator.system.hybrid import HybridSystem
from gear.quantities.roles import NoiseLevel, Resolution, ShaftAngle, ShaftSpeed

STILL = 1e-9  # rate of a state over its nominal size [1/s] that counts as zero
ROUNDING, MOST_ROUNDING = 100 * np.finfo(float).eps, 1e-2
DEPENDENT = 1e-9  # part of a row that is left of it when it follows from others
HELD = 1e-10  # part of the fastest rate of the model by which something locked may seem to move, by rounding


def require_smooth(system: HybridSystem) -> None:
    """Raise ValueError where sensors count or are noisy."""
    steps = [each.name for each in system.parameters if each.role(Resolution) or each.role(NoiseLevel)]
    if steps:
        raise ValueError(
            f"{system.name}: {', '.join(steps)} makes steps, which have no derivative: linearize the actuator with "
            "`without_quantization(actuator)`, whose sensors read between their counts"
        )


def jacobians(point: OperatingPoint) -> tuple[np.ndarray, ...]:
    """A, B, C, D of flow and outputs for all inputs, all outputs and, below them, all states."""
    a, b, c, d = (part.full() for part in _of_flow(point.system)(point.x, point.m, point.u, point.p))
    return a, b, np.vstack([c, np.eye(len(a))]), np.vstack([d, np.zeros((len(a), d.shape[1]))])


def tick_jacobians(point: OperatingPoint, tick: int) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the state after a tick of this number by the state before it and by the inputs."""
    due = point.system.due(np.array([tick]))
    return tuple(part.full() for part in _of_tick(point.system)(due, point.x, point.m, point.u, point.p))


def _symbols(system: HybridSystem) -> list[ca.SX]:
    return [ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p"))]


@lru_cache(maxsize=32)
def _of_flow(system: HybridSystem) -> ca.Function:
    x, m, u, p = _symbols(system)
    rate, output = system.flow(x, m, u, p), system.outputs_function(x, m, u, p)
    return ca.Function("jacobians", [x, m, u, p], [ca.jacobian(f, v) for f in (rate, output) for v in (x, u)])


@lru_cache(maxsize=32)
def _of_tick(system: HybridSystem) -> ca.Function:
    assert system.tick is not None
    x, m, u, p = _symbols(system)
    due = ca.SX.sym("due", len(system.clocks))
    after = system.tick(due, x, m, u, p)
    return ca.Function("tick_jacobians", [due, x, m, u, p], [ca.jacobian(after, x), ca.jacobian(after, u)])


def rounding(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Rates of the states over their nominal sizes [1/s] that are rounding: stiff teeth make much of little."""
    scale = np.array([quantity.nominal for quantity in system.states])
    matrix = np.abs(rates_jacobian(system)(x, m, u, p).full())
    return STILL + np.minimum(ROUNDING * (matrix @ np.abs(x)) / scale, MOST_ROUNDING)


@lru_cache(maxsize=32)
def rates_jacobian(system: HybridSystem) -> ca.Function:
    """(x, m, u, p) -> derivatives of the rates by the states."""
    x, m, u, p = _symbols(system)
    return ca.Function("jacobian", [x, m, u, p], [ca.jacobian(rates_function(system)(x, m, u, p), x)])


@lru_cache(maxsize=32)
def rates_function(system: HybridSystem) -> ca.Function:
    """(x, m, u, p) -> dx/dt; of what a clock holds, the change at a tick at which all are due, over the period."""
    if system.tick is None or system.period is None:
        return system.flow
    x, m, u, p = _symbols(system)
    changes = (system.tick(ca.SX.ones(len(system.clocks)), x, m, u, p) - x) / system.period(p)
    return ca.Function("rates", [x, m, u, p], [system.flow(x, m, u, p) + changes])


def remove_stuck(point: OperatingPoint, matrices: tuple[np.ndarray, ...]) -> tuple[tuple[np.ndarray, ...], list[int]]:
    """A, B, C, D without the states that follow from the others where contacts are stuck, and which states are left.

    A stuck contact has no slip, c . speeds = 0, and does not travel, c . angles = 0 in deviations from the point. Each
    such equation takes out one state, the one with the largest part in it.

    Raises
    ------
    ArithmeticError
        Where the model moves what is locked.
    """
    a, b, c, d = matrices
    rows = [row for slip in slip_rows(point) for row in (slip, _travel(point, slip))]
    expressed, kept = eliminate(rows, len(a))
    scale = np.array([quantity.nominal for quantity in point.system.states])
    fastest = abs(a * scale / scale[:, None]).max(initial=0.0)
    for row in rows:
        moved = abs(row @ a @ expressed * scale[kept]).max(initial=0.0) / (abs(row) @ scale)
        if moved > HELD * fastest:
            raise ArithmeticError(
                f"{point.system.name}: a contact is stuck and its slip changes all the same, by {moved:.3g} of its "
                f"usual size per second, where {HELD * fastest:.3g} is rounding; use minimal=False"
            )
    return (a[kept] @ expressed, b[kept], c @ expressed, d), kept


def slip_rows(point: OperatingPoint) -> list[np.ndarray]:
    """A row over the states for the slip of each stuck contact."""
    system = point.system
    modes = dict(zip(system.modes, np.round(point.m), strict=True))
    stuck = [
        k
        for k, contact in enumerate(system.contacts)
        if abs(modes[contact.motion]) != 1 and not (contact.flank and modes[contact.flank] == 0)
    ]
    return list(_of_slips(system)(point.x, point.m, point.u, point.p).full()[stuck])


@lru_cache(maxsize=32)
def _of_slips(system: HybridSystem) -> ca.Function:
    x, m, u, p = _symbols(system)
    slip = ca.SX(0, 1) if system.contact_state is None else system.contact_state(x, m, u, p)[0]
    return ca.Function("slips", [x, m, u, p], [ca.jacobian(slip, x)])


def _travel(point: OperatingPoint, slip: np.ndarray) -> np.ndarray:
    """The same row over the angles instead of the speeds."""
    states = point.system.states
    angles = {role.shaft: k for k, state in enumerate(states) if (role := state.role(ShaftAngle))}
    travel = np.zeros_like(slip)
    for k, state in enumerate(states):
        if slip[k] and (role := state.role(ShaftSpeed)):
            travel[angles[role.shaft]] = slip[k]
    return travel


def eliminate(rows: list[np.ndarray], states: int) -> tuple[np.ndarray, list[int]]:
    """All states by those that are left where each row over them is zero, and which are left.

    Each row takes out one state, the one with the largest part in it.
    """
    expressed, kept = np.eye(states), list(range(states))
    for row in rows:
        left = row @ expressed
        if abs(left).max(initial=0.0) <= DEPENDENT * abs(row).max():
            continue
        gone = int(abs(left).argmax())
        expressed = expressed - np.outer(expressed[:, gone], left / left[gone])
        kept.remove(gone)
    return expressed[:, kept], kept
