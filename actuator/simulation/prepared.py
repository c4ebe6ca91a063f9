"""A system made ready to run: windows of its motion, interpreted and compiled, and what they return put into words."""

import contextlib
import io
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.simulation.compiled import compiled_where_wanted
from actuator.simulation.failures import explain_inconsistent_modes
from actuator.simulation.input_form import InputForm
from actuator.simulation.mode_code import ModeCode
from actuator.simulation.window import INTERVALS, ticks_function, window_function
from actuator.system.hybrid import HybridSystem


@dataclass(frozen=True)
class EngineOptions:
    """How finely and by which means to integrate.

    Attributes
    ----------
    tolerance : float
        Local error of each state over its nominal size.
    compiled : bool or None
        True and False insist; None compiles where a C compiler is present.
    waves : int
        Number of sine waves that the inputs need at the same time.
    fine, stride : int
        Output intervals between two ticks of sampled controllers, or ticks between two output points; one of them is 1.
    """

    tolerance: float = 1e-7
    compiled: bool | None = None
    waves: int = 0
    fine: int = 1
    stride: int = 1


class Built(NamedTuple):
    """A function in both forms."""

    interpreted: ca.Function
    compiled: ca.Function | None

    @property
    def best(self) -> ca.Function:
        """The faster one."""
        return self.compiled or self.interpreted


class Prepared:
    """The functions of a system for one choice of options."""

    def __init__(self, system: HybridSystem, options: EngineOptions) -> None:
        self.system, self.options = system, options
        self.form, self.code = InputForm(len(system.inputs), options.waves), ModeCode(len(system.modes))
        # a window of ticks has about as many output points as one without
        self.count = max(1, INTERVALS // options.fine) * options.stride

    @cached_property
    def window(self) -> Built:
        """A window without ticks."""
        return self._built(window_function(self.system, self.form, self.code, self.options.tolerance))

    @cached_property
    def ticks(self) -> Built:
        """A window of `count` ticks."""
        options = self.options
        return self._built(
            ticks_function(
                self.system, self.form, self.code, options.tolerance, self.count, options.fine, options.stride
            )
        )

    def _built(self, function: ca.Function) -> Built:
        return Built(function, compiled_where_wanted(function, self.options.compiled))

    def settle(
        self, time: float, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """State and modes after a consistent decision of all modes from the continuous state.

        Raises
        ------
        InconsistentModes
            Where there is none.
        """
        state, modes, fault = self.system.reset(np.zeros(len(self.system.margin_names)), x, m, u, p)
        modes = np.round(modes.full().ravel())
        if float(fault):
            margins = self.system.margins(state, modes, u, p).full().ravel()
            raise explain_inconsistent_modes(self.system, time, modes, margins)
        return state.full().ravel(), modes

    def logged(
        self, time: float, length: float, times: np.ndarray, codes: np.ndarray
    ) -> list[tuple[float, tuple[int, ...]]]:
        """Events of one output interval, oldest first."""
        found = []
        for tau, packed in reversed(list(zip(times, codes.reshape(-1, self.code.size), strict=False))):
            modes = self.code.words(packed)
            if tau < -0.5:  # a fault, with its time below minus one  # noqa: PLR2004
                raise explain_inconsistent_modes(self.system, time + length * (-1 - tau), np.array(modes))
            found.append((time + length * max(tau, 0.0), modes))  # located by the interpolant, a little early
        return found


def called(function: ca.Function, arguments: tuple) -> tuple[list[np.ndarray], str]:
    """Results of a window as arrays, or why there are none."""
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):  # CasADi's own words
            raw = [array.full() for array in function(*arguments)]
    except RuntimeError as error:
        return [], str(error).strip().splitlines()[-1]
    return raw, "" if all(np.isfinite(array).all() for array in raw) else "the state is no longer finite"
