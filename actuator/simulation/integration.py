"""The integration between two instants as a CasADi function: integrator, events, log, outputs and margins.

What is added to CasADi's Rosenbrock integrator, and why:

* Time runs from 0 to 1 and the window's length is a parameter, so one compiled function serves every
  duration and resolution, and derivatives with respect to a period exist.
* States are scaled by their nominal sizes, so the scalar tolerance means the same for each of them.
* The modes ride along as a state without dynamics, packed into one number to keep the linear algebra
  small, and so does a log of the last events: both survive compilation. They do not count in the error;
  the tolerance is sharpened by what they dilute.
* What depends on the parameters alone (tooth geometry, say) is worked out once, not in every stage.
* Held states of sampled controllers are parameters of the integration from tick to tick.
"""

import contextlib
import io
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.simulation.input_form import InputForm
from actuator.simulation.mode_code import EventLog, ModeCode
from actuator.system.hybrid import HybridSystem

EVENT_TOLERANCE = 1e-14  # part of a window
MAX_EVENTS = 500  # in one window; with more it is run again in halves, and is chattering if that does not help


class Integration(NamedTuple):
    """The pieces of a window: integration between two ticks, what it needs to know only once, and what can be seen."""

    between: ca.Function  # (x, m, p, derived, length, start, coefficients) -> a column per output point, as in `log`
    derived: ca.Function  # what depends on the parameters alone
    observe: ca.Function  # (time, column, held, p, coefficients) -> states, modes, outputs, margins
    log: EventLog


def integration(
    system: HybridSystem,
    form: InputForm,
    code: ModeCode,
    tolerance: float,
    intervals: int,
    options: dict | None = None,
) -> Integration:
    """Integration over `length` from `start` (within the piece of the inputs), held states and parameters constant."""
    moving = system.moving
    nominal = ca.DM([state.nominal for state in system.states[:moving]])
    nh, nc = len(system.states) - moving, code.size
    log = EventLog(moving, nc)
    y, tau = ca.SX.sym("y", moving + nc + log.size), ca.SX.sym("tau")
    held, p, length = ca.SX.sym("held", nh), ca.SX.sym("p", len(system.parameters)), ca.SX.sym("length")
    start, wave, time = ca.SX.sym("start"), ca.SX.sym("wave", form.size), ca.SX.sym("time")
    x, modes = ca.vertcat(y[:moving, :] * nominal, held), code.unpack(y[moving : moving + nc, :])

    arguments = x, modes, form.values(start + tau * length, wave), p
    rate, margins = system.flow(*arguments)[:moving, :], system.margins(*arguments)
    (rate, margins), names, derived = ca.extract_parametric([rate, margins], p)
    once = ca.Function("once", [p], [ca.vertcat(*derived)])
    everything = ca.vertcat(held, p, length, start, wave, *names)
    dae = {"t": tau, "x": y, "p": everything, "ode": ca.vertcat(length * rate / nominal, ca.SX.zeros(nc + log.size))}
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
            "transition": _transition(system, form, code, log, everything.shape[0]),
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
    first = ca.vertcat(x0[:moving, :] / nominal, code.pack(m0), ca.DM.zeros(log.size))
    after = integrator(x0=first, p=ca.vertcat(x0[moving:, :], p0, *constants, known))["xf"]
    between = ca.Function("between", [x0, m0, p0, known, *constants], [ca.horzcat(first, after)])
    return Integration(between, once, observe, log)


def _transition(system: HybridSystem, form: InputForm, code: ModeCode, log: EventLog, size_p: int) -> ca.Function:
    """The reset of the system as the integrator calls it, with the event put into the log."""
    moving, nc, n_p = system.moving, code.size, len(system.parameters)
    nominal, nh = ca.DM([state.nominal for state in system.states[:moving]]), len(system.states) - moving
    index, tau = ca.MX.sym("index"), ca.MX.sym("tau")
    y, everything = ca.MX.sym("y", moving + nc + log.size), ca.MX.sym("everything", size_p)
    held, p, length, start, wave, _ = ca.vertsplit(
        everything, [int(row) for row in np.cumsum([0, nh, n_p, 1, 1, form.size, size_p - nh - n_p - 2 - form.size])]
    )
    states, codes, *_ = log.split(y)
    u = form.function()(start + tau * length, wave)
    m = code.unpack_function()(codes)
    fired = ca.vertcat(*(ca.fabs(index - k) < 0.5 for k in range(len(system.margin_names))))  # noqa: PLR2004
    after, modes, fault = system.reset(fired, ca.vertcat(states * nominal, held), m, u, p)
    newest = ca.if_else(fault, -1 - tau, tau)
    post = log.after(y, after[:moving, :] / nominal, code.pack(modes), newest)
    return ca.Function(
        "transition", {"index": index, "t": tau, "x": y, "p": everything, "post_x": post}, ca.event_in(), ca.event_out()
    )


def observed(pieces: Integration, times: ca.MX, path: ca.MX, held: ca.MX, p: ca.MX, wave: ca.MX) -> list[ca.MX]:
    """States, modes, outputs and margins, with a column per column of `path`."""
    points = path.shape[1]
    held = held if held.shape[1] == points else ca.repmat(held, 1, points)
    same = (ca.repmat(value, 1, points) for value in (p, wave))
    return list(pieces.observe.map(points)(times, path, held, *same))
