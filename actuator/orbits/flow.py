"""The motion of a system in fixed modes as a function, with exact derivatives.

What the engine does in one integration is taken apart here: in each smooth segment the modes are fixed and known, so
the integrator needs no events. The flow may have switching surfaces inside a mode: limits that are met, damping that is
cut off, tables with straight pieces. An integrator that steps over one gives the state well and its derivatives badly.
So they are read off the expressions themselves: fmax(a, b), fmin(a, b) and a condition a < b have one where a - b is
zero, fabs(a) and sign(a) where a is. With each of them held on one side, by a number of its own, the expressions are
smooth, and the sides are held like the modes.
"""

import contextlib
import io
from collections.abc import Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator.simulation.compiled import compiled_where_wanted
from actuator.system.hybrid import MARGIN_BAND, HybridSystem

ORDERS = {ca.OP_FMAX, ca.OP_FMIN, ca.OP_LT, ca.OP_LE}
SIZES = {ca.OP_FABS, ca.OP_SIGN}
TOLERANCE = 1e-10  # local error of each state over its nominal size
FINEST_RELATIVE = 1e-13  # relative tolerance below which an integrator counts rounding
BLOCK = 4  # directions differentiated at once; compiling takes as long as there are directions
POINTS = 200  # output points of a segment
GRID = np.linspace(0, 1, POINTS + 1) ** 3  # parts of a segment; it starts with the fast transients


class Smooth(NamedTuple):
    """Expressions of (x, m, u, p) with their switching surfaces held."""

    arguments: list[ca.SX]  # x, m, u, p
    sides: ca.SX  # (K, 1): +1 or -1, the side of each surface
    results: list[ca.SX]  # smooth while the sides are held
    surfaces: ca.SX  # (K, 1): zero on the surface, with the sign of the side; with the others held
    true_surfaces: ca.SX  # (K, 1): with nothing held


def hold_surfaces(function: ca.Function) -> Smooth:
    """The results of an SX function of (x, m, u, p) with every switching surface in x held on one side."""
    arguments = [ca.SX.sym(name, function.size1_in(k)) for k, name in enumerate("xmup")]
    _, true = _walk(function, arguments, None)
    sides = ca.SX.sym("sides", len(true))
    results, held = _walk(function, arguments, sides)
    return Smooth(arguments, sides, results, *(ca.vertcat(ca.SX(0, 1), *parts) for parts in (held, true)))


def _walk(function: ca.Function, arguments: list[ca.SX], sides: ca.SX | None) -> tuple[list[ca.SX], list[ca.SX]]:
    """Results of the function and its surfaces, operation by operation; `sides` None for nothing held."""
    entries = [ca.vertsplit(argument) for argument in arguments]
    results = [ca.SX(function.sparsity_out(k)) for k in range(function.n_out())]
    work: dict[int, ca.SX] = {}
    surfaces: list[ca.SX] = []
    for k in range(function.n_instructions()):
        operation, read, written = (
            function.instruction_id(k),
            function.instruction_input(k),
            function.instruction_output(k),
        )
        if operation == ca.OP_INPUT:
            work[written[0]] = entries[read[0]][read[1]]
        elif operation == ca.OP_CONST:
            work[written[0]] = ca.SX(function.instruction_constant(k))
        elif operation == ca.OP_OUTPUT:
            results[written[0]].nz[written[1]] = work[read[0]]
        else:
            values = [work[index] for index in read]
            surface = values[0] - values[1] if operation in ORDERS else values[0] if operation in SIZES else None
            if surface is not None and ca.depends_on(surface, arguments[0]):
                surfaces.append(surface)
                if sides is not None:
                    work[written[0]] = _one_side(operation, values, sides[len(surfaces) - 1] > 0)
                    continue
            work[written[0]] = (ca.SX.unary if len(values) == 1 else ca.SX.binary)(operation, *values)
    return results, surfaces


def _one_side(operation: int, values: list[ca.SX], above: ca.SX) -> ca.SX:
    """The operation on one side of its surface."""
    if operation == ca.OP_FMAX:
        return ca.if_else(above, values[0], values[1])
    if operation == ca.OP_FMIN:
        return ca.if_else(above, values[1], values[0])
    if operation == ca.OP_FABS:
        return ca.if_else(above, values[0], -values[0])
    return 2 * above - 1 if operation == ca.OP_SIGN else 1 - above


class NoOrbit(RuntimeError):
    """No periodic orbit was found; the message says where the search ended, with numbers."""


@lru_cache(maxsize=16)
def flow_map(system: HybridSystem, tolerance: float = TOLERANCE, compiled: bool | None = None) -> "FlowMap":
    """The flow map of a system, built once."""
    return FlowMap(system, tolerance, compiled)


class FlowMap:
    """The smooth motion of a system in fixed modes at constant inputs, with what its events need of derivatives.

    Attributes
    ----------
    rows : Function
        (x, modes and sides, u, p) -> margins followed by switching surfaces, their derivatives by x and by p, flow.
    names, events : list of str, int
        Of these rows; how many of them are margins.
    surfaces : Function
        (x, m, u, p) -> the quantities that change sign at the switching surfaces.
    tangent, reset_tangent : Function
        Derivatives of `advance` and of the state after an event in BLOCK directions, for `directional`.
    """

    def __init__(self, system: HybridSystem, tolerance: float, compiled: bool | None) -> None:
        self.system, self.tolerance, self.compiled = system, tolerance, compiled
        self.nominal = np.array([state.nominal for state in system.states])
        self.nx, self.grid = len(system.states), GRID
        x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(k)) for k, name in enumerate("xmup"))
        both = [system.flow(x, m, u, p), system.margins(x, m, u, p) - MARGIN_BAND]
        smooth = hold_surfaces(ca.Function("both", [x, m, u, p], both, {"cse": True}))
        x, m, u, p = smooth.arguments
        held = [x, ca.vertcat(m, smooth.sides), u, p]
        fast = partial(_fast, compiled=compiled)
        end = self._segment("segment", ca.Function("smooth", held, smooth.results[:1]), [1.0], {})
        self._end = fast(end)
        self.tangent = fast(end.forward(BLOCK))
        self._path = fast(self._segment("path", system.flow, list(GRID[1:]), {"max_step_size": 2 / POINTS}))
        rows = ca.vertcat(smooth.results[1], smooth.surfaces)
        self.rows = ca.Function(
            "rows", held, [rows, ca.jacobian(rows, x), ca.jacobian(rows, p), smooth.results[0]], {"cse": True}
        )
        self.surfaces = ca.Function("surfaces", [x, m, u, p], [smooth.true_surfaces])
        self.names = [*system.margin_names, *(f"switching surface {k}" for k in range(smooth.sides.shape[0]))]
        self.events = len(system.margin_names)
        # the decision of the modes has no derivative: only what leads to the state after it is kept
        given = [ca.MX.sym(f"given{k}", system.reset.size1_in(k)) for k in range(system.reset.n_in())]
        after = ca.Function("after", given, system.reset.call(given, True, False)[:1])
        self.reset_tangent = fast(after.forward(BLOCK))
        names = system.modes
        self._free = [(names.index(c.motion), names.index(c.flank)) for c in system.contacts if c.flank]

    def _segment(self, name: str, flow: ca.Function, grid: list[float], options: dict) -> ca.Function:
        """(x, m, u, p, duration) -> states at the parts `grid` of the duration, in fixed modes."""
        nominal = ca.DM(self.nominal)
        sizes = [flow.size1_in(k) for k in (3, 1, 2)]
        y, length, given = ca.SX.sym("y", self.nx), ca.SX.sym("length"), ca.SX.sym("given", sum(sizes))
        p, m, u = ca.vertsplit(given, [0, *(int(k) for k in np.cumsum(sizes))])
        # what does not depend on the state is worked out once, not in every stage
        (rate,), names, derived = ca.extract_parametric([flow(y * nominal, m, u, p)], given)
        once = ca.Function("once", [given], [ca.vertcat(*derived)])
        dae = {"x": y, "p": ca.vertcat(length, given, *names), "ode": length * rate / nominal}
        settings = {"abstol": self.tolerance, "reltol": max(1e-3 * self.tolerance, FINEST_RELATIVE)} | options
        integrator = ca.integrator("integrator", "rosenbrock", dae, 0, grid, settings)
        x, modes, inputs, parameters = (
            ca.MX.sym(letter, size) for letter, size in zip("xmup", (self.nx, *sizes[1:], sizes[0]), strict=True)
        )
        duration, held = ca.MX.sym("duration"), ca.vertcat(parameters, modes, inputs)
        states = integrator(x0=x / nominal, p=ca.vertcat(duration, held, once(held)))["xf"]
        return ca.Function(name, [x, modes, inputs, parameters, duration], [states * ca.repmat(nominal, 1, len(grid))])

    def advance(self, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray, duration: float) -> np.ndarray:
        """State after `duration` in the modes and sides m."""
        return self._call(self._end, x, m, u, p, duration).ravel()

    def path(self, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray, duration: float) -> np.ndarray:
        """States on POINTS + 1 output points, (nx, POINTS + 1)."""
        return np.column_stack([x, self._call(self._path, x, m, u, p, duration)])

    def _call(self, function: ca.Function, *arguments: object) -> np.ndarray:
        try:
            # CasADi's own words are not wanted
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                return np.asarray(function(*arguments))
        except RuntimeError as error:
            raise NoOrbit(
                f"{self.system.name}: a segment of {arguments[-1]:.9g} s cannot be integrated to a tolerance of "
                f"{self.tolerance:g}: {str(error).strip().splitlines()[-1]}"
            ) from error

    def integer_modes(self, m: Sequence[float] | np.ndarray) -> tuple[int, ...]:
        """Modes as integers; a mesh in its gap has no motion of its own, and what rounding says of it is dropped."""
        modes = [round(float(mode)) for mode in m]
        for motion, flank in self._free:
            modes[motion] *= abs(modes[flank])
        return tuple(modes)

    def rate(self, x: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """The flow."""
        return self.system.flow(x, m, u, p).full().ravel()


def along(function: ca.Function, path: np.ndarray, m: Sequence[int], u: np.ndarray, p: np.ndarray) -> np.ndarray:
    """A function of (x, m, u, p) on all points of a path in the modes m, a column for each."""
    count = path.shape[1]
    given = (np.tile(np.array(value, float)[:, None], count) for value in (m, u, p))
    return function.map(count)(path, *given).full()


def directional(function: ca.Function, known: list, seeds: list[np.ndarray]) -> np.ndarray:
    """Directional derivatives of the first result of `function`, BLOCK directions at a time."""
    count, found = seeds[0].shape[1], []
    for k in range(0, count, BLOCK):
        part = [np.pad(s[:, k : k + BLOCK], ((0, 0), (0, max(0, k + BLOCK - count)))) for s in seeds]
        result = function(*known, *part)
        found.append((result[0] if isinstance(result, tuple | list) else result).full())
    return np.hstack(found)[:, :count]


def _fast(function: ca.Function, compiled: bool | None) -> ca.Function:
    return compiled_where_wanted(function, compiled) or function
