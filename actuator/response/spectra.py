"""Frequency responses from records of reference and response: measured ones, a chirp, a multisine; with coherence.

From one run instead of one per sine: faster, and blunter. What is not linear shows as a coherence below one.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import control
import numpy as np
from scipy import signal

from actuator.actuator import Actuator
from actuator.simulation.fourier import fourier_coefficients
from actuator.simulation.run import Run
from actuator.simulation.signals import Chirp, Sine, Sum
from actuator.simulation.simulate import simulate
from actuator.stiction.standstill import rest_state
from actuator.system.hybrid import HybridSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OVERLAP = 0.75  # of two segments
PER_PERIOD = 40  # samples of the fastest period
FEWEST = 3  # segments, below which coherence is one whatever happens
UNEVEN = 1e-3  # part of a step by which steps of time may differ and still be rounding


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """A frequency response from one or several records.

    Attributes
    ----------
    frequencies : ndarray
        [Hz].
    response : ndarray of complex
        Output over input, estimated by their cross spectrum over the input's own spectrum.
    coherence : ndarray
        Part of the output that follows the input linearly [-], 0 to 1.
    label : str
        What it is, for legends.
    """

    frequencies: np.ndarray = field(repr=False)
    response: np.ndarray = field(repr=False)
    coherence: np.ndarray = field(repr=False)
    label: str

    def frd(self) -> control.FrequencyResponseData:
        """As python-control has it, over rad/s."""
        return control.FrequencyResponseData(self.response, 2 * np.pi * self.frequencies)

    def plot(self) -> "Figure":
        """Gain, phase and coherence."""
        from actuator.plots.response import plot_spectrum

        return plot_spectrum(self)


@dataclass(frozen=True, kw_only=True)
class Record:
    """Reference and response over time, measured or simulated.

    Attributes
    ----------
    time, reference, response : ndarray, (n,)
        Time [s]; the others in units of their own.
    label : str
        What it is, for legends.
    """

    time: np.ndarray = field(repr=False)
    reference: np.ndarray = field(repr=False)
    response: np.ndarray = field(repr=False)
    label: str

    def spectrum(self, lowest: float, highest: float) -> Spectrum:
        """Frequency response by averaged spectra, two periods of the lowest frequency [Hz] to a segment.

            response = S_ry / S_rr,    coherence = |S_ry|^2 / (S_rr S_yy)

        Raises
        ------
        ValueError
            Where the record is too short for three segments, or too coarse for the highest frequency.
        """
        step, (reference, response) = self._even()
        segment = round(2 / lowest / step)
        if len(reference) < segment * (1 + (FEWEST - 1) * (1 - OVERLAP)):
            raise ValueError(
                f"{self.label}: a record of {len(reference) * step:.4g} s has fewer than {FEWEST} segments of two "
                f"periods of {lowest:g} Hz; make it longer, or the lowest frequency higher"
            )
        if highest * step > 1 / 2:
            raise ValueError(f"{self.label}: steps of {step:.4g} s are too long for {highest:g} Hz; sample faster")
        law = {"fs": 1 / step, "nperseg": segment, "noverlap": int(OVERLAP * segment), "detrend": "linear"}
        frequencies, cross = signal.csd(reference, response, **law)
        own = signal.welch(reference, **law)[1]
        coherence = signal.coherence(reference, response, **law)[1]
        kept = (frequencies >= lowest) & (frequencies <= highest)
        return Spectrum(
            frequencies=frequencies[kept],
            response=cross[kept] / own[kept],
            coherence=coherence[kept],
            label=self.label,
        )

    def sine(self, frequency: float, *, periods: int = 3, harmonics: int = 7) -> np.ndarray:
        """Mean, fundamental and harmonics of the response over the last periods of a sine [Hz], over the reference's.

        The analysis is that of the sine stream: the phase is counted from the reference, the fundamental is divided by
        that of the reference, and the mean and the harmonics by its size.

        Raises
        ------
        ValueError
            Where the record is shorter than that.
        """
        end = self.time[-1]
        start = end - periods / frequency
        if start < self.time[0] - UNEVEN / frequency:
            raise ValueError(
                f"{self.label}: a record of {end - self.time[0]:.4g} s has no {periods} periods of {frequency:g} Hz"
            )
        grid = np.linspace(start, end, 1 + periods * 10 * PER_PERIOD)
        values = np.array([np.interp(grid, self.time, values) for values in (self.reference, self.response)])
        reference, response = fourier_coefficients(grid - start, values, frequency, harmonics)
        turned = np.exp(-1j * np.angle(reference[1]) * np.arange(harmonics + 1))
        return response * turned / abs(reference[1])

    def _even(self) -> tuple[float, np.ndarray]:
        """Both signals on even steps of time."""
        steps = np.diff(self.time)
        if np.ptp(steps) <= UNEVEN * steps.mean():
            return float(steps.mean()), np.array([self.reference, self.response])
        step = float(np.median(steps))
        grid = np.arange(self.time[0], self.time[-1], step)
        return step, np.array([np.interp(grid, self.time, values) for values in (self.reference, self.response)])


def read_record(
    path: str | Path, *, time: str = "time", reference: str = "reference", response: str = "response"
) -> Record:
    """A measured record from a CSV file with a line of names, and time in seconds.

    Parameters
    ----------
    path : str or Path
        Of the file.
    time, reference, response : str
        Names of the columns.

    Raises
    ------
    ValueError
        For a column that is not there, a field that is no number, or time that does not increase; with the line.
    """
    path, names = Path(path), (time, reference, response)
    with path.open(newline="", encoding="utf-8-sig") as lines:
        table = csv.DictReader(lines)
        missing = [name for name in names if name not in (table.fieldnames or [])]
        if missing:
            there = ", ".join(table.fieldnames or [])
            raise ValueError(f"{path}: no column {', '.join(missing)}; there are {there or 'none'}")
        rows = []
        for line in table:
            try:
                rows.append([float(line[name]) for name in names])
            except (TypeError, ValueError):
                shown = ", ".join(str(line[name]) for name in names)
                raise ValueError(f"{path}: line {table.line_num} needs three numbers, got {shown}") from None
    values = np.array(rows).reshape(-1, 3).T
    late = np.flatnonzero(np.diff(values[0]) <= 0)
    if values.shape[1] < FEWEST or late.size:
        where = f"does not increase after {values[0][late[0]]:g} s" if late.size else "has fewer than three values"
        raise ValueError(f"{path}: {time} {where}")
    return Record(time=values[0], reference=values[1], response=values[2], label=path.stem)


def chirp_response(  # noqa: PLR0913 - a sweep has this many numbers
    plant: Actuator | HybridSystem,
    *,
    amplitude: float,
    lowest: float,
    highest: float,
    duration: float,
    given: str = "reference",
    seen: str = "load_angle",
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Spectrum:
    """Frequency response from a sine whose frequency runs linearly from the lowest to the highest [Hz].

    Faster than a stream of sines, and blunter: what the actuator does at one frequency still rings at the next, and
    harmonics count as noise, which the coherence shows. `duration` in [s]; other parameters as for
    `frequency_response`.
    """
    offset = dict(inputs or {}).get(given, 0.0)
    wave = Chirp(amplitude=amplitude, first_frequency=lowest, last_frequency=highest, duration=duration, offset=offset)
    run = _simulate(plant, duration, {**(inputs or {}), given: wave}, dict(inputs or {}), parameters, highest)
    record = Record(
        time=run.t, reference=run[given], response=run[seen], label=f"chirp, {amplitude:.3g} {run.units[given]}"
    )
    return record.spectrum(lowest, highest)


def multisine_response(  # noqa: PLR0913 - a multisine has this many numbers
    plant: Actuator | HybridSystem,
    *,
    amplitude: float,
    lowest: float,
    lines: Sequence[int],
    realizations: int = 4,
    settling: int = 1,
    seed: int = 0,
    given: str = "reference",
    seen: str = "load_angle",
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Spectrum:
    """Frequency response from many sines at once, each with its own random phase, anew in every realization.

    What does not follow the input linearly differs from realization to realization, so that the mean over them is the
    best linear approximation and the coherence says how good it is.

    Parameters
    ----------
    amplitude : float
        Root mean square, in the unit of the input.
    lowest : float
        Of which all frequencies are whole multiples [Hz].
    lines : sequence of int
        The multiples, ascending.
    realizations, settling : int
        Records, and periods before each of them, at least one.
    seed : int
        Of the phases.
    plant, given, seen, inputs, parameters
        As for `frequency_response`.

    References
    ----------
    Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. 2012, chapter 4.
    """
    if realizations < 2:  # noqa: PLR2004 - there is no coherence of one
        raise ValueError(f"multisine_response needs at least two realizations for a coherence, got {realizations}")
    random = np.random.default_rng(seed)
    each = amplitude * np.sqrt(2 / len(lines))
    offset = dict(inputs or {}).get(given, 0.0)
    spectra, unit = [], ""
    for _ in range(realizations):
        waves = tuple(
            Sine(amplitude=each, frequency=k * lowest, phase=phase, offset=offset / len(lines))
            for k, phase in zip(lines, random.uniform(0, 2 * np.pi, len(lines)), strict=True)
        )
        signals = {**(inputs or {}), given: Sum(parts=waves)}
        run = _simulate(plant, settling / lowest, signals, dict(inputs or {}), parameters, lines[-1] * lowest)
        # after whole periods the input begins again
        run = _simulate(plant, 1 / lowest, signals, dict(inputs or {}), parameters, lines[-1] * lowest, run.state())
        unit = run.units[given]
        spectra.append(
            fourier_coefficients(run.t, np.array([run[given], run[seen]]), lowest, lines[-1])[:, list(lines)]
        )
    reference, response = np.array(spectra).transpose(1, 0, 2)
    cross = (response * reference.conj()).sum(axis=0)
    own, other = (abs(reference) ** 2).sum(axis=0), (abs(response) ** 2).sum(axis=0)
    return Spectrum(
        frequencies=lowest * np.array(lines, float),
        response=cross / own,
        coherence=abs(cross) ** 2 / np.maximum(own * other, np.finfo(float).tiny),
        label=f"multisine, {amplitude:.3g} {unit} rms",
    )


def _simulate(  # noqa: PLR0913 - as those above
    plant: Actuator | HybridSystem,
    duration: float,
    inputs: Mapping,
    constant: Mapping[str, float],
    parameters: Mapping[str, float] | None,
    highest: float,
    start: Mapping[str, float] | None = None,
) -> Run:
    """From a state, or from rest where there is one."""
    start = rest_state(plant, constant, parameters) if start is None else start
    return simulate(
        plant, duration, inputs=inputs, start=start, parameters=parameters, resolution=1 / (PER_PERIOD * highest)
    )
