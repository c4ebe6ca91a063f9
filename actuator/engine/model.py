"""A HybridSystem as the engine calls it: its functions as machine code, with what depends on the mode alone taken out.

prepare(p, m) -> d        everything that depends on parameters and modes alone, once per mode
flow(x, h, u, d) -> f     of the moving states x, with h held
both(x, h, u, d) -> f, g  and the margins
jacobian(x, h, u, d)      df/dx
reset, tick, outputs      of the system
"""

from functools import lru_cache

import casadi as ca
import numpy as np

from actuator.engine.layout import FUNCTIONS, Sizes
from actuator.engine.observe import along
from actuator.lowering.function import module
from actuator.lowering.machine import Library
from actuator.system.hybrid import HybridSystem

EXACT = ("reset", "tick")  # cancellations are meant there: a decision may hang on the last bit


@lru_cache(maxsize=64)
def model(system: HybridSystem) -> "Model":
    """The machine code of a system, made once."""
    return Model(system)


class Model:
    """A system's functions in memory.

    Attributes
    ----------
    sizes : Sizes
        Of its vectors; nw, the number of sine waves, is zero here.
    addresses : list of int
        Of FUNCTIONS; zero for one that the system does not have.
    nominal : ndarray, (n,)
        Usual sizes of the moving states.
    slip_modes : ndarray, (2, nk)
        Index of each contact's mode of motion, and of its flank or -1.
    """

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        n, whole = system.moving, len(system.states)
        x, h, m, u, p = (
            ca.SX.sym(name, size)
            for name, size in zip(
                "xhmup", (n, whole - n, len(system.modes), len(system.inputs), len(system.parameters)), strict=True
            )
        )
        state = ca.vertcat(x, h)
        (f, g), names, values = ca.extract_parametric(
            [system.flow(state, m, u, p)[:n], system.margins(state, m, u, p)], ca.vertcat(p, m)
        )
        d, given = ca.vertcat(p, m, *names), ca.vertcat(p, m, *values)
        arguments = [x, h, u, d]
        fired = ca.SX.sym("fired", len(system.margin_names))
        y = system.outputs_function(state, m, u, p)
        functions = [
            _function("prepare", [p, m], [given]),
            _function("flow", arguments, [f]),
            _function("both", arguments, [f, g]),
            _function("jacobian", arguments, [ca.jacobian(f, x)]),
            _function("reset", [fired, state, m, u, p], _expanded(system.reset, fired, state, m, u, p)),
            _function("outputs", [state, m, u, p], [y]),
            _function("margins", [state, m, u, p], [system.margins(state, m, u, p)]),
        ]
        due = ca.SX.sym("due", len(system.clocks))
        if system.tick is not None:
            functions.append(_function("tick", [due, state, m, u, p], _expanded(system.tick, due, state, m, u, p)))
        self.library = Library(module(functions, EXACT) + _multiply(n))
        made = {"multiply", *(function.name() for function in functions)}
        self.addresses = [self.library.address(name) if name in made else 0 for name in FUNCTIONS]
        self.nominal = np.array([quantity.nominal for quantity in system.states[:n]])
        index = {name: k for k, name in enumerate(system.modes)}
        contacts = system.contacts if system.contact_state is not None else ()
        flanks = [-1 if contact.flank is None else index[contact.flank] for contact in contacts]
        self.slip_modes = np.array([[index[contact.motion] for contact in contacts], flanks], float)
        speeds = system.contact_state(state, m, u, p)[0] if system.contact_state is not None else ca.SX(0, 1)
        rows = ca.jacobian(speeds, x)
        self._slip = ca.Function("slip", [p], [ca.densify(ca.substitute(rows, state, 0 * state))])
        self.sizes = Sizes(
            n=n,
            nh=whole - n,
            nm=len(system.modes),
            nu=len(system.inputs),
            np=len(system.parameters),
            ng=g.numel(),
            nc=len(system.clocks),
            nd=d.numel(),
            nw=0,
            nk=len(contacts),
        )

    def along(self, name: str, states: np.ndarray, modes: np.ndarray, inputs: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs or margins at many points, all in rows."""
        size = {"outputs": len(self.system.outputs), "margins": self.sizes.ng}[name]
        return along(self.library.address(name), size, states, modes, inputs, p)

    def slip(self, p: np.ndarray) -> np.ndarray:
        """Slip speed of each contact per moving state, (nk, n)."""
        return self._slip(p).full() if self.sizes.nk else np.zeros((0, self.sizes.n))


def _function(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    given, found = [f"given{k}" for k in range(len(arguments))], [f"found{k}" for k in range(len(results))]
    return ca.Function(name, arguments, [ca.densify(value) for value in results], given, found, {"cse": True})


def _expanded(function: ca.Function, *arguments: ca.SX) -> list[ca.SX]:
    """The results as SX; functions inside that are never inlined stay calls."""
    inner = function if function.is_a("SXFunction") else function.expand()
    return inner.call(list(arguments), True, False)


def _multiply(n: int) -> str:
    """multiply(A, v, s, y, o): o = y + s A v, A of n by n by columns, in vectors of n; o may be v or y."""
    vector = f"<{n} x double>"
    lines = ["define void @multiply(ptr %A, ptr %v, double %s, ptr %y, ptr %o) nounwind {"]

    def spread(name: str, value: str) -> None:
        lines.append(f"  %{name}.one = insertelement {vector} poison, double {value}, i64 0")
        lines.append(f"  %{name} = shufflevector {vector} %{name}.one, {vector} poison, <{n} x i32> zeroinitializer")

    total = "zeroinitializer"
    for k in range(n):
        lines += [f"  %at{k} = getelementptr double, ptr %v, i64 {k}", f"  %entry{k} = load double, ptr %at{k}"]
        spread(f"all{k}", f"%entry{k}")
        lines += [
            f"  %place{k} = getelementptr double, ptr %A, i64 {k * n}",
            f"  %column{k} = load {vector}, ptr %place{k}, align 8",
            f"  %part{k} = fmul contract {vector} %column{k}, %all{k}",
            f"  %total{k} = fadd contract {vector} {total}, %part{k}",
        ]
        total = f"%total{k}"
    spread("scale", "%s")
    lines += [
        f"  %before = load {vector}, ptr %y, align 8",
        f"  %scaled = fmul contract {vector} {total}, %scale",
        f"  %result = fadd contract {vector} %before, %scaled",
        f"  store {vector} %result, ptr %o, align 8",
        "  ret void",
        "}",
    ]
    return "\n" + "\n".join(lines) + "\n"
