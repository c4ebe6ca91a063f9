"""One window of integration as a single CasADi function: integrator, events, log, outputs and margins.

What is added to CasADi's Rosenbrock integrator, and why:

* Time runs from 0 to 1 and the window's length is a parameter, so one compiled function serves every
  duration and resolution, and derivatives with respect to a period exist.
* States are scaled by their nominal sizes, so the scalar tolerance means the same for each of them.
* The modes ride along as a state without dynamics, packed into one number to keep the linear algebra
  small, and so does a log of the last events: both survive compilation. They do not count in the error;
  the tolerance is sharpened by what they dilute.
* What depends on the parameters alone (tooth geometry, say) is worked out once, not in every stage.
"""

import contextlib
import io
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.hybrid import HybridSystem
from actuator.signals import Piece

INTERVALS = 200  # output intervals of one window
LOG_SLOTS = 4  # events of one output interval that are kept
MODE_BASE = 5  # mode variables are -2..2
MODES_PER_CODE = 20  # 5^20 < 2^53
EVENT_TOLERANCE = 1e-14  # part of a window
MAX_EVENTS = 500  # in one window; with more it is run again in halves, and is chattering if that does not help


class ModeCode:
    """Mode variables as digits of one number (of several, where there are more than MODES_PER_CODE)."""

    def __init__(self, count: int) -> None:
        self.sizes = [min(MODES_PER_CODE, count - k) for k in range(0, count, MODES_PER_CODE)]

    @property
    def size(self) -> int:
        """How many numbers."""
        return len(self.sizes)

    def pack(self, modes: ca.MX) -> ca.MX:
        """Codes from modes."""
        groups = ca.vertsplit(modes, [0, *np.cumsum(self.sizes)]) if self.sizes else []
        weights = [ca.DM([float(MODE_BASE**i) for i in range(size)]) for size in self.sizes]
        return ca.vertcat(*(ca.dot(group + 2, weight) for group, weight in zip(groups, weights, strict=True)))

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


def window_function(system: HybridSystem, form: InputForm, code: ModeCode, tolerance: float) -> ca.Function:
    """(x, m, p, length, coefficients) -> states, modes, count, times, codes, outputs, margins.

    All results have a column per output point, the first for the start. `count` is the number of events so
    far, `times` those of the last LOG_SLOTS events as parts of the window, newest first (-1 minus the time where no
    consistent modes were found), `codes` the modes after them.
    """
    nominal = ca.DM([state.nominal for state in system.states])
    nx, nc, points = len(system.states), code.size, INTERVALS + 1
    log_size = 1 + LOG_SLOTS + (LOG_SLOTS - 1) * nc  # the newest codes are the present ones
    y, tau = ca.SX.sym("y", nx + nc + log_size), ca.SX.sym("tau")
    p, length, wave = ca.SX.sym("p", len(system.parameters)), ca.SX.sym("length"), ca.SX.sym("wave", form.size)
    arguments = y[:nx] * nominal, code.unpack(y[nx : nx + nc]), form.values(tau * length, wave), p

    (rate, margins), names, derived = ca.extract_parametric([system.flow(*arguments), system.margins(*arguments)], p)
    once = ca.Function("once", [p], [ca.vertcat(*derived)])
    everything = ca.vertcat(p, length, wave, *names)
    dae = {"t": tau, "x": y, "p": everything, "ode": ca.vertcat(length * rate / nominal, ca.SX.zeros(nc + log_size))}
    dilution = np.sqrt(nx / y.shape[0])
    settings = {
        "abstol": tolerance * dilution,
        "reltol": tolerance * dilution * 1e-3,
        # the interpolant between steps, on which events are located, is not under error control
        "max_step_size": 1 / INTERVALS,
    }
    if system.margin_names:
        dae["zero"] = margins
        settings |= {
            "transition": _transition(system, form, code, y.shape[0], everything.shape[0]),
            "event_tol": EVENT_TOLERANCE,
            "max_events": MAX_EVENTS,
        }
    grid = np.linspace(0, 1, points)
    with contextlib.redirect_stderr(io.StringIO()):  # "Event support is experimental", once per integrator
        integrator = ca.integrator("integrator", "rosenbrock", dae, 0, list(grid[1:]), settings)

    observe = ca.Function(
        "observe",
        [tau, y, p, length, wave],
        [arguments[1], system.outputs_function(*arguments), system.margins(*arguments)],
    )
    x0, m0 = ca.MX.sym("x0", nx), ca.MX.sym("m0", len(system.modes))
    given = ca.MX.sym("p", len(system.parameters)), ca.MX.sym("length"), ca.MX.sym("wave", form.size)
    start = ca.vertcat(x0 / nominal, code.pack(m0), ca.DM.zeros(log_size))
    path = ca.horzcat(start, integrator(x0=start, p=ca.vertcat(*given, once(given[0])))["xf"])
    modes, outputs, margin = observe.map(points)(ca.DM(grid).T, path, *(ca.repmat(g, 1, points) for g in given))
    states, codes, count, times, older = ca.vertsplit(
        path, list(np.cumsum([0, nx, nc, 1, LOG_SLOTS, (LOG_SLOTS - 1) * nc]))
    )
    return ca.Function(
        "window",
        [x0, m0, *given],
        [states * ca.repmat(nominal, 1, points), modes, count, times, ca.vertcat(codes, older), outputs, margin],
    )


def _transition(system: HybridSystem, form: InputForm, code: ModeCode, size: int, size_p: int) -> ca.Function:
    """The reset of the system as the integrator calls it, with the event put into the log."""
    nominal = ca.DM([state.nominal for state in system.states])
    nx, nc, n_p = len(system.states), code.size, len(system.parameters)
    index, tau = ca.MX.sym("index"), ca.MX.sym("tau")
    y, everything = ca.MX.sym("y", size), ca.MX.sym("everything", size_p)
    p, length, wave = everything[:n_p], everything[n_p], everything[n_p + 1 : n_p + 1 + form.size]
    states, codes, count, times, older = ca.vertsplit(
        y, list(np.cumsum([0, nx, nc, 1, LOG_SLOTS, (LOG_SLOTS - 1) * nc]))
    )
    t, w, c = ca.SX.sym("t"), ca.SX.sym("w", form.size), ca.SX.sym("c", nc)
    u = ca.Function("input", [t, w], [form.values(t, w)])(tau * length, wave)
    m = ca.Function("unpack", [c], [code.unpack(c)])(codes)
    fired = ca.vertcat(*(ca.fabs(index - k) < 0.5 for k in range(len(system.margin_names))))  # noqa: PLR2004
    after, modes, fault = system.reset(fired, states * nominal, m, u, p)
    newest = ca.if_else(fault, -1 - tau, tau)
    kept = ca.vertcat(codes, older)[: older.shape[0]]
    post = ca.vertcat(after / nominal, code.pack(modes), count + 1, newest, times[: LOG_SLOTS - 1], kept)
    return ca.Function(
        "transition", {"index": index, "t": tau, "x": y, "p": everything, "post_x": post}, ca.event_in(), ca.event_out()
    )
