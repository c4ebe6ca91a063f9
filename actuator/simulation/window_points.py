"""What one window of integration returns, on its output points, and windows in a row."""

from typing import NamedTuple

import numpy as np


class Window(NamedTuple):
    """What one call of the integrator returns, on its output points (columns); the first is the start."""

    time: np.ndarray  # (n,)
    states: np.ndarray  # (nx, n)
    modes: np.ndarray  # (nm, n)
    outputs: np.ndarray  # (ny, n)
    margins: np.ndarray  # (ng, n)
    events: list[tuple[float, tuple[int, ...]]]  # (time, modes after)
    settled: int  # missed events that had to be settled

    @property
    def end(self) -> tuple[np.ndarray, np.ndarray]:
        """State and modes at the end."""
        return self.states[:, -1], self.modes[:, -1]

    def until(self, k: int) -> "Window":
        """The points up to and including k."""
        return self._replace(**{name: getattr(self, name)[..., : k + 1] for name in ARRAYS})


ARRAYS = ("time", "states", "modes", "outputs", "margins")  # fields of a window with a column per point


def join(windows: list[Window]) -> Window:
    """Windows in a row; of a point that two share the later value counts."""
    last = len(windows) - 1

    def joined(name: str) -> np.ndarray:
        parts = [getattr(window, name) for window in windows]
        return np.concatenate([part if k == last else part[..., :-1] for k, part in enumerate(parts)], axis=-1)

    return windows[last]._replace(
        **{name: joined(name) for name in ARRAYS},
        events=[event for window in windows for event in window.events],
        settled=sum(window.settled for window in windows),
    )
