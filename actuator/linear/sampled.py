"""Linear models of sampled control: what happens from tick to tick is exact, delays and holds are states.

Between ticks what is held is constant, and the rest moves by the matrix exponential; a tick is a linear map:

    x(k+) = Tx x(k) + Tu u(k),     x(k+1) = Phi x(k+) + Gamma u(k)
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import expm

from actuator.actuator import Actuator
from actuator.linear.jacobians import jacobians, require_smooth, tick_jacobians
from actuator.linear.operating_point import OperatingPoint
from gear.quantities import require_known


def without_quantization(actuator: Actuator) -> Actuator:
    """The same actuator with sensors that read between their counts, and without noise; delays and errors stay."""
    return replace(actuator, sensors=actuator.sensors.with_each(resolution=None, noise=None))


def lift(point: OperatingPoint, columns: Sequence[int], rows: Sequence[int], every: int) -> tuple[np.ndarray, ...]:
    """A, B, C, D over the ticks after which all clocks are due again.

    Inputs are constant over `every` ticks, outputs are those just after the first of them; where that is not the whole
    time, inputs and outputs come several times, first all of the first part, then all of the next.
    """
    a, b, c, d = jacobians(point)
    b, c, d = b[:, columns], c[rows], d[np.ix_(rows, columns)]
    n, k, ticks = len(a), len(columns), point.system.hyperperiod
    step = expm(np.block([[a, b], [np.zeros((k, n + k))]]) * point.system.tick_period(point.p))
    transition, driven = step[:n, :n], step[:n, n:]
    parts = ticks // every
    state, forced = np.eye(n), np.zeros((n, parts * k))  # of the present state, by that at the start and by the inputs
    seen, through = [], []
    for tick in range(ticks):
        part = slice(tick // every * k, (tick // every + 1) * k)
        by_state, by_input = tick_jacobians(point, tick)
        state, forced = by_state @ state, by_state @ forced
        forced[:, part] += by_input[:, columns]
        if tick % every == 0:
            seen.append(c @ state)
            through.append(c @ forced)
            through[-1][:, part] += d
        state, forced = transition @ state, transition @ forced
        forced[:, part] += driven
    return state, forced, np.vstack(seen), np.vstack(through)


def harmonic_response(
    point: OperatingPoint, inputs: Sequence[str], outputs: Sequence[str], frequencies: np.ndarray
) -> np.ndarray:
    """What a sine analyzer sees of sampled control: the fundamental of outputs over that of continuous inputs.

    In the frame that turns with the input, v = exp(-j w t) x, a settled response repeats with all clocks:

        v' = (A - j w) v + B,     v+ = Tx v + Tu  at the ticks,     y = mean of C v + D

    Other than with `linearize`, the inputs are sines at all times, and all frequencies [rad/s] are allowed, those above
    half the sampling rate too.

    Returns
    -------
    ndarray, (outputs, inputs, frequencies)

    Raises
    ------
    ValueError
        Without sampled control, where `linearize` has the response; or for sensors that count or are noisy.
    """
    system = point.system
    if not system.clocks:
        raise ValueError(f"{system.name}: harmonic_response is for sampled control; linearize has the response")
    require_smooth(system)
    input_names = [quantity.name for quantity in system.inputs]
    output_names = [quantity.name for quantity in (*system.outputs, *system.states)]
    require_known(inputs, input_names, "input")
    require_known(outputs, output_names, "output")
    columns, rows = [input_names.index(i) for i in inputs], [output_names.index(o) for o in outputs]
    a, b, c, d = jacobians(point)
    b, c, d = b[:, columns], c[rows], d[np.ix_(rows, columns)]
    ticks, period = system.hyperperiod, system.tick_period(point.p)
    maps = [tick_jacobians(point, tick) for tick in range(ticks)]
    found = np.empty((len(rows), len(columns), len(frequencies)), complex)
    n, k = len(a), len(columns)
    for i, frequency in enumerate(frequencies):
        # (v, 1, integral of C v)
        flow = np.zeros((n + k + len(rows),) * 2, complex)
        flow[:n] = np.hstack([a - 1j * frequency * np.eye(n), b, np.zeros((n, len(rows)))])
        flow[n + k :, :n] = c
        step = expm(flow * period)
        transition, driven = step[:n, :n], step[:n, n : n + k]
        state, forced = np.eye(n, dtype=complex), np.zeros((n, k), complex)
        seen, through = np.zeros((len(rows), n), complex), np.zeros((len(rows), k), complex)
        for by_state, by_input in maps:
            state, forced = by_state @ state, by_state @ forced + by_input[:, columns]
            seen += step[n + k :, :n] @ state
            through += step[n + k :, :n] @ forced + step[n + k :, n : n + k]
            state, forced = transition @ state, transition @ forced + driven
        start = np.linalg.lstsq(np.eye(n) - state, forced)[0]  # what is locked is anywhere
        found[:, :, i] = (seen @ start + through) / (ticks * period) + d
    return found
