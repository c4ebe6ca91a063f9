"""Exact derivatives of a system at an operating point."""

from functools import lru_cache

import casadi as ca
import numpy as np

from actuator.linear.operating_point import OperatingPoint
from actuator.system.hybrid import HybridSystem

STEPPED = ("resolution", "noise")  # fields of a sensor that make steps of its readings


def require_smooth(system: HybridSystem) -> None:
    """Raise ValueError where sensors count or are noisy."""
    steps = [
        parameter.name
        for parameter in system.parameters
        if parameter.name.startswith("sensors.") and parameter.name.endswith(STEPPED)
    ]
    if steps:
        raise ValueError(
            f"{system.name}: {', '.join(steps)} makes steps, which have no derivative: linearize the actuator with "
            "`without_counts(actuator)`, whose sensors read between their counts"
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
