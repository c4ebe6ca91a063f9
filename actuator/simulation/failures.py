"""What a run that cannot be completed raises: where it stood, and in which modes."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuator.engine.advance import BOUND, CHATTERS, CROWD, CROWDED, GROWN, JAMMED
from actuator.system.hybrid import HybridSystem

if TYPE_CHECKING:
    from actuator.engine.engine import Trace
    from actuator.simulation.run import Run


class SimulationError(RuntimeError):
    """A run that could not be completed; `time` [s] and `modes` say where it stood, `run` has what there is of it."""

    def __init__(self, message: str, time: float, modes: dict[str, int], run: "Run | None" = None) -> None:
        super().__init__(message)
        self.time = time
        self.modes = modes
        self.run = run


class Chattering(SimulationError):
    """More events than any mechanism has: the modes change back and forth without time passing."""


class Diverged(SimulationError):
    """A state has left all bounds."""


class InconsistentModes(SimulationError):
    """No combination of modes satisfies all contacts at once."""


def explain_stop(system: HybridSystem, trace: "Trace", run: "Run | None" = None) -> SimulationError:
    """What a run that did not reach its end raises, with what there is of it."""
    modes = trace.end[1]
    if trace.status == JAMMED:
        error = explain_inconsistent_modes(system, trace.time, modes)
    else:
        named = {name: int(mode) for name, mode in zip(system.modes, modes, strict=True)}
        kind, reason = SimulationError, "no step holds the tolerance, however short"
        if trace.status == CHATTERS:
            kind, reason = Chattering, f"more than {CROWD} events in {CROWDED:g} s"
        elif trace.status == GROWN:
            state = system.states[trace.worst]
            kind, reason = Diverged, f"{state.name} grows beyond {BOUND * state.nominal:.3g} {state.unit}"
        error = kind(
            f"{system.name}: simulation stopped at t = {trace.time:.9g} s: {reason}; contact modes {_describe(named)}",
            trace.time,
            named,
        )
    error.run = run
    return error


def explain_inconsistent_modes(
    system: HybridSystem, time: float, modes: Sequence[float] | np.ndarray
) -> InconsistentModes:
    """The decision of the modes failed at a time; `modes` are those it tried last."""
    named = {name: int(mode) for name, mode in zip(system.modes, modes, strict=True)}
    return InconsistentModes(
        f"{system.name}: no consistent contact modes at t = {time:.9g} s; last candidate {_describe(named)}; "
        "check for self-locking",
        time,
        named,
    )


def _describe(modes: dict[str, int]) -> str:
    return ", ".join(f"{name} = {mode}" for name, mode in modes.items())
