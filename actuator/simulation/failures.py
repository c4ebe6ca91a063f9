"""What a run that cannot be completed raises: where it stood, and in which modes."""

from collections.abc import Sequence

import numpy as np

from actuator.system.hybrid import HybridSystem


class SimulationError(RuntimeError):
    """A run that could not be completed; `time` [s] and `modes` say where it stood."""

    def __init__(self, message: str, time: float, modes: dict[str, int]) -> None:
        super().__init__(message)
        self.time = time
        self.modes = modes


class Chattering(SimulationError):
    """More events than any mechanism has: the modes change back and forth without time passing."""


class InconsistentModes(SimulationError):
    """No combination of modes satisfies all contacts at once."""


def explain_stop(
    system: HybridSystem, time: float, modes: Sequence[float] | np.ndarray, reason: str
) -> SimulationError:
    """The integrator gave up at a time, for a reason in its own words."""
    named = {name: int(mode) for name, mode in zip(system.modes, modes, strict=True)}
    kind = Chattering if "max_events" in reason else SimulationError
    return kind(
        f"{system.name}: simulation stopped at t = {time:.9g} s: {reason}; contact modes {_describe(named)}",
        time,
        named,
    )


def explain_inconsistent_modes(
    system: HybridSystem, time: float, modes: Sequence[float] | np.ndarray, margins: np.ndarray | None = None
) -> InconsistentModes:
    """The decision of the modes failed at a time; `modes` are those it came to, and `margins` say what they break."""
    named = {name: int(mode) for name, mode in zip(system.modes, modes, strict=True)}
    why = "the decision for the contacts at rest did not end"
    if margins is not None and margins.min() < 0:
        broken = zip(system.margin_names, margins, strict=True)
        why = (
            f"broken are {', '.join(f'{name} ({margin:.3g} of a usual size)' for name, margin in broken if margin < 0)}"
        )
    return InconsistentModes(
        f"{system.name}: no consistent contact modes at t = {time:.9g} s: {why}; last candidate {_describe(named)}",
        time,
        named,
    )


def _describe(modes: dict[str, int]) -> str:
    return ", ".join(f"{name} = {mode}" for name, mode in modes.items())
