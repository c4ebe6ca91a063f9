"""The model at a time and a state: inputs, flow, margins, Jacobian, all with the slip of stuck contacts taken out.

A contact that is stuck has no slip acceleration but for rounding, which would be integrated for as long as it holds. So
in each mode flow and Jacobian are multiplied by a projector onto the motions without slip, and the state is once, when
the mode is entered. A stuck contact holds for ever.
"""

import numpy as np

from actuator.engine.layout import (
    BOTH,
    DERIVED,
    EVALUATED,
    FLOOR,
    FLOW,
    JACOBIAN,
    MOVING,
    NOTHING,
    OFFSETS,
    PROJECTOR,
    RAW,
    SLIP,
    SLIP_FLANK,
    SLIP_MOTION,
    SLOPES,
    SQUARE,
    STEADY,
    STUCK,
    WAVE_AMPLITUDE,
    WAVE_FREQUENCY,
    WAVE_INPUT,
    WAVE_PHASE,
    WAVE_RATE,
    A,
    B,
    H,
    M,
    U,
)
from actuator.engine.memory import call, clear, copy, kernel, multiply, row, square, vec

DEPENDENT = 1e-8  # part of a slip direction that is left by the others, below which it is one of them
CLEAN = 1e-14  # entry of a projector that is rounding


@kernel
def inputs_at(w, t):
    """Inputs at a time in the piece: lines and sine waves."""
    u, offsets, slopes = vec(w, U), vec(w, OFFSETS), vec(w, SLOPES)
    for i in range(u.size):
        u[i] = offsets[i] + slopes[i] * t
    which = vec(w, WAVE_INPUT)
    if which.size:
        amplitude, phase = vec(w, WAVE_AMPLITUDE), vec(w, WAVE_PHASE)
        frequency, rate = vec(w, WAVE_FREQUENCY), vec(w, WAVE_RATE)
        for i in range(which.size):
            u[int(which[i])] += amplitude[i] * np.sin(phase[i] + t * (frequency[i] + rate[i] * t / 2))


@kernel
def flow(w, t, x, f):
    """The flow f at a time and state."""
    if not w[STEADY]:
        inputs_at(w, t)
    w[EVALUATED] += 1
    if w[STUCK]:
        call(w, FLOW, (x, vec(w, H), vec(w, U), vec(w, DERIVED), vec(w, RAW)))
        multiply(w, vec(w, PROJECTOR), vec(w, RAW), 1.0, vec(w, NOTHING), f)
    else:
        call(w, FLOW, (x, vec(w, H), vec(w, U), vec(w, DERIVED), f))


@kernel
def flow_and_margins(w, t, x, f, g):
    """The flow f and the margins g above their floor; returns the least of them."""
    if not w[STEADY]:
        inputs_at(w, t)
    w[EVALUATED] += 1
    if w[STUCK]:
        call(w, BOTH, (x, vec(w, H), vec(w, U), vec(w, DERIVED), vec(w, RAW), g))
        multiply(w, vec(w, PROJECTOR), vec(w, RAW), 1.0, vec(w, NOTHING), f)
    else:
        call(w, BOTH, (x, vec(w, H), vec(w, U), vec(w, DERIVED), f, g))
    floor, least = vec(w, FLOOR), np.inf
    for i in range(g.size):
        g[i] -= floor[i]
        least = min(least, g[i])
    return least


@kernel
def jacobian(w, t, x, matrix):
    """df/dx, by columns."""
    inputs_at(w, t)
    if w[STUCK]:
        call(w, JACOBIAN, (x, vec(w, H), vec(w, U), vec(w, DERIVED), vec(w, SQUARE)))
        product(w, square(w, PROJECTOR, 0, w[MOVING]), square(w, SQUARE, 0, w[MOVING]), matrix)
    else:
        call(w, JACOBIAN, (x, vec(w, H), vec(w, U), vec(w, DERIVED), matrix))


@kernel
def product(w, a, b, c):
    """The matrix c = a b; c is neither of them."""
    for j in range(w[MOVING]):
        multiply(w, a, b[j], 1.0, vec(w, NOTHING), c[j])


@kernel
def project_out_slip(w):
    """Make the projector of the present modes: I - S^T (S S^T)^-1 S of the slip rows S, by Gram and Schmidt."""
    n, modes, v = w[MOVING], vec(w, M), vec(w, A)
    p = square(w, PROJECTOR, 0, n)
    clear(vec(w, PROJECTOR))
    for i in range(n):
        p[i, i] = 1.0
    motion, flank = vec(w, SLIP_MOTION), vec(w, SLIP_FLANK)
    w[STUCK] = 0
    for k in range(motion.size):
        held = modes[int(motion[k])] == 0.0 and (flank[k] < 0.0 or modes[int(flank[k])] != 0.0)
        if not held:
            continue
        slip, whole, left = row(w, SLIP, k, n), 0.0, 0.0
        multiply(w, p, slip, 1.0, vec(w, NOTHING), v)
        for i in range(n):
            whole += slip[i] * slip[i]
            left += v[i] * v[i]
        if left > DEPENDENT**2 * whole:
            w[STUCK] += 1
            for j in range(n):
                for i in range(n):
                    p[j, i] -= v[i] * v[j] / left
    for j in range(n):
        for i in range(n):
            if abs(p[j, i]) < CLEAN:
                p[j, i] = 0.0


@kernel
def projected(w, x):
    """The state without slip of stuck contacts."""
    if w[STUCK]:
        copy(vec(w, B), x)
        multiply(w, vec(w, PROJECTOR), vec(w, B), 1.0, vec(w, NOTHING), x)
