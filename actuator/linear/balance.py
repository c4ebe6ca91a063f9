"""The equations of an operating point in one contact mode, and what rounding leaves of them."""

from functools import lru_cache

import casadi as ca
import numpy as np

from actuator.linear.locked import eliminated, slips
from actuator.linear.operating_point import OperatingPoint
from actuator.system.hybrid import HybridSystem

STILL = 1e-9  # rate of a state over its nominal size [1/s] that counts as zero
ROUNDING, MOST_ROUNDING = 100 * np.finfo(float).eps, 1e-2


class Balance:
    """The equations of a contact mode, in states over their nominal sizes, without what stuck contacts lock."""

    def __init__(  # noqa: PLR0913, PLR0917 - a place in a mode of a system
        self, system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray, free: np.ndarray
    ) -> None:
        self.system, self.m, self.u, self.p, self.free = system, m, u, p, free
        self.scale = np.array([quantity.nominal for quantity in system.states])
        # what stuck contacts lock is no unknown: the balance of its torques holds whatever they are, but for rounding
        start = OperatingPoint(system=system, x=x, m=m, u=u, p=p, rates=np.zeros_like(x))
        self.expressed, self.kept = eliminated([row * self.scale for row in slips(start)], len(x))
        unknown = np.flatnonzero(free[self.kept])  # a drifting state may have any constant rate
        self.equations, self.moves = np.array(self.kept)[unknown], self.expressed[:, unknown]

    def unlocked(self, state: np.ndarray) -> np.ndarray:
        """The state, with what is locked as the others have it."""
        return self.scale * (self.expressed @ (state / self.scale)[self.kept])

    def flow(self, state: np.ndarray) -> np.ndarray:
        """dx/dt."""
        return rates_function(self.system)(state, self.m, self.u, self.p).full().ravel()

    def residual(self, state: np.ndarray) -> np.ndarray:
        """Rates that should be zero."""
        return (self.flow(state) / self.scale)[self.equations]

    def slopes(self, state: np.ndarray) -> np.ndarray:
        """Their derivatives by the unknowns."""
        matrix = _jacobian(self.system)(state, self.m, self.u, self.p).full()
        return (matrix / self.scale[:, None] * self.scale)[self.equations] @ self.moves

    def rounding(self, state: np.ndarray) -> np.ndarray:
        """What is left of the rates by rounding."""
        return rounding(self.system, state, self.m, self.u, self.p)

    def left(self, state: np.ndarray) -> np.ndarray:
        """Sizes of all rates that should be zero."""
        return abs(np.where(self.free, self.unlocked(self.flow(state)) / self.scale, 0.0))

    def holds(self, state: np.ndarray) -> bool:
        """Whether nothing changes, but for rounding."""
        return bool((self.left(state) <= self.rounding(state)).all())


def rounding(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Rates of the states over their nominal sizes [1/s] that are rounding: stiff teeth make much of little."""
    scale = np.array([quantity.nominal for quantity in system.states])
    matrix = np.abs(_jacobian(system)(x, m, u, p).full())
    return STILL + np.minimum(ROUNDING * (matrix @ np.abs(x)) / scale, MOST_ROUNDING)


@lru_cache(maxsize=32)
def _jacobian(system: HybridSystem) -> ca.Function:
    x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p")))
    return ca.Function("jacobian", [x, m, u, p], [ca.jacobian(rates_function(system)(x, m, u, p), x)])


@lru_cache(maxsize=32)
def rates_function(system: HybridSystem) -> ca.Function:
    """(x, m, u, p) -> dx/dt; of what a clock holds, the change at a tick at which all are due, over the period."""
    if system.tick is None or system.period is None:
        return system.flow
    x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p")))
    changes = (system.tick(ca.SX.ones(len(system.clocks)), x, m, u, p) - x) / system.period(p)
    return ca.Function("rates", [x, m, u, p], [system.flow(x, m, u, p) + changes])
