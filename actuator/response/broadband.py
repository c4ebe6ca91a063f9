"""Frequency response from one run: a chirp or a multisine, with its coherence. Faster than sines, and blunter."""

from collections.abc import Mapping, Sequence

import numpy as np

from actuator.actuator import Actuator
from actuator.response.fourier import fourier
from actuator.response.record import PER_PERIOD, Record, Spectrum
from actuator.simulation.run import Run
from actuator.simulation.signals import Chirp, Sine, Sum
from actuator.simulation.simulate import simulate
from actuator.stiction.standstill import rest_of
from actuator.system.hybrid import HybridSystem


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
    run = _run(plant, duration, {**(inputs or {}), given: wave}, dict(inputs or {}), parameters, highest)
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
        run = _run(plant, settling / lowest, signals, dict(inputs or {}), parameters, lines[-1] * lowest)
        # after whole periods the input begins again
        run = _run(plant, 1 / lowest, signals, dict(inputs or {}), parameters, lines[-1] * lowest, run.state())
        unit = run.units[given]
        spectra.append(fourier(run.t, np.array([run[given], run[seen]]), lowest, lines[-1])[:, list(lines)])
    reference, response = np.array(spectra).transpose(1, 0, 2)
    cross = (response * reference.conj()).sum(axis=0)
    own, other = (abs(reference) ** 2).sum(axis=0), (abs(response) ** 2).sum(axis=0)
    return Spectrum(
        frequencies=lowest * np.array(lines, float),
        response=cross / own,
        coherence=abs(cross) ** 2 / np.maximum(own * other, np.finfo(float).tiny),
        label=f"multisine, {amplitude:.3g} {unit} rms",
    )


def _run(  # noqa: PLR0913 - as those above
    plant: Actuator | HybridSystem,
    duration: float,
    inputs: Mapping,
    constant: Mapping[str, float],
    parameters: Mapping[str, float] | None,
    highest: float,
    start: Mapping[str, float] | None = None,
) -> Run:
    """From a state, or from rest where there is one."""
    start = rest_of(plant, constant, parameters) if start is None else start
    return simulate(
        plant, duration, inputs=inputs, start=start, parameters=parameters, resolution=1 / (PER_PERIOD * highest)
    )
