"""An input between two of its break points: a line and sine waves."""

from typing import Any, NamedTuple

import numpy as np


class Wave(NamedTuple):
    """amplitude * sin(phase + frequency tau + rate tau^2 / 2), tau from the start of a piece."""

    amplitude: float
    phase: float  # rad
    frequency: float  # rad/s
    rate: float = 0.0  # rad/s^2


class Piece(NamedTuple):
    """offset + slope tau + sum of waves, with tau counted from the start of the piece."""

    offset: float
    slope: float = 0.0
    waves: tuple[Wave, ...] = ()

    def after(self, delay: float) -> "Piece":
        """The same curve with tau counted from `delay` later."""
        return Piece(
            self.offset + self.slope * delay,
            self.slope,
            tuple(
                Wave(
                    wave.amplitude,
                    wave.phase + wave.frequency * delay + wave.rate * delay**2 / 2,
                    wave.frequency + wave.rate * delay,
                    wave.rate,
                )
                for wave in self.waves
            ),
        )

    def __call__(self, tau: Any) -> Any:
        """Value at tau, a number or an array."""
        value = self.offset + self.slope * tau
        for wave in self.waves:
            value = value + wave.amplitude * np.sin(wave.phase + wave.frequency * tau + wave.rate * tau**2 / 2)
        return value
