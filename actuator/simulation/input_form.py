"""All inputs of a window as one vector of coefficients."""

from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.simulation.signals import Piece


class InputForm(NamedTuple):
    """All inputs between two break points: lines plus a number of shared waves, as one coefficient vector."""

    inputs: int
    waves: int

    @property
    def size(self) -> int:
        """Length of the coefficient vector: offsets, slopes; per wave sines, cosines; per wave its frequencies."""
        return self.inputs * (2 + 2 * self.waves) + 2 * self.waves

    def values(self, time: ca.SX, coefficients: ca.SX) -> ca.SX:
        """Value of u at `time` after the start of the window."""
        n = self.inputs
        u = coefficients[:n] + coefficients[n : 2 * n] * time
        for k in range(self.waves):
            first, pair = (2 + 2 * k) * n, (2 + 2 * self.waves) * n + 2 * k
            angle = coefficients[pair] * time + coefficients[pair + 1] * time**2 / 2
            u += coefficients[first : first + n] * ca.sin(angle) + coefficients[first + n : first + 2 * n] * ca.cos(
                angle
            )
        return u

    def coefficients(self, pieces: list[Piece]) -> np.ndarray:
        """Coefficient vector from one piece per input."""
        n, shapes = self.inputs, sorted({(wave.frequency, wave.rate) for piece in pieces for wave in piece.waves})
        if len(shapes) > self.waves:
            raise ValueError(
                f"the inputs have {len(shapes)} different waves at once, the engine was built for {self.waves}"
            )
        vector = np.zeros(self.size)
        for i, piece in enumerate(pieces):
            vector[i], vector[n + i] = piece.offset, piece.slope
            for wave in piece.waves:
                first = (2 + 2 * shapes.index((wave.frequency, wave.rate))) * n
                vector[first + i] += wave.amplitude * np.cos(wave.phase)
                vector[first + n + i] += wave.amplitude * np.sin(wave.phase)
        frequencies = np.ravel(shapes)
        vector[(2 + 2 * self.waves) * n :][: frequencies.size] = frequencies
        return vector

    def function(self) -> ca.Function:
        """(time, coefficients) -> u."""
        time, wave = ca.SX.sym("time"), ca.SX.sym("wave", self.size)
        return ca.Function("input", [time, wave], [self.values(time, wave)])
