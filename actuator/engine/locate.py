"""When, within a step, a margin falls through zero first.

The search asks the curve of the step itself: the quintic through its ends and its middle, where that is the motion to
much less than the tolerance, in state and margins; else a shorter step towards the event is made first; and below the
foot of the ladder the motion is a polynomial to the last bit.
"""

import numpy as np

from actuator.engine.evaluate import flow_and_margins
from actuator.engine.ladder import linear_part
from actuator.engine.layout import (
    BEND,
    BY_ENDS,
    DEGREE,
    E1,
    E2,
    F0,
    FA,
    G0,
    GE,
    GM,
    GP,
    GQ,
    MOVING,
    NOTHING,
    NUMBERS,
    POLYNOMIAL,
    TOLERANCE,
    XP,
    XQ,
    X,
)
from actuator.engine.memory import copy, kernel, multiply, row, vec
from actuator.engine.step import FIRST_QUARTER, curve_at

NEGATIVE = -1e-9  # margin that is below zero: angles times stiffness leave noise of 1e-11 to 1e-10
EXACT = 1e-4  # part of the tolerance up to which a step is its quintic
LAST_QUARTER = 0.75
ZERO = 1e-12  # width of what counts as a root, below it: always on the far side, or margins toggle
EVALUATIONS = 80  # at most, of a root; a dozen are usual
FINEST = 1e-15  # part of a step
LOOKS = 6  # at the curve, to see how far the event is


@kernel
def falls(w, t, s):  # noqa: PLR0911 - what is seen first, counts
    """The part of the step up to which a margin was seen below zero; 0 where none was."""
    g0, gm, ge, gp, gq = vec(w, G0), vec(w, GM), vec(w, GE), vec(w, GP), vec(w, GQ)
    least_middle = least_end = room = np.inf
    for i in range(g0.size):
        low, high = min(g0[i], gm[i], ge[i]), max(g0[i], gm[i], ge[i])
        least_middle, least_end = min(least_middle, gm[i]), min(least_end, ge[i])
        room = min(room, low - (high - low))
    if least_middle < NEGATIVE:
        return 0.5
    if room < 0.0:  # a margin that moves by more than what is left of it may dip between: the quarters are looked at
        curve_at(w, s, FIRST_QUARTER)
        if flow_and_margins(w, t + s * FIRST_QUARTER, vec(w, XP), vec(w, FA), gp) < NEGATIVE:
            return FIRST_QUARTER
        q = dip(g0, gp, gm)
        if q > 0.0:
            return q / 2
        if least_end < NEGATIVE:
            return 1.0
        curve_at(w, s, LAST_QUARTER)
        if flow_and_margins(w, t + s * LAST_QUARTER, vec(w, XP), vec(w, FA), gq) < NEGATIVE:
            return LAST_QUARTER
        q = dip(gm, gq, ge)
        if q > 0.0:
            return 0.5 + q / 2
    return 1.0 if least_end < NEGATIVE else 0.0


@kernel
def dip(first, middle, last):
    """Where a parabola through three values of a margin has a negative minimum between, as a part; else 0."""
    for i in range(first.size):
        curve = 2 * (first[i] - 2 * middle[i] + last[i])
        slope = last[i] - first[i] - curve
        if curve > 0.0 and slope < 0.0 and -slope < 2 * curve:
            q = -slope / (2 * curve)
            if first[i] + q * (slope + curve * q) < NEGATIVE:
                return q
    return 0.0


@kernel
def is_quintic(w, t, s):
    """Whether the motion over the step is its quintic, as exactly as an event is wanted: at the first quarter."""
    allowed = EXACT * vec(w, NUMBERS)[TOLERANCE]
    if not vec(w, NUMBERS)[BEND] <= allowed:
        return False
    gp, gq = vec(w, GP), vec(w, GQ)
    flow_and_margins(w, t + s * FIRST_QUARTER, vec(w, XQ), vec(w, FA), gq)
    curve_at(w, s, FIRST_QUARTER)
    flow_and_margins(w, t + s * FIRST_QUARTER, vec(w, XP), vec(w, FA), gp)
    for i in range(gp.size):
        if not abs(gp[i] - gq[i]) <= allowed:
            return False
    return True


@kernel
def nearer(w, t, s, k, foot, high):
    """The rung of a step that ends before the event, judged by the curve; `high` is behind the event."""
    low = 0.0
    for look in range(LOOKS):
        q = (low + high) / 2 if look else high / 4
        curve_at(w, s, q)
        if flow_and_margins(w, t + s * q, vec(w, XP), vec(w, FA), vec(w, GP)) < NEGATIVE:
            high = q
        else:
            low = q
        if low > 0.9 * high:  # noqa: PLR2004 - near enough
            break
    part = 0.5
    k += 1
    while part > low and k < foot:
        part /= 2
        k += 1
    return k


@kernel
def root(w, t, s, high):
    """The part of the step after which the least margin is zero, `high` being behind it; XP and GP are those there.

    By the rule of false position, Illinois variant.
    """
    if not w[BY_ENDS]:
        make_polynomial(w, s)
    gp, xp, fa = vec(w, GP), vec(w, XP), vec(w, FA)
    low, g_low = 0.0, np.inf
    for margin in vec(w, G0):
        g_low = min(g_low, margin)
    if g_low < ZERO:
        copy(xp, vec(w, X))
        copy(gp, vec(w, G0))
        return 0.0
    at(w, s, high)
    g_high = flow_and_margins(w, t + s * high, xp, fa, gp)
    if g_high > 0.0:
        return high
    side, q, g = 0, high, g_high
    for _ in range(EVALUATIONS):
        q = (low * g_high - high * g_low) / (g_high - g_low) + ZERO / 2 * (high - low) / (g_low - g_high)
        if not low < q < high:
            q = (low + high) / 2
        at(w, s, q)
        g = flow_and_margins(w, t + s * q, xp, fa, gp)
        if -ZERO <= g <= 0.0 or high - low < FINEST:
            break
        if g < 0.0:
            high, g_high = q, g
            if side < 0:
                g_low /= 2
            side = -1
        else:
            low, g_low = q, g
            if side > 0:
                g_high /= 2
            side = 1
    if g > 0.0:
        q = high
        at(w, s, q)
        flow_and_margins(w, t + s * q, xp, fa, gp)
    return q


@kernel
def at(w, s, q):
    """XP, the state at part q of the step."""
    if w[BY_ENDS]:
        curve_at(w, s, q)
    else:
        polynomial_at(w, q)


@kernel
def make_polynomial(w, s):
    """The present step as a polynomial in the part q of it: x' = f0 + L (x - x0) + e1 q + e2 q^2 / 2."""
    n, linear, nothing = w[MOVING], linear_part(w), vec(w, NOTHING)
    x, f0, e1, e2 = vec(w, X), vec(w, F0), vec(w, E1), vec(w, E2)
    first, second = row(w, POLYNOMIAL, 0, n), row(w, POLYNOMIAL, 1, n)
    for i in range(n):
        first[i] = x[i]
        second[i] = s * f0[i]
    for k in range(1, DEGREE):
        following = row(w, POLYNOMIAL, k + 1, n)
        multiply(w, linear, row(w, POLYNOMIAL, k, n), s / (k + 1), nothing, following)
        if k <= 2:  # noqa: PLR2004 - N is a parabola
            for i in range(n):
                following[i] += s * (e1[i] / 2 if k == 1 else e2[i] / 6)


@kernel
def polynomial_at(w, q):
    """XP on the polynomial that was made of the step."""
    n, xp = w[MOVING], vec(w, XP)
    copy(xp, row(w, POLYNOMIAL, DEGREE, n))
    for k in range(DEGREE - 1, -1, -1):
        term = row(w, POLYNOMIAL, k, n)
        for i in range(n):
            xp[i] = xp[i] * q + term[i]
