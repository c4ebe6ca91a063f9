"""A function of the system at many points: outputs and margins along a run."""

import numpy as np

from actuator.engine.memory import call, entry


@entry("void(int64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[:, ::1])")
def _along(w, states, modes, inputs, p, results):
    for k in range(states.shape[0]):
        call(w, 0, (states[k], modes[k], inputs[k], p, results[k]))


def along(
    address: int, size: int, states: np.ndarray, modes: np.ndarray, inputs: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """Results (points, size) of a function of (state, modes, inputs, parameters) at an address; arguments in rows."""
    results = np.empty((len(states), size))
    rows = (np.ascontiguousarray(array, float) for array in (states, modes, inputs))
    _along(np.array([address]), *rows, np.ascontiguousarray(p, float), results)
    return results
