"""One window of integration as a single CasADi function: integrator, events, log, outputs and margins.

What is added to CasADi's Rosenbrock integrator, and why:

* Time runs from 0 to 1 and the window's length is a parameter, so one compiled function serves every
  duration and resolution, and derivatives with respect to a period exist.
* States are scaled by their nominal sizes, so the scalar tolerance means the same for each of them.
* The modes ride along as a state without dynamics, packed into one number to keep the linear algebra
  small, and so does a log of the last events: both survive compilation. They do not count in the error;
  the tolerance is sharpened by what they dilute.
* What depends on the parameters alone (tooth geometry, say) is worked out once, not in every stage.
* Held states of sampled controllers are parameters of the integration from tick to tick, and a window of
  many ticks is one function too: tick, decision of the modes where it needs one, integration, and so on.
"""

import contextlib
import io
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from actuator.hybrid import HybridSystem
from actuator.simulation.signals import Piece

INTERVALS = 200  # output intervals of one window
LOG_SLOTS = 4  # events of one output interval that are kept
MODE_BASE = 5  # mode variables are -2..2
MODES_PER_CODE = 20  # 5^20 < 2^53
EVENT_TOLERANCE = 1e-14  # part of a window
VIOLATION = 1e-9  # a margin below minus this is a missed event, not rounding
MAX_EVENTS = 500  # in one window; with more it is run again in halves, and is chattering if that does not help


class ModeCode:
    """Mode variables as digits of one number (of several, where there are more than MODES_PER_CODE)."""

    def __init__(self, count: int) -> None:
        self.sizes = [min(MODES_PER_CODE, count - k) for k in range(0, count, MODES_PER_CODE)]

    @property
    def size(self) -> int:
        """How many numbers."""
        return len(self.sizes)

    def pack(self, modes: Any) -> Any:
        """Codes from modes."""
        groups = ca.vertsplit(modes, [0, *np.cumsum(self.sizes)]) if self.sizes else []
        weights = [ca.DM([float(MODE_BASE**i) for i in range(size)]) for size in self.sizes]
        return ca.vertcat(*(ca.dot(group + 2, weight) for group, weight in zip(groups, weights, strict=True)))

    def packed(self, modes: np.ndarray) -> np.ndarray:
        """Codes from modes, as numbers."""
        return ca.DM(self.pack(ca.DM(modes))).full().ravel()

    def unpack(self, codes: ca.SX) -> ca.SX:
        """Modes from codes that may have picked up rounding."""
        digits = []
        for k, size in enumerate(self.sizes):
            rest = ca.floor(codes[k] + 0.5)
            for _ in range(size):
                shorter = ca.floor((rest + 0.5) / MODE_BASE)
                digits.append(rest - MODE_BASE * shorter - 2)
                rest = shorter
        return ca.vertcat(*digits)

    def words(self, codes: np.ndarray) -> tuple[int, ...]:
        """Modes from codes, as integers."""
        digits = []
        for code, size in zip(codes, self.sizes, strict=True):
            rest = round(code)
            for _ in range(size):
                rest, digit = divmod(rest, MODE_BASE)
                digits.append(digit - 2)
        return tuple(digits)


class InputForm(NamedTuple):
    """All inputs between two break points: lines plus a number of shared waves, as one coefficient vector."""

    inputs: int
    waves: int

    @property
    def size(self) -> int:
        """Length of the coefficient vector: offsets, slopes; per wave sines, cosines; per wave its frequencies."""
        return self.inputs * (2 + 2 * self.waves) + 2 * self.waves

    def values(self, time: ca.SX, coefficients: ca.SX) -> ca.SX:
        """Value of u at `time` after the start of the window."""
        n = self.inputs
        u = coefficients[:n] + coefficients[n : 2 * n] * time
        for k in range(self.waves):
            first, pair = (2 + 2 * k) * n, (2 + 2 * self.waves) * n + 2 * k
            angle = coefficients[pair] * time + coefficients[pair + 1] * time**2 / 2
            u += coefficients[first : first + n] * ca.sin(angle) + coefficients[first + n : first + 2 * n] * ca.cos(
                angle
            )
        return u

    def coefficients(self, pieces: list[Piece]) -> np.ndarray:
        """Coefficient vector from one piece per input."""
        n, shapes = self.inputs, sorted({(wave.frequency, wave.rate) for piece in pieces for wave in piece.waves})
        if len(shapes) > self.waves:
            raise ValueError(
                f"the inputs have {len(shapes)} different waves at once, the engine was built for {self.waves}"
            )
        vector = np.zeros(self.size)
        for i, piece in enumerate(pieces):
            vector[i], vector[n + i] = piece.offset, piece.slope
            for wave in piece.waves:
                first = (2 + 2 * shapes.index((wave.frequency, wave.rate))) * n
                vector[first + i] += wave.amplitude * np.cos(wave.phase)
                vector[first + n + i] += wave.amplitude * np.sin(wave.phase)
        frequencies = np.ravel(shapes)
        vector[(2 + 2 * self.waves) * n :][: frequencies.size] = frequencies
        return vector


class Integration(NamedTuple):
    """The pieces of a window: integration between two ticks, what it needs to know only once, and what can be seen."""

    between: ca.Function  # (x, m, p, derived, length, start, coefficients) -> a column per output point, as `_log_rows`
    derived: ca.Function  # what depends on the parameters alone
    observe: ca.Function  # (time, column, held, p, coefficients) -> states, modes, outputs, margins


def window_function(system: HybridSystem, form: InputForm, code: ModeCode, tolerance: float) -> ca.Function:
    """(x, m, p, length, coefficients) -> states, modes, outputs, margins, log.

    All results have a column per output point, the first for the start. The log has the number of events so far, the
    times of the last LOG_SLOTS of them as parts of the window, newest first (-1 minus the time where no consistent
    modes were found), and the codes of the modes after them.
    """
    pieces = _integration(system, form, code, tolerance, INTERVALS)
    x, m, p, length, wave = _window_inputs(system, form)
    path = pieces.between(x, m, p, pieces.derived(p), length, 0, wave)
    times = length * ca.DM(np.linspace(0, 1, INTERVALS + 1)).T
    seen = _observed(pieces, times, path, x[system.moving :, :], p, wave)
    return ca.Function("window", [x, m, p, length, wave], [*seen, _log(path, system, code)])


def ticks_function(  # noqa: PLR0913 - how finely and how often
    system: HybridSystem, form: InputForm, code: ModeCode, tolerance: float, count: int, fine: int, stride: int
) -> ca.Function:
    """`count` ticks in a row, each with `fine` output intervals behind it, or an output point at every `stride`-th.

    (x, m, p, due, period, coefficients) -> states, modes, outputs, margins, log, faults, ends, end modes

    `due` has a column per tick, negative for one that is passed over. The first four results have a column per output
    point, a tick's being the state after it. The log has `fine` + 1 columns per tick; its times are parts of the
    period. A fault of a tick is 1 where no consistent modes were found after it, or a margin was negative before it,
    and for all ticks behind one with more events than the log holds or a fault: they are passed over, as they are run
    again. The ends are states and modes one period after each tick, before the next.
    """
    assert system.tick is not None
    # from tick to tick little happens, mostly: the whole way is tried first
    pieces = _integration(system, form, code, tolerance, fine, {"step0": 1 / fine})
    moving, nm = system.moving, len(system.modes)
    x, m, p, period, wave = _window_inputs(system, form)
    derived, due = ca.MX.sym("derived", pieces.derived.size1_out(0)), ca.MX.sym("due", len(system.clocks))
    start, broken = ca.MX.sym("start"), ca.MX.sym("broken")
    u = _input_function(form)(start, wave)
    x1, m1, fault = _settle_where_needed(system)(x, system.tick(due, x, m, u, p), m, u, p)
    fault = ca.fmax(ca.fmax(fault, broken), due[0] < 0)
    path = pieces.between(x1, m1, p, derived, period * (1 - fault), start, wave)
    states, codes, events, *_ = ca.vertsplit(path[:, -1], _log_rows(moving, code.size))
    nominal = ca.DM([state.nominal for state in system.states[:moving]])
    one = ca.Function(
        "one_tick",
        [x, m, broken, p, derived, due, period, start, wave],
        [
            ca.vertcat(states * nominal, x1[moving:, :]),
            _unpack_function(code, nm)(codes),
            ca.fmax(fault, events > LOG_SLOTS + 0.5),  # noqa: PLR2004 - counts are whole numbers
            path,
            x1[moving:, :],
            fault,
        ],
    )
    many = one.mapaccum("many", count, [0, 1, 2], [0, 1, 2])
    schedule = ca.MX.sym("due", len(system.clocks), count)
    same = [ca.repmat(value, 1, count) for value in (p, pieces.derived(p))]
    starts = period * ca.DM(range(count)).T
    ends, end_modes, _, path, held, faults = many(
        x, m, 0, *same, schedule, ca.repmat(period, 1, count), starts, ca.repmat(wave, 1, count)
    )
    seen_at = [(tick, k) for tick in range(0, count, stride) for k in range(fine)]
    times = period * ca.DM([tick + k / fine for tick, k in seen_at]).T
    columns, ticks = [tick * (fine + 1) + k for tick, k in seen_at], [tick for tick, _ in seen_at]
    seen = _observed(pieces, times, path[:, columns], held[:, ticks], p, wave)
    log = _log(path, system, code)
    return ca.Function("ticks", [x, m, p, schedule, period, wave], [*seen, log, faults, ends, end_modes])


def _window_inputs(system: HybridSystem, form: InputForm) -> list[ca.MX]:
    sizes = {"x": len(system.states), "m": len(system.modes), "p": len(system.parameters), "length": 1}
    return [ca.MX.sym(name, size) for name, size in (sizes | {"wave": form.size}).items()]


def _input_function(form: InputForm) -> ca.Function:
    time, wave = ca.SX.sym("time"), ca.SX.sym("wave", form.size)
    return ca.Function("input", [time, wave], [form.values(time, wave)])


def _unpack_function(code: ModeCode, modes: int) -> ca.Function:
    codes = ca.SX.sym("codes", code.size)
    return ca.Function("unpack", [codes], [ca.reshape(code.unpack(codes), modes, 1)])


def _observed(pieces: Integration, times: ca.MX, path: ca.MX, held: ca.MX, p: ca.MX, wave: ca.MX) -> list[ca.MX]:
    """States, modes, outputs and margins, with a column per column of `path`."""
    points = path.shape[1]
    held = held if held.shape[1] == points else ca.repmat(held, 1, points)
    same = (ca.repmat(value, 1, points) for value in (p, wave))
    return list(pieces.observe.map(points)(times, path, held, *same))


def _log(path: ca.MX, system: HybridSystem, code: ModeCode) -> ca.MX:
    """Count, times, codes: present and older."""
    _, codes, count, times, older = ca.vertsplit(path, _log_rows(system.moving, code.size))
    return ca.vertcat(count, times, codes, older)


def _settle_where_needed(system: HybridSystem) -> ca.Function:
    """(x before a tick, x after it, m, u, p) -> state and modes that leave no margin negative, and the fault.

    Only where margins depend on what is held can a tick make one negative.
    """
    sizes = len(system.states), len(system.modes), len(system.inputs), len(system.parameters)
    before, m, u, p = (ca.MX.sym(name, size) for name, size in zip("xmup", sizes, strict=True))
    after = ca.MX.sym("after", sizes[0])
    arguments = [after, m, u, p]
    touched = system.margins.jac_sparsity(0, 0).get_col() if system.margin_names else []
    if not any(column >= system.moving for column in touched):
        return ca.Function("settle", [before, *arguments], [after, m, 0])
    as_is = ca.Function("as_is", arguments, [after, m, 0])
    settled = ca.Function("settled", arguments, list(system.reset(ca.DM.zeros(len(system.margin_names)), *arguments)))
    needed = ca.mmin(system.margins(*arguments)) < 0
    missed = ca.mmin(system.margins(before, m, u, p)) < -VIOLATION
    state, modes, fault = ca.Function.if_else("choice", settled, as_is)(needed, *arguments)
    return ca.Function("settle", [before, *arguments], [state, modes, ca.fmax(fault, missed)])


def _integration(
    system: HybridSystem, form: InputForm, code: ModeCode, tolerance: float, intervals: int, options: dict | None = None
) -> Integration:
    """Integration over `length` from `start` (within the piece of the inputs), held states and parameters constant."""
    moving = system.moving
    nominal = ca.DM([state.nominal for state in system.states[:moving]])
    nh, nc = len(system.states) - moving, code.size
    log_size = 1 + LOG_SLOTS + (LOG_SLOTS - 1) * nc  # the newest codes are the present ones
    y, tau = ca.SX.sym("y", moving + nc + log_size), ca.SX.sym("tau")
    held, p, length = ca.SX.sym("held", nh), ca.SX.sym("p", len(system.parameters)), ca.SX.sym("length")
    start, wave, time = ca.SX.sym("start"), ca.SX.sym("wave", form.size), ca.SX.sym("time")
    x, modes = ca.vertcat(y[:moving, :] * nominal, held), code.unpack(y[moving : moving + nc, :])

    arguments = x, modes, form.values(start + tau * length, wave), p
    rate, margins = system.flow(*arguments)[:moving, :], system.margins(*arguments)
    (rate, margins), names, derived = ca.extract_parametric([rate, margins], p)
    once = ca.Function("once", [p], [ca.vertcat(*derived)])
    everything = ca.vertcat(held, p, length, start, wave, *names)
    dae = {"t": tau, "x": y, "p": everything, "ode": ca.vertcat(length * rate / nominal, ca.SX.zeros(nc + log_size))}
    dilution = np.sqrt(moving / y.shape[0])
    settings = {
        "abstol": tolerance * dilution,
        "reltol": tolerance * dilution * 1e-3,
        # the interpolant between steps, on which events are located, is not under error control
        "max_step_size": 1 / intervals,
    } | (options or {})
    if system.margin_names:
        dae["zero"] = margins
        settings |= {
            "transition": _transition(system, form, code, everything.shape[0]),
            "event_tol": EVENT_TOLERANCE,
            "max_events": MAX_EVENTS,
        }
    grid = list(np.linspace(0, 1, intervals + 1)[1:])
    with contextlib.redirect_stderr(io.StringIO()):  # "Event support is experimental", once per integrator
        integrator = ca.integrator("integrator", "rosenbrock", dae, 0, grid, settings)

    seen = x, modes, form.values(time, wave), p
    observe = ca.Function(
        "observe", [time, y, held, p, wave], [x, modes, system.outputs_function(*seen), system.margins(*seen)]
    )
    x0, m0 = ca.MX.sym("x0", moving + nh), ca.MX.sym("m0", len(system.modes))
    p0, *constants = (ca.MX.sym(f"given{k}", symbol.shape[0]) for k, symbol in enumerate((p, length, start, wave)))
    known = ca.MX.sym("derived", once.size1_out(0))
    first = ca.vertcat(x0[:moving, :] / nominal, code.pack(m0), ca.DM.zeros(log_size))
    after = integrator(x0=first, p=ca.vertcat(x0[moving:, :], p0, *constants, known))["xf"]
    between = ca.Function("between", [x0, m0, p0, known, *constants], [ca.horzcat(first, after)])
    return Integration(between, once, observe)


def _log_rows(moving: int, codes: int) -> list[int]:
    """Where the parts of the integrated vector begin: states, codes, count, times, older codes; and its end."""
    return [int(row) for row in np.cumsum([0, moving, codes, 1, LOG_SLOTS, (LOG_SLOTS - 1) * codes])]


def _transition(system: HybridSystem, form: InputForm, code: ModeCode, size_p: int) -> ca.Function:
    """The reset of the system as the integrator calls it, with the event put into the log."""
    moving, nc, n_p = system.moving, code.size, len(system.parameters)
    nominal, nh = ca.DM([state.nominal for state in system.states[:moving]]), len(system.states) - moving
    rows = _log_rows(moving, nc)
    index, tau = ca.MX.sym("index"), ca.MX.sym("tau")
    y, everything = ca.MX.sym("y", rows[-1]), ca.MX.sym("everything", size_p)
    held, p, length, start, wave, _ = ca.vertsplit(
        everything, [int(row) for row in np.cumsum([0, nh, n_p, 1, 1, form.size, size_p - nh - n_p - 2 - form.size])]
    )
    states, codes, count, times, older = ca.vertsplit(y, rows)
    u = _input_function(form)(start + tau * length, wave)
    m = _unpack_function(code, len(system.modes))(codes)
    fired = ca.vertcat(*(ca.fabs(index - k) < 0.5 for k in range(len(system.margin_names))))  # noqa: PLR2004
    after, modes, fault = system.reset(fired, ca.vertcat(states * nominal, held), m, u, p)
    newest = ca.if_else(fault, -1 - tau, tau)
    kept = ca.vertcat(codes, older)[: older.shape[0]]
    post = ca.vertcat(after[:moving, :] / nominal, code.pack(modes), count + 1, newest, times[: LOG_SLOTS - 1], kept)
    return ca.Function(
        "transition", {"index": index, "t": tau, "x": y, "p": everything, "post_x": post}, ca.event_in(), ca.event_out()
    )
