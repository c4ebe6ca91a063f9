"""Describing functions of friction, backlash and whole gear stages; the cycle they predict, and whether to trust it.

For a sine of amplitude A at the input of a nonlinearity, the describing function is the ratio of the first harmonic of
its output to the input, N(A, w). With the linear part L of the loop in negative feedback a cycle is predicted where

    L(j w) N(A, w) = -1

and it is stable where -1/N, followed towards larger amplitudes, leaves the region that the curve L encircles. The
prediction assumes that L attenuates the higher harmonics; their size at the nonlinearity's input says whether it does.

References
----------
A. Gelb, W. E. Vander Velde, "Multiple-Input Describing Functions and Nonlinear System Design" (1968), chapters 2 and 3;
control.descfcn for the analytic functions of backlash and relays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import control
import numpy as np
from scipy.optimize import least_squares

from actuator.actuator import Actuator
from actuator.simulation.fourier import fourier_coefficients
from actuator.simulation.run import Run
from actuator.simulation.signals import Constant, Sine, Sum
from actuator.simulation.simulate import simulate

HARMONICS = 9
TRUSTED = 0.2  # higher harmonics at the input, over the first, up to which a prediction is to be trusted
POINTS = 2000  # output points of a period
SETTLING = 4  # periods before the one that is looked at

Describing = Callable[[float, float], complex]  # of amplitude and angular frequency


def coulomb_friction(coulomb: float) -> Describing:
    """Of the friction torque over the speed: N = 4 coulomb / (pi A), A in rad/s; python-control's relay."""
    relay = control.relay_hysteresis_nonlinearity(coulomb, 0.0)
    return lambda amplitude, frequency: complex(control.describing_function(relay, amplitude))


def backlash(gap: float) -> Describing:
    """Of a gap on an output without inertia of its own, which stays where it is left; python-control's."""
    law = control.friction_backlash_nonlinearity(gap)
    return lambda amplitude, frequency: (
        complex(control.describing_function(law, amplitude)) if amplitude > gap / 2 else 0j
    )


def harmonics_of(time: np.ndarray, signal: np.ndarray, frequency: float) -> np.ndarray:
    """Complex amplitudes of the harmonics of a period, c_k in Im(c_k exp(j k w t)), (HARMONICS,)."""
    return 1j * fourier_coefficients(time - time[0], signal[None], frequency, HARMONICS)[0, 1:]


@dataclass(frozen=True, kw_only=True)
class StageResponse:
    """A gear's answer to a sine of motor torque.

    Attributes
    ----------
    amplitude, frequency, bias : float
        Of the motor torque [N m], [Hz]; load torque [N m].
    function : complex
        First harmonic of the load angle over that of the motor torque [rad/(N m)].
    distortion : float
        Higher harmonics of the load angle over the first, root of the sum of squares.
    """

    amplitude: float
    frequency: float
    bias: float
    function: complex
    distortion: float
    run: Run = field(repr=False)


def stage_response(  # noqa: PLR0913 - what the response depends on
    plant: Actuator,
    amplitude: float,
    frequency: float,
    *,
    output: str = "load_speed",
    load_torque: float = 0.0,
    offset: float = 0.0,
    compiled: bool | None = None,
) -> StageResponse:
    """Describing function of a complete gear by simulation with a sine of motor torque.

    Parameters
    ----------
    plant : Actuator
        Without a controller: motor torque is its input.
    amplitude, frequency : float
        Of the motor torque [N m], [Hz].
    output : str
        Whose first harmonic is taken; a speed, where positions drift.
    load_torque, offset : float
        Constant torques on load and motor [N m].
    compiled : bool or None
        As for `simulate`.

    Raises
    ------
    ValueError
        Where the actuator has a controller.
    """
    if plant.controller is not None:
        raise ValueError(f"stage_response: {plant.name} has a controller; give the gear with a TorqueSource and none")
    period = 1 / frequency
    torque = Sum(parts=(Constant(value=offset), Sine(amplitude=amplitude, frequency=frequency)))
    run = simulate(
        plant,
        (SETTLING + 1) * period,
        inputs={"torque_reference": torque, "load_torque": load_torque},
        resolution=period / POINTS,
        compiled=compiled,
    )
    last = run.t >= SETTLING * period * (1 - 1e-9)
    harmonics = harmonics_of(run.t[last], run[output][last], frequency)
    first = abs(harmonics[0])
    distortion = float(np.linalg.norm(harmonics[1:]) / first) if first > 0 else float("inf")
    function = complex(harmonics[0] / amplitude)
    return StageResponse(
        amplitude=amplitude, frequency=frequency, bias=load_torque, function=function, distortion=distortion, run=run
    )


@dataclass(frozen=True, kw_only=True)
class PredictedCycle:
    """A cycle that describing functions predict.

    Attributes
    ----------
    amplitude : float
        Of the sine at the nonlinearity's input.
    period : float
        [s].
    stable : bool
        By the rule of slopes.
    distortion : float
        Higher harmonics that come back to the nonlinearity's input, over the first.
    """

    amplitude: float
    period: float
    stable: bool
    distortion: float

    @property
    def trusted(self) -> bool:
        """Whether the harmonics that the method neglects are small."""
        return self.distortion < TRUSTED


def predict_cycles(
    loop: control.StateSpace,
    describing: Describing,
    amplitudes: Sequence[float] | np.ndarray,
    frequencies: Sequence[float] | np.ndarray,
    *,
    nonlinearity: Callable[[np.ndarray], np.ndarray] | None = None,
) -> list[PredictedCycle]:
    """Cycles of a linear loop around a nonlinearity, in negative feedback.

    Parameters
    ----------
    loop : control.StateSpace
        L, from the nonlinearity's output to minus its input.
    describing : callable
        N(amplitude, angular frequency).
    amplitudes, frequencies : array_like
        Grids on which solutions are bracketed; frequencies in rad/s.
    nonlinearity : callable or None
        Output over one period of input, for the harmonics; None for those of a square wave, the worst of relays.
    """
    found: list[PredictedCycle] = []
    grid = np.array([[_balance(loop, describing, a, w) for w in frequencies] for a in amplitudes])
    for i in range(len(amplitudes) - 1):
        for k in range(len(frequencies) - 1):
            corner = grid[i : i + 2, k : k + 2]
            if not (_straddles(np.real(corner)) and _straddles(np.imag(corner))):
                continue
            guess = np.log([(amplitudes[i] * amplitudes[i + 1]) ** 0.5, (frequencies[k] * frequencies[k + 1]) ** 0.5])
            solved = least_squares(
                lambda y: _pair(_balance(loop, describing, *np.exp(y))), guess, xtol=1e-14, ftol=1e-14
            )
            amplitude, frequency = (float(value) for value in np.exp(solved.x))
            inside = amplitudes[i] * 0.99 <= amplitude <= amplitudes[i + 1] * 1.01
            if solved.cost > 1e-16 or not inside:  # noqa: PLR2004 - a minimum that is no zero
                continue
            if any(
                np.isclose(amplitude, other.amplitude) and np.isclose(2 * np.pi / frequency, other.period)
                for other in found
            ):
                continue  # on the edge of two cells
            distortion = _distortion(loop, amplitude, frequency, nonlinearity)
            stable = _slopes(loop, describing, amplitude, frequency)
            found.append(
                PredictedCycle(amplitude=amplitude, period=2 * np.pi / frequency, stable=stable, distortion=distortion)
            )
    return found


def _balance(loop: control.StateSpace, describing: Describing, amplitude: float, frequency: float) -> complex:
    return complex(loop(1j * frequency)) * describing(amplitude, frequency) + 1


def _pair(value: complex) -> list[float]:
    return [value.real, value.imag]


def _straddles(values: np.ndarray) -> bool:
    return bool(values.min() <= 0 <= values.max())


def _slopes(loop: control.StateSpace, describing: Describing, amplitude: float, frequency: float) -> bool:
    """Loeb's rule: with F(A, w) = L N + 1, Re F_A Im F_w - Im F_A Re F_w > 0 means that a larger cycle decays."""
    step = 1e-4
    by_amplitude, by_frequency = (
        _balance(loop, describing, *up) - _balance(loop, describing, *down)
        for up, down in (
            ((amplitude * (1 + step), frequency), (amplitude * (1 - step), frequency)),
            ((amplitude, frequency * (1 + step)), (amplitude, frequency * (1 - step))),
        )
    )
    return bool((by_amplitude.conjugate() * by_frequency).imag > 0)


def _distortion(
    loop: control.StateSpace,
    amplitude: float,
    frequency: float,
    nonlinearity: Callable[[np.ndarray], np.ndarray] | None,
) -> float:
    """Higher harmonics at the input of the nonlinearity over the first, after one way round the loop."""
    time = np.linspace(0, 2 * np.pi / frequency, POINTS + 1)
    sine = amplitude * np.sin(frequency * time)
    answer = np.sign(sine) if nonlinearity is None else nonlinearity(sine)
    harmonics = harmonics_of(time, answer, frequency / (2 * np.pi))
    back = [abs(h * complex(loop(1j * k * frequency))) for k, h in enumerate(harmonics, start=1)]
    return float(np.linalg.norm(back[1:]) / back[0])
