"""What happens at an event: all modes are decided, and the log gets a line.

The decision should leave every margin non-negative. Where several contacts are at their limits at once it is at the
mercy of rounding, and may not. Then, in this order: it is asked again, from the state alone, and with the margin that
it left below zero as one that fell; what is left down to
TOLERATED is taken for the new zero of those margins; the motion goes on for a moment, and it is asked anew.
"""

import numpy as np

from actuator.engine.evaluate import flow_and_margins, inputs_at
from actuator.engine.ladder import enter
from actuator.engine.layout import (
    AGAIN,
    BEGIN,
    EVENTS,
    F0,
    FALLEN,
    FAULT,
    FIRED,
    FLOOR,
    FRESH,
    G0,
    LOG_AFTER,
    LOG_BEFORE,
    LOG_FIRED,
    LOG_MODES,
    LOG_TIMES,
    MODES_AFTER,
    NUMBERS,
    PATIENCE,
    REPEATS,
    RESET,
    TOTAL,
    WAITING,
    WHOLE,
    WHOLE_AFTER,
    H,
    M,
    P,
    U,
    X,
)
from actuator.engine.locate import NEGATIVE
from actuator.engine.memory import call, clear, copy, kernel, row, vec

ATTEMPTS = 6  # of a decision; more never helped
FROM_STATE = 2  # of them from the state alone, before the margin that is below zero is told as fallen
TOLERATED = -1e-6  # margin that a decision may leave: rounding of what redundant contacts share
MOST_REPEATS = 20  # events at one instant: more mean that decision and margins disagree
MOST_PATIENCE = 25  # times that the moment is doubled, from 2e-13 s to 7e-6 s


@kernel
def switch(w, t):
    """Decide the modes where margin FALLEN fell, and log what changed; False for a jam."""
    real, modes = vec(w, NUMBERS), vec(w, M)
    k = w[EVENTS]
    kept = row(w, LOG_MODES, k, modes.size)
    before = row(w, LOG_BEFORE, k, vec(w, WHOLE).size)
    whole_state(w)
    copy(before, vec(w, WHOLE))
    copy(kept, modes)
    fallen = w[FALLEN]
    good = decide(w, t)
    changed = fallen >= 0
    for i in range(modes.size):
        changed = changed or kept[i] != modes[i]
    if changed:
        vec(w, LOG_TIMES)[k] = real[BEGIN] + t
        vec(w, LOG_FIRED)[k] = fallen
        whole_state(w)
        copy(row(w, LOG_AFTER, k, before.size), vec(w, WHOLE))
        copy(kept, modes)
        w[EVENTS] += 1
        w[TOTAL] += 1
    return good


@kernel
def decide(w, t):
    """Modes such that all margins hold, as nearly as can be had; False where there are none for too long."""
    floor, g0 = vec(w, FLOOR), vec(w, G0)
    for attempt in range(ATTEMPTS):
        clear(floor)
        consistent = reset(w, t)
        least = flow_and_margins(w, t, vec(w, X), vec(w, F0), g0)
        w[FRESH] = 1
        if consistent and least >= NEGATIVE and w[REPEATS] <= MOST_REPEATS:
            w[PATIENCE] = 0
            return True
        if not consistent or least >= NEGATIVE:
            break
        w[FALLEN] = -1
        if attempt >= FROM_STATE:
            for i in range(g0.size):
                if g0[i] == least:
                    w[FALLEN] = i
        w[AGAIN] += 1
    for i in range(floor.size):
        floor[i] = min(g0[i], 0.0)
        g0[i] -= floor[i]
    if least >= TOLERATED and vec(w, FAULT)[0] == 0.0 and w[REPEATS] <= MOST_REPEATS:
        w[PATIENCE] = 0
        return True
    w[PATIENCE] += 1
    w[WAITING] = 1
    return w[PATIENCE] <= MOST_PATIENCE


@kernel
def reset(w, t):
    """The system's own decision; whether it found consistent modes."""
    flags, x, modes, after, decided = vec(w, FIRED), vec(w, X), vec(w, M), vec(w, WHOLE_AFTER), vec(w, MODES_AFTER)
    clear(flags)
    if w[FALLEN] >= 0:
        flags[w[FALLEN]] = 1.0
    whole_state(w)
    inputs_at(w, t)
    call(w, RESET, (flags, vec(w, WHOLE), modes, vec(w, U), vec(w, P), after, decided, vec(w, FAULT)))
    copy(x, after)
    for i in range(modes.size):
        modes[i] = np.floor(decided[i] + 0.5)
    enter(w, t)
    return vec(w, FAULT)[0] < 0.5  # noqa: PLR2004 - it is 0 or 1


@kernel
def whole_state(w):
    """Moving and held states in one vector."""
    whole, x, h = vec(w, WHOLE), vec(w, X), vec(w, H)
    for i in range(x.size):
        whole[i] = x[i]
    for i in range(h.size):
        whole[x.size + i] = h[i]
