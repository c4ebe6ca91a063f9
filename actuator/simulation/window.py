"""One window of integration as a single CasADi function, with its output points.

A window of many ticks of sampled controllers is one function too: tick, decision of the modes where it needs one,
integration, and so on.
"""

import casadi as ca

from actuator.simulation.input_form import InputForm
from actuator.simulation.integration import integration, observed
from actuator.simulation.mode_code import LOG_SLOTS, ModeCode
from actuator.system.hybrid import HybridSystem

INTERVALS = 200  # output intervals of one window
VIOLATION = 1e-9  # a margin below minus this is a missed event, not rounding


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
    pieces = integration(system, form, code, tolerance, fine, {"step0": 1 / fine})
    moving = system.moving
    x, m, p, period, wave = _window_inputs(system, form)
    derived, due = ca.MX.sym("derived", pieces.derived.size1_out(0)), ca.MX.sym("due", len(system.clocks))
    start, broken = ca.MX.sym("start"), ca.MX.sym("broken")
    u = form.function()(start, wave)
    x1, m1, fault = _settle_where_needed(system)(x, system.tick(due, x, m, u, p), m, u, p)
    fault = ca.fmax(ca.fmax(fault, broken), due[0] < 0)
    path = pieces.between(x1, m1, p, derived, period * (1 - fault), start, wave)
    states, codes, events, *_ = pieces.log.split(path[:, -1])
    nominal = ca.DM([state.nominal for state in system.states[:moving]])
    one = ca.Function(
        "one_tick",
        [x, m, broken, p, derived, due, period, start, wave],
        [
            ca.vertcat(states * nominal, x1[moving:, :]),
            code.unpack_function()(codes),
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
    seen = observed(pieces, times, path[:, columns], held[:, ticks], p, wave)
    log = pieces.log.told(path)
    return ca.Function("ticks", [x, m, p, schedule, period, wave], [*seen, log, faults, ends, end_modes])


def _window_inputs(system: HybridSystem, form: InputForm) -> list[ca.MX]:
    sizes = {"x": len(system.states), "m": len(system.modes), "p": len(system.parameters), "length": 1}
    return [ca.MX.sym(name, size) for name, size in (sizes | {"wave": form.size}).items()]


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
