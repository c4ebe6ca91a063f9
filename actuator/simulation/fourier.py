"""Fundamental and harmonics of a signal over whole periods."""

import numpy as np

WHOLE = 1e-6  # part of the time within which periods are whole


def fourier_coefficients(time: np.ndarray, values: np.ndarray, frequency: float, harmonics: int) -> np.ndarray:
    """Complex amplitudes c[k] of a signal over whole periods, from its mean to its last harmonic.

        values = c[0] + sum over k >= 1 of Re(c[k] exp(j 2 pi k frequency time))

    Parameters
    ----------
    time : ndarray, (n,)
        Over a whole number of periods, both ends included [s].
    values : ndarray, (signals, n)
        At these times.
    frequency : float
        [Hz].
    harmonics : int
        How many, with the fundamental.

    Returns
    -------
    ndarray of complex, (signals, 1 + harmonics)
        By the trapezoidal rule, which on even points is exact for as many harmonics as half of them.

    Raises
    ------
    ValueError
        Where the time is not a whole number of periods.
    """
    length = time[-1] - time[0]
    periods = length * frequency
    if round(periods) < 1 or abs(periods - round(periods)) > WHOLE * periods:
        raise ValueError(
            f"fourier_coefficients needs whole periods of {frequency:g} Hz, got {length:g} s, {periods:.9g} of them"
        )
    order = np.arange(harmonics + 1)
    waves = np.exp(-2j * np.pi * frequency * order[:, None] * time)
    sums = np.trapezoid(values[:, None, :] * waves, time, axis=-1) / length
    return sums * np.where(order == 0, 1, 2)
