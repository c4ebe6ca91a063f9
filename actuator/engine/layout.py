"""What stands where in the table of a run, and how long each of its vectors is.

The table `w` is an array of whole numbers: addresses of functions, then counts, then address and length of each vector.
n states move, nh are held between ticks; nm modes, nu inputs, np parameters, ng margins, nc clocks, nd numbers derived
from parameters and modes alone, nw sine waves in the inputs, nk contacts that can stick.
"""

from typing import NamedTuple

RUNGS = 46  # of a ladder, from the longest step down; below its foot steps are made by series
DEEPEST = 63  # rung of the smallest step that has a number
LADDERS = 64  # that are kept: a cycle has a dozen modes
DEGREE = 16  # of the polynomial through a small step; the norm of L s is at most a half there, so rounding is reached

FUNCTIONS = ("prepare", "flow", "both", "jacobian", "reset", "tick", "multiply")
PREPARE, FLOW, BOTH, JACOBIAN, RESET, TICK, MULTIPLY = range(7)

COUNTS = 7
(
    MOVING,  # n
    STEPS,  # made so far, rejected ones among them
    PAUSE,  # number of steps at which the kernel returns, to be called again
    EVENTS,  # in the log
    ROOM,  # for events in the log
    SEEN,  # output points written
    LADDER,  # the present one
    MADE,  # ladders in use
    ENTERED,  # modes entered so far
    RUNG,  # to try next
    TOP,  # longest rung that may be tried
    FRESH,  # 1 where F0 and G0 are those of the present state
    STUCK,  # slip directions that are projected out in the present modes
    WAITING,  # 1 where modes could not be decided: after a moment it is tried again
    PATIENCE,  # how often in a row that was so; the moment doubles each time
    REPEATS,  # events at the very same instant so far
    TOTAL,  # events so far
    AGAIN,  # decisions that had to be taken again at once
    NEXT,  # index of the next tick, from time zero
    BUILT,  # ladders built
    SINCE,  # number of steps when a ladder was last built anew in the present mode
    EVALUATED,  # flows
    STEADY,  # 1 where no input changes within the piece
    CHANGED,  # state that has left all bounds, where one has
    ARRIVED,  # 1 until the first whole step in a mode is made
    FALLEN,  # the margin that fell; -1 at a tick or a start
    CURVED,  # 1 where E2_BEFORE is that of the step before, in the same mode
    BY_ENDS,  # 1 where the curve of the present step is the quintic, 0 where it is the polynomial of its series
) = range(COUNTS, COUNTS + 28)

VECTORS = COUNTS + 28
(
    NUMBERS,
    P,
    X,
    H,
    M,
    U,
    OFFSETS,
    SLOPES,
    WAVE_INPUT,
    WAVE_AMPLITUDE,
    WAVE_PHASE,
    WAVE_FREQUENCY,
    WAVE_RATE,
    DERIVED,
    NOMINAL,
    NOTHING,
    SLIP,
    SLIP_MOTION,
    SLIP_FLANK,
    F0,
    F1,
    FM,
    XM,
    XE,
    A,
    B,
    FA,
    NA,
    NC,
    ND,
    E1,
    E2,
    E2_BEFORE,
    Z,
    XP,
    XQ,
    RAW,
    G0,
    GM,
    GE,
    GP,
    GQ,
    FLOOR,
    L,
    L_NEW,
    PROJECTOR,
    SQUARE,
    SQUARE_B,
    PHI,
    BUILT_RUNGS,
    FOOT,
    NORM,
    FIRST,
    CALM,
    DRIFT,
    DRIFT_STEP,
    LADDER_MODES,
    SIZES,
    POLYNOMIAL,
    FIRED,
    FAULT,
    WHOLE,
    WHOLE_AFTER,
    MODES_AFTER,
    DUE,
    EVERY,
    OUT_TIMES,
    OUT_STATES,
    OUT_MODES,
    LOG_TIMES,
    LOG_FIRED,
    LOG_BEFORE,
    LOG_AFTER,
    LOG_MODES,
) = range(VECTORS, VECTORS + 2 * 74, 2)
LENGTH = VECTORS + 2 * 74

# in NUMBERS
(
    TOLERANCE,  # of the run
    RELATIVE,  # part of a state's size that counts like its nominal size
    TIME,  # now, in the piece [s]
    BEGIN,  # of the piece [s]
    END,  # of the piece, in the piece [s]
    PERIOD,  # of ticks [s]; infinite without
    EVENT_TIME,  # of the last event [s]
    CROWD_TIME,  # of the first event of those that are counted together, see `advance.CROWD` [s]
    BEND,  # of the last step: its quintic against the motion at a quarter, over nominal sizes
    HALT,  # time in the piece at which the kernel returns, to be called again [s]
    STEP_BEFORE,  # length of the last step [s]
) = range(11)


class Sizes(NamedTuple):
    """Of a system, see above."""

    n: int
    nh: int
    nm: int
    nu: int
    np: int
    ng: int
    nc: int
    nd: int
    nw: int
    nk: int


def lengths(s: Sizes, room: int) -> dict[int, int]:
    """Of the vectors of a run but those for output points; `room` events fit in the log."""
    whole, square = s.n + s.nh, s.n * s.n
    found = dict.fromkeys(
        (X, F0, F1, FM, XM, XE, A, B, FA, NA, NC, ND, E1, E2, E2_BEFORE, Z, XP, XQ, RAW, NOMINAL, NOTHING), s.n
    )
    found |= dict.fromkeys((G0, GM, GE, GP, GQ, FLOOR, FIRED), s.ng)
    found |= dict.fromkeys((U, OFFSETS, SLOPES), s.nu)
    found |= dict.fromkeys((WAVE_INPUT, WAVE_AMPLITUDE, WAVE_PHASE, WAVE_FREQUENCY, WAVE_RATE), s.nw)
    found |= dict.fromkeys((L_NEW, PROJECTOR, SQUARE, SQUARE_B), square)
    found |= dict.fromkeys((FOOT, NORM, FIRST, CALM, DRIFT_STEP), LADDERS)
    found |= dict.fromkeys((M, MODES_AFTER), s.nm)
    found |= dict.fromkeys((DUE, EVERY), s.nc)
    found |= dict.fromkeys((SLIP_MOTION, SLIP_FLANK), s.nk)
    found |= dict.fromkeys((WHOLE, WHOLE_AFTER), whole)
    found |= dict.fromkeys((LOG_TIMES, LOG_FIRED), room)
    found |= dict.fromkeys((LOG_BEFORE, LOG_AFTER), room * whole)
    return found | {
        NUMBERS: 11,
        P: s.np,
        H: s.nh,
        DERIVED: s.nd,
        SLIP: s.nk * s.n,
        L: LADDERS * square,
        PHI: LADDERS * (RUNGS + 3) * 4 * square,
        BUILT_RUNGS: LADDERS * (RUNGS + 3),
        DRIFT: LADDERS * s.n,
        LADDER_MODES: LADDERS * s.nm,
        SIZES: DEEPEST + 1,
        POLYNOMIAL: (DEGREE + 1) * s.n,
        FAULT: 1,
        LOG_MODES: room * s.nm,
    }
