"""Linear models with their exact derivatives by named parameters, for tuning: responses to sines and steps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm, expm_frechet

from actuator.linear.derivatives.slopes import flow_slopes, indices_of, point_sensitivity
from actuator.linear.jacobians import require_smooth
from actuator.linear.operating_point import OperatingPoint
from controllers.loop import PREFIX


class Value(NamedTuple):
    """A number or several, with their derivatives by the gains in the last axis."""

    value: np.ndarray
    slopes: np.ndarray


class Response(NamedTuple):
    """A response to sines over frequency.

    `value` is (f,), `slopes` (f, gains), and `by_frequency` (f,) the derivative by the angular frequency.
    """

    value: np.ndarray
    slopes: np.ndarray
    by_frequency: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class GainModel:
    """The linear model of a contact mode, and how it changes with the gains.

        A(p) = df/dx at x0(p),    dA/dp = derivative along (dx0/dp, 1),    F(x0(p), p) = 0

    so that an operating point which moves with the gains is accounted for. B, C and D likewise. States are over
    their nominal sizes.

    Attributes
    ----------
    gains, given, seen : tuple of str
        Parameters, inputs and outputs (or states) by name.
    a, b, c, d : ndarray
        The model.
    slopes : tuple of ndarray
        Derivatives of the four, the gains in the first axis.
    """

    gains: tuple[str, ...]
    given: tuple[str, ...]
    seen: tuple[str, ...]
    a: np.ndarray = field(repr=False)
    b: np.ndarray = field(repr=False)
    c: np.ndarray = field(repr=False)
    d: np.ndarray = field(repr=False)
    slopes: tuple[np.ndarray, ...] = field(repr=False)

    @cached_property
    def stable(self) -> bool:
        """Whether no pole lies in the right half plane, but for rounding."""
        poles = np.linalg.eigvals(self.a)
        return bool((poles.real <= 1e-9 * abs(poles).max()).all())

    def highest(self, at: str | None = None) -> float:  # noqa: ARG002 - asked as SampledGainModel is
        """The highest frequency at which there is a response [rad/s]: no limit in continuous time."""
        return math.inf

    def spacing(self, step: float) -> float:
        """The step of time next to this one at which there is a step response [s]: any."""
        return step

    def responses(self, given: str, seen: str, frequencies: np.ndarray) -> np.ndarray:
        """Response of one output to sines of one input, at frequencies [rad/s], without derivatives."""
        table = self._tables.get(frequencies.tobytes())
        if table is None:
            s = 1j * frequencies[:, None, None]
            table = self.c @ np.linalg.solve(s * np.eye(len(self.a)) - self.a, self.b + 0j) + self.d
            self._tables[frequencies.tobytes()] = table
        return table[:, self.seen.index(seen), self.given.index(given)]

    @cached_property
    def _tables(self) -> dict[bytes, np.ndarray]:
        """All responses, (f, seen, given), by frequencies."""
        return {}

    def loops(self, at: str, frequencies: np.ndarray) -> np.ndarray:
        """Loop transfer with the loop opened at a named signal, without derivatives."""
        closed = self.responses(PREFIX + at, at, frequencies)
        return -closed / (1 + closed)

    def response(self, given: str, seen: str, frequencies: np.ndarray | Sequence[float]) -> Response:
        """Response of one output to sines of one input [rad/s]."""
        k, i = self.given.index(given), self.seen.index(seen)
        s = 1j * np.asarray(frequencies, float)
        da, db, dc, dd = self.slopes
        shifted = s[:, None, None] * np.eye(len(self.a)) - self.a
        right = np.linalg.solve(shifted, self.b[None, :, k, None] + 0j)[..., 0]  # (f, n) both
        left = np.linalg.solve(np.swapaxes(shifted, 1, 2), self.c[None, i, :, None] + 0j)[..., 0]
        value = right @ self.c[i] + self.d[i, k]
        slopes = right @ dc[:, i].T + ((left @ da) * right).sum(axis=2).T + left @ db[:, :, k].T + dd[:, i, k]
        return Response(value, slopes, -1j * (left * right).sum(axis=1))

    def loop(self, at: str, frequencies: np.ndarray | Sequence[float]) -> Response:
        """Loop transfer with the loop opened at a named signal, as `loop_transfer`: L = -T/(1 + T).

        T is the response of the signal as computed to what is added to it, all loops closed.
        """
        closed = self.response(PREFIX + at, at, frequencies)
        factor = -1 / (1 + closed.value) ** 2
        return Response(
            -closed.value / (1 + closed.value), factor[:, None] * closed.slopes, factor * closed.by_frequency
        )

    def steps(self, given: str, seen: str, step: float, count: int) -> np.ndarray:
        """Step response at 0, step, 2 step, ..., (count,)."""
        return (
            self._over_steps(given, step, count)[:, : len(self.a)] @ self.c[self.seen.index(seen)]
            + (self.d[self.seen.index(seen), self.given.index(given)])
        )

    def step_at(self, given: str, seen: str, time: float) -> Value:
        """Step response at one time [s] with its derivatives."""
        k, i = self.given.index(given), self.seen.index(seen)
        da, db, dc, dd = self.slopes
        whole, n = self._augmented(given) * time, len(self.a)
        state = np.asarray(expm(whole))[:n, n]
        slopes = np.empty(len(self.gains))
        for g in range(len(self.gains)):
            direction = np.zeros_like(whole)
            direction[:n, :n], direction[:n, n] = da[g], db[g, :, k]
            changed = np.asarray(expm_frechet(whole, direction * time, compute_expm=False))[:n, n]
            slopes[g] = dc[g, i] @ state + self.c[i] @ changed + dd[g, i, k]
        return Value(np.asarray(self.c[i] @ state + self.d[i, k]), slopes)

    def _augmented(self, given: str) -> np.ndarray:
        """[A b; 0 0], whose exponential holds the step response."""
        n = len(self.a)
        whole = np.zeros((n + 1, n + 1))
        whole[:n, :n], whole[:n, n] = self.a, self.b[:, self.given.index(given)]
        return whole

    def _over_steps(self, given: str, step: float, count: int) -> np.ndarray:
        once = expm(self._augmented(given) * step)
        states = np.zeros((count, len(once)))
        states[0, -1] = 1.0
        for k in range(1, count):
            states[k] = once @ states[k - 1]
        return states


def gain_model(
    point: OperatingPoint,
    gains: Sequence[str],
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    resting: OperatingPoint | None = None,
) -> GainModel:
    """Linear model of the point's contact mode with its derivatives by named parameters.

    Parameters
    ----------
    point : OperatingPoint
        From `trim`.
    gains, inputs, outputs : sequence of str
        Names; an output may also be a state.
    resting : OperatingPoint or None
        What the point moves with, where it is none of rest itself: a mesh in its gap.

    Raises
    ------
    ValueError
        For a sampled controller, which `sampled_gain_model` takes, and for sensors that count.
    """
    system = point.system
    if system.clocks:
        raise ValueError(
            f"{system.name}: gain_model takes controllers in continuous time; sampled_gain_model is for the others"
        )
    require_smooth(system)
    where, picked = indices_of(system, gains, inputs, outputs)
    scale = np.array([quantity.nominal for quantity in system.states])
    (a, b, c, d), slopes = flow_slopes(point, where, picked, point_sensitivity(resting or point, where), scale)
    return GainModel(
        gains=tuple(gains), given=tuple(inputs), seen=tuple(outputs), a=a, b=b, c=c, d=d, slopes=tuple(slopes)
    )
