"""The frequency response of a loop with one input and one output, and how much of it double precision can say."""

import math
from collections.abc import Callable

import control
import numpy as np
from scipy.optimize import brentq

from actuator.linear.poles import rounding_bound

NOTHING = 1e-9  # loop gain of a loop that is not there: a stuck gear passes nothing on; of an integrator, its inverse
GRID = np.logspace(-6, 6, 6001)  # rad/s, on which crossings are bracketed
NYQUIST = 1 - 1e-9  # part of half the sampling rate up to which a loop in discrete time is looked at
AT_ONCE = 500  # frequencies
LIGHT = 1e-2  # damping ratio of a resonance that would pass between points of the grid
LEAST = 1e-9  # damping ratio, of an undamped one
BESIDE = np.array([0, 1, 3, 10, 30, 100])  # half widths of a resonance from its middle


class LoopResponse:
    """L at frequencies, with the doubt about each value.

        L = C x + D,    (s - A) x = B,    y (s - A) = C
        doubt = n eps (|y| (|s| + |A|) |x| + |y| |B| + |C| |x| + |D|)

    To first order that is what errors of n eps in every coefficient and in every step of the elimination make of L, n
    being the number of states. It does not depend on the units of the states. At a fraction of an integrator's
    crossover it exceeds one part of L or the other: of k/s^2 the imaginary part is zero, and what is computed is its
    rounding.

    References
    ----------
    Higham, "Accuracy and Stability of Numerical Algorithms", 2nd edition, 2002, section 7.2.
    """

    def __init__(self, loop: control.StateSpace) -> None:
        if loop.ninputs != 1 or loop.noutputs != 1:
            raise ValueError(
                f"margins: the loop has {loop.ninputs} inputs and {loop.noutputs} outputs: its signal is renewed "
                "several times in the period of the slowest clock; `lifted_margins` is for that"
            )
        self.step = float(loop.dt or 0)
        self.a, self.b, self.c, self.d = (np.asarray(part, float) for part in (loop.A, loop.B, loop.C, loop.D))

    def point(self, frequency: np.ndarray | float) -> np.ndarray:
        """Value of s, or of z."""
        return np.exp(1j * np.asarray(frequency) * self.step) if self.step else 1j * np.asarray(frequency)

    def __call__(self, frequency: float) -> complex:
        """L at a frequency [rad/s]."""
        return complex(self.values(np.array([frequency]))[0][0])

    def values(self, frequencies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """L and the doubt about it at frequencies [rad/s]; both infinite at a pole."""
        parts = np.array_split(np.asarray(self.point(frequencies)), max(1, len(frequencies) // AT_ONCE))
        pairs = [self._at(part) for part in parts]
        return np.concatenate([value for value, _ in pairs]), np.concatenate([doubt for _, doubt in pairs])

    def _at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        n, eps = len(self.a), np.finfo(float).eps
        matrix = points[:, None, None] * np.eye(n) - self.a
        try:
            inverse = np.linalg.inv(matrix)
        except np.linalg.LinAlgError:
            if len(points) == 1:
                return np.array([complex(math.inf)]), np.array([math.inf])
            pairs = [self._at(points[k : k + 1]) for k in range(len(points))]
            return np.concatenate([value for value, _ in pairs]), np.concatenate([doubt for _, doubt in pairs])
        x, y = inverse @ self.b, self.c @ inverse
        # a step of refinement makes the error of elimination one of the coefficients, however these are scaled
        x, y = x + inverse @ (self.b - matrix @ x), y + (self.c - y @ matrix) @ inverse
        left = abs(y) @ abs(self.b - matrix @ x)
        size_x, size_y = abs(x), abs(y)
        terms = size_y @ (abs(self.a) @ size_x + abs(points)[:, None, None] * size_x + abs(self.b))
        terms += abs(self.c) @ size_x + abs(self.d)
        doubt = max(n, 1) * eps * terms + left
        return (self.c @ x + self.d)[:, 0, 0], doubt[:, 0, 0]

    def at_ends(self) -> list[tuple[float, float]]:
        """Frequency and L at standstill, and at infinity or half the sampling rate, where L is real; not at a pole.

        A pole is there where coefficients that differ by n eps have one: n eps rho(|1/(s - A)| |s - A|) >= 1, rho being
        the spectral radius (Bauer's condition number, which no units change).
        """
        found = [] if self.step else [(math.inf, self.d.item())]
        for frequency in (0.0, math.pi / self.step) if self.step else (0.0,):
            matrix = np.real(self.point(frequency)) * np.eye(len(self.a)) - self.a
            value, doubt = (float(np.real(part[0])) for part in self.values(np.array([frequency])))
            if doubt < abs(value) < math.inf:
                condition = abs(np.linalg.eigvals(abs(np.linalg.inv(matrix)) @ abs(matrix))).max(initial=0.0)
                if condition * len(matrix) * np.finfo(float).eps < 1:
                    found.append((frequency, value))
        return found

    def grid(self, frequencies: np.ndarray) -> np.ndarray:
        """The frequencies at which the loop has a response of its own, and those of resonances between them."""
        if self.step:
            end = NYQUIST * math.pi / self.step
            frequencies = np.append(frequencies[frequencies < end], end)
        near = self._resonances()
        return np.union1d(frequencies, near[(near > frequencies[0]) & (near < frequencies[-1])])

    def _resonances(self) -> np.ndarray:
        """Frequencies in and beside the lightly damped poles."""
        poles = np.linalg.eigvals(self.a).astype(complex)
        poles = np.log(poles[poles != 0]) / self.step if self.step else poles
        poles = poles[np.imag(poles) > 0]
        damping = abs(np.real(poles)) / abs(poles)
        widths = np.maximum(damping, LEAST)[damping < LIGHT, None] * np.append(-BESIDE, BESIDE)
        return (abs(poles)[damping < LIGHT, None] * (1 + widths)).ravel()

    def stable(self) -> bool:
        """Whether the closed loop, 1/(1 + L), is."""
        return rounding_bound(self.a - self.b @ self.c / (1 + self.d.item()), discrete=self.step > 0) >= 0

    def roots(
        self, of: Callable[[np.ndarray], np.ndarray], frequencies: np.ndarray, values: np.ndarray, doubts: np.ndarray
    ) -> list[float]:
        """Frequencies where a real part `of` L changes a sign that is beyond doubt on both sides."""
        parts = of(values)
        sure = np.flatnonzero(abs(parts) > doubts)
        turns = np.flatnonzero((parts[sure[:-1]] > 0) != (parts[sure[1:]] > 0))
        return [
            float(brentq(lambda w: float(of(np.array(self(w)))), low, high, xtol=1e-12 * low, full_output=True)[1].root)
            for low, high in zip(frequencies[sure[turns]], frequencies[sure[turns + 1]], strict=True)
        ]
