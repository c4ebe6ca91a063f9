"""The method: propose a step, look at its middle, accept it or go on more finely, stop at events, run ticks.

while there is time left:
    propose    a step: exponential, with the linear part of the mode
    check      its error and its bend; too large: the linear part anew, or a shorter step
    locate     a margin that falls below zero in it; then decide the modes there
    accept     otherwise, and lengthen the next one as far as the errors allow
"""

from actuator.engine.decide import switch, whole_state
from actuator.engine.evaluate import flow_and_margins, inputs_at
from actuator.engine.ladder import enter, refresh
from actuator.engine.layout import (
    ARRIVED,
    BEGIN,
    BY_ENDS,
    CHANGED,
    CROWD_TIME,
    CURVED,
    DEEPEST,
    DUE,
    E2,
    E2_BEFORE,
    END,
    EVENT_TIME,
    EVENTS,
    EVERY,
    F0,
    F1,
    FALLEN,
    FAULT,
    FIRST,
    FOOT,
    FRESH,
    G0,
    GE,
    GP,
    HALT,
    LADDER,
    NEXT,
    NOMINAL,
    NUMBERS,
    OUT_MODES,
    OUT_STATES,
    OUT_TIMES,
    PATIENCE,
    PAUSE,
    PERIOD,
    REPEATS,
    ROOM,
    RUNG,
    RUNGS,
    SEEN,
    SIZES,
    STEP_BEFORE,
    STEPS,
    TICK,
    TIME,
    TOP,
    TOTAL,
    WAITING,
    WHOLE,
    WHOLE_AFTER,
    XE,
    XP,
    B,
    H,
    M,
    P,
    U,
    X,
)
from actuator.engine.locate import at, curve_at, falls, is_quintic, nearer, root
from actuator.engine.memory import call, copy, entry, kernel, row, vec
from actuator.engine.step import small_step, whole_step

CONTINUE, START, RESTART = range(3)  # how `run` begins
DONE, PAUSED, JAMMED, CHATTERS, GROWN, STALLED = range(6)  # how `run` comes back

SHORTEST = 1e-13  # s; a step this short is accepted as it is
FITS = 1e-9  # part of a step by which it may miss a tick or the end: times are rounded
ROUNDING = 4e-16  # part of a time that is none
ON_TIME = 1e-9  # part of a period within which an instant is that of a tick
BOUND = 1e12  # times its nominal size: a state beyond it has left all bounds
MOMENT = 1e-13  # s, the first wait where modes could not be decided
CROWD, CROWDED = 500, 1e-8  # so many events within so many seconds are no mechanism
SHORTER_BEND, SHORTER_ERROR = 64.0, 8.0  # what half the step makes of them: sixth and third order
LONGER = 0.9  # part of what is allowed that is aimed at
MOST_SHORTER, MOST_LONGER = 4, 3  # rungs at once


@entry("int64(int64[::1], int64)")
def run(w, stage):
    """One piece of the inputs, from its BEGIN: stage CONTINUE goes on where it paused.

    START decides the modes first, from the state and what the modes were; RESTART takes them as given.
    """
    if stage != CONTINUE:
        inputs_at(w, 0.0)
        if stage == RESTART:
            enter(w, 0.0)
        elif not decided(w, 0.0) or vec(w, FAULT)[0] != 0.0:
            return JAMMED
    return run_piece(w)


@kernel
def decided(w, t):
    """`switch` where no margin fell: from the state alone."""
    w[FALLEN] = -1
    return switch(w, t)


@kernel
def run_piece(w):
    """To the end of the piece of the inputs, from tick to tick; how it ended. PAUSED: call it again."""
    real = vec(w, NUMBERS)
    while True:
        due = real[PERIOD] * w[NEXT] - real[BEGIN]
        if due <= real[TIME] + ON_TIME * real[PERIOD] and due < real[END] - ON_TIME * real[PERIOD]:
            if not tick(w):
                return JAMMED
            due = real[PERIOD] * w[NEXT] - real[BEGIN]
        stop = due if due < real[END] - ON_TIME * real[PERIOD] else real[END]
        status = advance(w, stop)
        if status != DONE:
            return status
        real[TIME] = stop
        if stop == real[END]:
            return DONE


@kernel
def tick(w):
    """All laws that are due run once, and what that does to the contacts is decided; False for a jam."""
    due, every, h, after = vec(w, DUE), vec(w, EVERY), vec(w, H), vec(w, WHOLE_AFTER)
    for c in range(due.size):
        due[c] = 1.0 if w[NEXT] % int(every[c]) == 0 else 0.0
    w[NEXT] += 1
    w[CURVED] = 0
    t, x = vec(w, NUMBERS)[TIME], vec(w, X)
    whole_state(w)
    inputs_at(w, t)
    call(w, TICK, (due, vec(w, WHOLE), vec(w, M), vec(w, U), vec(w, P), after))
    copy(x, after)
    for i in range(h.size):
        h[i] = after[x.size + i]
    least = flow_and_margins(w, t, x, vec(w, F0), vec(w, G0))
    w[FRESH] = 1
    return decided(w, t) if least < 0.0 else True


@kernel
def advance(w, stop):  # noqa: PLR0912 - the method, from top to bottom
    """From the present time to another one within the piece, through all events between."""
    real, sizes = vec(w, NUMBERS), vec(w, SIZES)
    while stop - real[TIME] > ROUNDING * abs(stop):
        if w[STEPS] >= w[PAUSE] or w[EVENTS] >= w[ROOM] - 1 or real[TIME] >= real[HALT]:
            return PAUSED
        t, foot = real[TIME], int(vec(w, FOOT)[w[LADDER]])
        # propose
        k, s = choose(w, stop - t, foot)
        whole = s == sizes[k] and k < RUNGS
        error, bend = whole_step(w, t, k) if whole else small_step(w, t, s)
        # check
        if error < 0.0:  # nothing is believed any more: once more
            continue
        if s > SHORTEST and not w[WAITING] and not (error <= 1.0 and bend <= 1.0):
            w[RUNG] = k
            if error <= 1.0 or not refresh(w, t):
                w[RUNG] = min(k + shorter(error, bend), DEEPEST)
            continue
        status = watch(w)
        if status != DONE:
            return status
        # locate
        high = falls(w, t, s)
        if high > 0.0 and not w[WAITING]:
            w[BY_ENDS] = whole and is_quintic(w, t, s)
            if not w[BY_ENDS] and whole and k < foot:
                w[RUNG] = nearer(w, t, s, k, foot, high)
                continue
            status = event(w, t, s, high)
            if status != DONE:
                return status
            continue
        # accept
        show(w, t, s, 1.0)
        copy(vec(w, X), vec(w, XE))
        copy(vec(w, F0), vec(w, F1))
        copy(vec(w, G0), vec(w, GE))
        real[TIME] = t + s if t + s < stop * (1 - ROUNDING) - FITS * s else stop
        w[CURVED] = whole
        copy(vec(w, E2_BEFORE), vec(w, E2))
        real[STEP_BEFORE] = s
        if w[WAITING]:
            w[WAITING] = 0
            w[REPEATS] = 0
            if not decided(w, real[TIME]):
                return JAMMED
            continue
        if whole and w[ARRIVED]:
            w[ARRIVED] = 0
            vec(w, FIRST)[w[LADDER]] = k
        w[RUNG] = max(min(w[RUNG], k - longer(error, bend)), w[TOP])  # what was cut short by the end tells nothing
    return DONE


@kernel
def choose(w, rest, foot):
    """Rung and length of the step to try: none above what is left; below the foot of the ladder just what is left."""
    sizes, k = vec(w, SIZES), max(w[RUNG], w[TOP])
    if w[WAITING]:
        return k, min(rest, sizes[foot], MOMENT * 2.0 ** w[PATIENCE])
    while sizes[k] > rest * (1 + FITS) and k < foot:
        k += 1
    return k, sizes[k] if sizes[k] <= rest * (1 + FITS) else rest


@kernel
def event(w, t, s, high):
    """Stop within the step where a margin falls through zero, and decide the modes."""
    real = vec(w, NUMBERS)
    q = root(w, t, s, high)
    gp = vec(w, GP)
    w[FALLEN] = 0
    for i in range(gp.size):
        if gp[i] < gp[w[FALLEN]]:
            w[FALLEN] = i
    at(w, s, q)
    copy(vec(w, B), vec(w, XP))
    show(w, t, s, q)
    copy(vec(w, X), vec(w, B))
    now = t + s * q
    w[REPEATS] = w[REPEATS] + 1 if now == real[EVENT_TIME] else 0
    real[TIME] = real[EVENT_TIME] = now
    if not switch(w, now):
        return JAMMED
    if w[TOTAL] % CROWD == 1:
        real[CROWD_TIME] = real[BEGIN] + now
    elif w[TOTAL] % CROWD == 0 and real[BEGIN] + now - real[CROWD_TIME] < CROWDED:
        return CHATTERS
    return DONE


@kernel
def watch(w):
    """Whether the end of the step is still within bounds."""
    x, nominal = vec(w, XE), vec(w, NOMINAL)
    for i in range(x.size):
        if not abs(x[i]) <= BOUND * nominal[i]:
            w[CHANGED] = i
            return GROWN if abs(x[i]) > BOUND * nominal[i] else STALLED
    return DONE


@kernel
def shorter(error, bend):
    """How many rungs down after a step that failed."""
    count = 1
    while count < MOST_SHORTER and not (error <= SHORTER_ERROR and bend <= SHORTER_BEND):
        error /= SHORTER_ERROR
        bend /= SHORTER_BEND
        count += 1
    return count


@kernel
def longer(error, bend):
    """How many rungs up after a step that was good."""
    count = 0
    while count < MOST_LONGER and error * SHORTER_ERROR <= LONGER and bend * SHORTER_BEND <= LONGER:
        error *= SHORTER_ERROR
        bend *= SHORTER_BEND
        count += 1
    return count


@kernel
def show(w, t, s, q):
    """Write the output points of the step up to part q of it, that itself left out."""
    times, real = vec(w, OUT_TIMES), vec(w, NUMBERS)
    stop = t + s * q - ROUNDING * abs(t + s * q)
    while w[SEEN] < times.size and times[w[SEEN]] - real[BEGIN] < stop:
        part = min(max((times[w[SEEN]] - real[BEGIN] - t) / s, 0.0), 1.0)
        if q < 1.0:
            at(w, s, part)
        else:
            curve_at(w, s, part)
        write(w, vec(w, XP))


@kernel
def write(w, x):
    """One output point: a state in the present modes."""
    h, modes, k = vec(w, H), vec(w, M), w[SEEN]
    states, shown = row(w, OUT_STATES, k, x.size + h.size), row(w, OUT_MODES, k, modes.size)
    for i in range(x.size):
        states[i] = x[i]
    for i in range(h.size):
        states[x.size + i] = h[i]
    copy(shown, modes)
    w[SEEN] += 1
