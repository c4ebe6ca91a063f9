"""One step within a mode, x' = f(x, t), with the linear part L of f frozen and N = f - L x.

    a  = x + s phi_1 f(x, t)                            exact where N is constant
    b  = a + s phi_2 (N(a, t+s) - N(x, t))              second order; exact where N is a line in time
    m  = the same over half the step, with N on that line: the middle
    x+ = a + s (phi_2 (4 dm - db) + 2 phi_3 (2 db - 4 dm))    third order: N a parabola through its values dm at m and
                                                        db at b, as differences to N(x, t)

The error is that of b, which is larger than that of x+, or, after a step in the same mode, that of x+ by what the
parabola of N has changed since. Where N has stayed on one line in time for some steps (most
modes are linear) b is taken for x+, and it is checked in every step that N goes on along that line.

The bend is how far the motion is from the quintic through states and flows at both ends and the middle, at a quarter,
where that is largest. A step that bends by no more than the tolerance has nothing in it that this curve does not tell:
no slip speed can dip below zero and come back unseen.

Below the foot of the ladder a step of any size is made by series instead of matrices.
"""

from actuator.engine.evaluate import flow, flow_and_margins
from actuator.engine.ladder import linear_part, phi, rung
from actuator.engine.layout import (
    BEND,
    CALM,
    CURVED,
    DEGREE,
    DRIFT,
    DRIFT_STEP,
    E1,
    E2,
    E2_BEFORE,
    F0,
    F1,
    FA,
    FM,
    FRESH,
    G0,
    GE,
    GM,
    LADDER,
    MOVING,
    NA,
    NC,
    ND,
    NOMINAL,
    NOTHING,
    NUMBERS,
    RELATIVE,
    SIZES,
    STEP_BEFORE,
    STEPS,
    TOLERANCE,
    XE,
    XM,
    XP,
    XQ,
    A,
    B,
    X,
    Z,
)
from actuator.engine.memory import clear, copy, kernel, multiply, row, vec

ERROR = 2.0  # times the tolerance that b may be off: x+ is better by an order
FIRST_QUARTER = 0.25
CALM_STEPS = 3  # steps in a row with N on a line, after which it is believed
ON_LINE = 1e-4  # part of the tolerance that N's departure from the line may make in x
OFF_LINE = 1e-3  # the same, above which the belief is dropped
ONCE_MORE = -1.0  # "error" of a step that is to be made again, with nothing believed
NEGLIGIBLE = 1e-22  # term of a series that adds nothing


@kernel
def linear_step(w, s, phi_k, v, y, out):
    """Out = y + s phi_k v."""
    multiply(w, phi_k, v, s, y, out)


@kernel
def difference(w, y, f, out):
    """N(y) - N(x) from f = f(y), which is overwritten: (f - f0) - L (y - x)."""
    x, f0, z = vec(w, X), vec(w, F0), vec(w, Z)
    for i in range(z.size):
        z[i] = y[i] - x[i]
        f[i] -= f0[i]
    multiply(w, linear_part(w), z, -1.0, f, out)


@kernel
def whole_step(w, t, k):  # noqa: PLR0915 - the formulas above, in their order
    """From X a step of rung k: the middle XM, the end XE, flow F1 and margins GM, GE there; error and bend."""
    rung(w, k)
    rung(w, k + 1)
    rung(w, k + 2)
    w[STEPS] += 1
    start(w, t)
    s, calm, c = vec(w, SIZES)[k], vec(w, CALM), w[LADDER]
    believed = calm[c] >= CALM_STEPS
    x, a, b, xm, xe = vec(w, X), vec(w, A), vec(w, B), vec(w, XM), vec(w, XE)
    f0, fa, na, nc, nd = vec(w, F0), vec(w, FA), vec(w, NA), vec(w, NC), vec(w, ND)
    e1, e2, drift = vec(w, E1), vec(w, E2), row(w, DRIFT, c, x.size)
    linear_step(w, s, phi(w, k, 1), f0, x, a)
    if believed:
        for i in range(x.size):
            na[i] = s * drift[i]
    else:
        flow(w, t + s, a, fa)
        difference(w, a, fa, na)
    linear_step(w, s / 2, phi(w, k + 1, 1), f0, x, xm)
    linear_step(w, s / 4, phi(w, k + 1, 2), na, xm, xm)
    flow_and_margins(w, t + s / 2, xm, vec(w, FM), vec(w, GM))
    linear_step(w, s, phi(w, k, 2), na, a, b)
    error = 0.0
    if believed:
        copy(xe, b)
        copy(e1, na)
        clear(e2)
        flow_and_margins(w, t + s, xe, vec(w, F1), vec(w, GE))
        copy(fa, vec(w, F1))
        difference(w, xe, fa, nd)
        for i in range(x.size):
            error = larger(error, abs(nd[i] - na[i]) * s / weight(w, i))
        if not error <= OFF_LINE * vec(w, NUMBERS)[TOLERANCE]:
            calm[c] = 0.0
            return ONCE_MORE, 0.0
        if s > vec(w, DRIFT_STEP)[c]:
            remember_drift(w, s, nd)
    else:
        copy(fa, vec(w, FM))
        difference(w, xm, fa, nc)
        flow(w, t + s, b, fa)
        difference(w, b, fa, nd)
        for i in range(x.size):
            e1[i] = 4 * nc[i] - nd[i]
            e2[i] = 2 * (2 * nd[i] - 4 * nc[i])
        linear_step(w, s, phi(w, k, 2), e1, a, xe)
        linear_step(w, s, phi(w, k, 3), e2, xe, xe)
        for i in range(x.size):
            error = larger(error, abs(xe[i] - b[i]) / weight(w, i))
        remember_drift(w, s, nd)
        calm[c] = calm[c] + 1.0 if error <= ON_LINE * vec(w, NUMBERS)[TOLERANCE] else 0.0
        flow_and_margins(w, t + s, xe, vec(w, F1), vec(w, GE))
        # the middle by the parabola, too
        linear_step(w, s / 2, phi(w, k + 1, 1), f0, x, xm)
        linear_step(w, s / 4, phi(w, k + 1, 2), e1, xm, xm)
        linear_step(w, s / 8, phi(w, k + 1, 3), e2, xm, xm)
        if w[CURVED]:
            error = min(error, third_order(w, k))
    return error / (ERROR * vec(w, NUMBERS)[TOLERANCE]), bend(w, k) / vec(w, NUMBERS)[TOLERANCE]


@kernel
def third_order(w, k):
    """The error of x+ itself: by how much N's curvature differs from the step before, and N at x+ from N at b."""
    s, x, e2, before = vec(w, SIZES)[k], vec(w, X), vec(w, E2), vec(w, E2_BEFORE)
    fa, change, effect = vec(w, FA), vec(w, NC), vec(w, NA)
    scale, error = (s / vec(w, NUMBERS)[STEP_BEFORE]) ** 2, 0.0
    for i in range(x.size):
        change[i] = e2[i] - scale * before[i]
    linear_step(w, s, phi(w, k, 3), change, vec(w, NOTHING), effect)
    copy(fa, vec(w, F1))
    difference(w, vec(w, XE), fa, change)
    for i in range(x.size):
        off = abs(effect[i]) + s * abs(change[i] - vec(w, ND)[i])
        error = larger(error, off / weight(w, i))
    return error


@kernel
def remember_drift(w, s, change):
    """How fast N changes in the present mode; the longer the step, the less of it is rounding."""
    drift = row(w, DRIFT, w[LADDER], change.size)
    for i in range(change.size):
        drift[i] = change[i] / s
    vec(w, DRIFT_STEP)[w[LADDER]] = s


@kernel
def small_step(w, t, s):
    """As `whole_step`, of any size that is small for L, by series, of second order."""
    w[STEPS] += 1
    start(w, t)
    x, a, xm, xe = vec(w, X), vec(w, A), vec(w, XM), vec(w, XE)
    f0, fa, na, nc, nd, e1 = vec(w, F0), vec(w, FA), vec(w, NA), vec(w, NC), vec(w, ND), vec(w, E1)
    copy(a, x)
    copy(xm, x)
    series(w, s, f0, 1.0, a, xm)
    flow(w, t + s, a, fa)
    difference(w, a, fa, na)
    copy(xe, a)
    series(w, s, na, 2.0, xe, xm)
    copy(e1, na)
    clear(vec(w, E2))
    flow_and_margins(w, t + s / 2, xm, vec(w, FM), vec(w, GM))
    flow_and_margins(w, t + s, xe, vec(w, F1), vec(w, GE))
    copy(fa, vec(w, FM))
    difference(w, xm, fa, nc)
    copy(fa, vec(w, F1))
    difference(w, xe, fa, nd)
    error = 0.0
    for i in range(x.size):
        off = max(abs(nd[i] - na[i]), abs(2 * nc[i] - na[i]))  # from N on a line
        error = larger(error, s * off / weight(w, i))
    vec(w, NUMBERS)[BEND] = 0.0
    return error / (ERROR * vec(w, NUMBERS)[TOLERANCE]), 0.0


@kernel
def start(w, t):
    """Flow and margins at the start of a step, where they are not known yet."""
    if not w[FRESH]:
        flow_and_margins(w, t, vec(w, X), vec(w, F0), vec(w, G0))
        w[FRESH] = 1


@kernel
def series(w, s, v, k, out, middle):
    """Add s phi_k v to `out` and the same of half the step, with half of v for phi_2, to `middle`.

    phi_k(z) = sum z^j / (j + k)!
    """
    n, linear, term, nothing = w[MOVING], linear_part(w), vec(w, ND), vec(w, NOTHING)
    factor, half = (s, 0.5) if k == 1.0 else (s / 2, 0.25)
    copy(term, v)
    for j in range(DEGREE):
        largest = 0.0
        for i in range(n):
            part = factor * term[i]
            out[i] += part
            middle[i] += half * part
            largest = max(largest, abs(part))
        if largest < NEGLIGIBLE:
            break
        multiply(w, linear, term, s / (j + 1 + k), nothing, term)
        half /= 2


@kernel
def bend(w, k):
    """Distance of the motion from the quintic at the first quarter of a step of rung k, the largest over weights."""
    s, x, exact, xp, found = vec(w, SIZES)[k], vec(w, X), vec(w, XQ), vec(w, XP), 0.0
    linear_step(w, s / 4, phi(w, k + 2, 1), vec(w, F0), x, exact)
    linear_step(w, s / 16, phi(w, k + 2, 2), vec(w, E1), exact, exact)
    linear_step(w, s / 64, phi(w, k + 2, 3), vec(w, E2), exact, exact)
    curve_at(w, s, FIRST_QUARTER)
    for i in range(x.size):
        found = larger(found, abs(xp[i] - exact[i]) / weight(w, i))
    vec(w, NUMBERS)[BEND] = found
    return found


@kernel
def curve_at(w, s, q):
    """XP on the quintic through states and flows at both ends and the middle of the step."""
    x, xe, xm, xp = vec(w, X), vec(w, XE), vec(w, XM), vec(w, XP)
    f0, f1, fm = vec(w, F0), vec(w, F1), vec(w, FM)
    a, b = (1 + 2 * q) * (1 - q) ** 2, q * q * (3 - 2 * q)
    c, d = s * q * (1 - q) ** 2, s * q * q * (q - 1)
    hump = 16 * q * q * (1 - q) ** 2
    tilt = hump * (q - 0.5)
    for i in range(xp.size):
        cubic = a * x[i] + b * xe[i] + c * f0[i] + d * f1[i]
        off = xm[i] - (x[i] + xe[i]) / 2 - s / 8 * (f0[i] - f1[i])
        turned = s * (fm[i] + (f0[i] + f1[i]) / 4) - 1.5 * (xe[i] - x[i])
        xp[i] = cubic + hump * off + tilt * turned


@kernel
def weight(w, i):
    """What an error of state i is measured by."""
    return vec(w, NOMINAL)[i] + vec(w, NUMBERS)[RELATIVE] * abs(vec(w, X)[i])


@kernel
def larger(a, b):
    """The larger of two, NaN where one is."""
    return b if not b <= a else a
