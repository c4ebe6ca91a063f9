"""The map over a number of ticks of sampled controllers, with its derivative."""

import contextlib
import io
import math
from functools import lru_cache

import numpy as np

from actuator.orbits.flow import NoOrbit
from actuator.simulation.compiled import compiled_where_wanted
from actuator.simulation.input_form import InputForm
from actuator.simulation.mode_code import ModeCode
from actuator.simulation.signals import Piece
from actuator.simulation.window import VIOLATION, ticks_function
from actuator.system.hybrid import HybridSystem

TOLERANCE = 1e-11  # local error of each state over its nominal size
CHUNK, STRIDE = 200, 20  # ticks run at once, and between two points at which margins are checked
BLOCK = 4  # directions differentiated at once


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
        self._ticks, self._tangent = (compiled_where_wanted(part, compiled) or part for part in (function, tangent))

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
