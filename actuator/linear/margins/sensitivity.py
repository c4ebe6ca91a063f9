"""Responses with the loop closed: sensitivity, its complement, and compliance."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import control
import numpy as np

from actuator.linear.bode import CUT, FREQUENCIES, SLOW
from actuator.linear.loop import loop_transfer
from actuator.linear.model import linearize
from actuator.linear.operating_point import OperatingPoint


def sensitivity(point: OperatingPoint, at: str, *, drifting: Sequence[str] = ()) -> control.StateSpace:
    """S = 1/(1 + L) of the loop at a named signal: the signal as used over what is added to it.

    Parameters as for `loop_transfer`, and as many inputs and outputs.
    """
    loop = loop_transfer(point, at, drifting=drifting)
    return _feedback(loop, np.eye(loop.ninputs), 1.0, "used")


def complementary_sensitivity(point: OperatingPoint, at: str, *, drifting: Sequence[str] = ()) -> control.StateSpace:
    """T = L/(1 + L) = 1 - S of the loop at a named signal.

    Parameters as for `loop_transfer`.
    """
    loop = loop_transfer(point, at, drifting=drifting)
    return _feedback(loop, np.zeros((loop.ninputs,) * 2), -1.0, "complementary")


def _feedback(loop: control.StateSpace, direct: np.ndarray, sign: float, word: str) -> control.StateSpace:
    """`direct` - `sign` L/(1 + L)."""
    a, b, c, d = loop.A, loop.B, loop.C, loop.D
    through = np.linalg.inv(np.eye(len(d)) + d)
    return control.StateSpace(
        a - b @ through @ c,
        b @ through,
        -sign * through @ c,
        direct - sign * through @ d,
        loop.dt,
        states=loop.state_labels,
        inputs=loop.input_labels,
        outputs=[f"{name}_{word}" for name in loop.input_labels],
        remove_useless_states=False,
    )


def load_response(
    point: OperatingPoint, outputs: Sequence[str] = ("load_angle",), *, drifting: Sequence[str] = ()
) -> control.StateSpace:
    """Response of outputs to a torque on the output shaft, all loops closed: for the load angle, the compliance.

    Parameters as for `linearize`; in sampled control the torque is constant over a period, and `harmonic_response` has
    the one to sines.
    """
    return linearize(point, ["load_torque"], outputs, drifting=drifting)


FINER, POINTS = 3, 41  # times that a peak is sought on a finer grid, of so many points; odd: the best is one of them


class Peak(NamedTuple):
    """The largest of a response, and where [rad/s]: nan where it has no peak and is largest at an end."""

    value: float
    frequency: float


class Sensitivities(NamedTuple):
    """Sizes of S = 1/(1 + L) and T = L/(1 + L) over frequency [rad/s]; of several signals the largest gain."""

    frequencies: np.ndarray
    sensitivity: np.ndarray
    complementary: np.ndarray
    sensitivity_peak: Peak
    complementary_peak: Peak


def sensitivities(loop: control.StateSpace) -> Sensitivities | None:
    """S and T of a loop transfer; None where nothing passes: S is one and T zero.

    Parameters
    ----------
    loop : control.StateSpace
        In continuous or in discrete time, with as many outputs as inputs.
    """
    grid = grid_of(loop)
    if _sizes(values_of(loop, grid[grid > SLOW])).max() < CUT:
        return None

    def of_s(frequencies: np.ndarray) -> np.ndarray:
        return _sizes(_of_errors(loop, frequencies))

    def of_t(frequencies: np.ndarray) -> np.ndarray:
        return _sizes(np.eye(loop.ninputs) - _of_errors(loop, frequencies))

    return Sensitivities(grid, of_s(grid), of_t(grid), peak(of_s, grid), peak(of_t, grid))


def grid_of(model: control.StateSpace) -> np.ndarray:
    """Frequencies [rad/s] below half the sampling rate."""
    return FREQUENCIES[FREQUENCIES * float(model.dt or 0) < np.pi]


def values_of(model: control.StateSpace, frequencies: np.ndarray) -> np.ndarray:
    """Responses to sines, (f, outputs, inputs)."""
    point = np.exp(1j * frequencies * model.dt) if model.dt else 1j * frequencies
    values = np.asarray(model(point)).reshape(model.noutputs, model.ninputs, len(frequencies))
    return np.moveaxis(values, -1, 0)


def _of_errors(loop: control.StateSpace, frequencies: np.ndarray) -> np.ndarray:
    """1/(1 + L)."""
    return np.linalg.inv(np.eye(loop.ninputs) + values_of(loop, frequencies))


def _sizes(values: np.ndarray) -> np.ndarray:
    """Largest gain at each frequency."""
    return np.linalg.norm(values, 2, axis=(1, 2))


def peak(sizes: Callable[[np.ndarray], np.ndarray], grid: np.ndarray) -> Peak:
    """The largest size, sought ever finer between the neighbors of the best point of the grid."""
    first = sizes(grid)
    if int(first.argmax()) in (0, len(grid) - 1):
        return Peak(float(first.max()), math.nan)
    for _ in range(FINER):
        best = int(sizes(grid).argmax())
        grid = np.geomspace(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)], POINTS)
    values = sizes(grid)
    best = int(values.argmax())
    return Peak(float(values[best]), float(grid[best]))


def peak_of(model: control.StateSpace) -> Peak:
    """The largest gain of a response."""
    return peak(lambda frequencies: _sizes(values_of(model, frequencies)), grid_of(model))
