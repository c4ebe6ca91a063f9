"""A CasADi function as text in LLVM's language: inputs, a loop over its instructions, outputs, calls inside.

    void name(double* in0, ..., double* out0, ...)        all dense, by columns; outputs may not overlap inputs

Inner functions that CasADi keeps as calls (`never_inline`) are calls here, too, through places on the stack.
"""

from collections.abc import Iterable

import casadi as ca

from actuator.lowering.operations import REFUSED, RULES, number

NAMES = {getattr(ca, name): name for name in dir(ca) if name.startswith("OP_")}


def module(functions: Iterable[ca.Function], exact: Iterable[str] = ()) -> str:
    """The text of a module with these functions, under their own names.

    Parameters
    ----------
    functions : iterable of casadi.Function
        SX functions, or such as expand to one.
    exact : iterable of str
        Names of functions whose products and sums are rounded one by one, as CasADi's interpreter does.

    Raises
    ------
    NotImplementedError
        For an operation that cannot be lowered, with its name and the reason.
    """
    texts, declared = [], set()
    for function in functions:
        _write(function, function.name(), "" if function.name() in set(exact) else "contract ", texts, declared)
    return "\n".join(sorted(declared)) + "\n\n" + "\n".join(texts)


class _Function:
    """One function in the making; see `operations.Code`."""

    def __init__(self, name: str, fused: str) -> None:
        self.name, self.fused = name, fused
        self.places: list[str] = []  # on the stack, for calls; made once, at the beginning
        self.lines: list[str] = []
        self.declared: set[str] = set()
        self.inner: dict[str, ca.Function] = {}
        self._count = 0
        self._reserved: dict[tuple[str, int], str] = {}

    def let(self, text: str) -> str:
        self._count += 1
        self.lines.append(f"  %v{self._count} = {text}")
        return f"%v{self._count}"

    def call(self, name: str, *arguments: str) -> str:
        kinds = ", ".join(["double"] * len(arguments))
        self.declared.add(f"declare double @{name}({kinds}) nounwind memory(none)")
        return self.let(f"call {self.fused}double @{name}({', '.join(f'double {value}' for value in arguments)})")

    def element(self, array: str, index: int) -> str:
        """The address of an element."""
        return self.let(f"getelementptr double, ptr {array}, i64 {index}")

    def load(self, array: str, index: int) -> str:
        return self.let(f"load double, ptr {self.element(array, index)}")

    def store(self, value: str, array: str, index: int) -> None:
        self.lines.append(f"  store double {value}, ptr {self.element(array, index)}")

    def place(self, callee: str, argument: int, size: int) -> str:
        """Room on the stack for an argument of an inner function; all calls of it share it."""
        key = callee, argument
        if key not in self._reserved:
            self._reserved[key] = f"%place{len(self._reserved)}"
            self.places.append(f"  {self._reserved[key]} = alloca double, i64 {max(size, 1)}")
        return self._reserved[key]

    def call_inner(self, callee: ca.Function, given: list[str]) -> list[str]:
        """Results of a function of arrays, all entries in a row."""
        name = f"{self.name}.{callee.name()}"
        if not callee.is_a("SXFunction"):
            raise NotImplementedError(f"{name} works on matrices and is never inlined: it cannot be made machine code")
        self.inner[name] = callee
        sizes = [callee.numel_in(k) for k in range(callee.n_in())] + [
            callee.numel_out(k) for k in range(callee.n_out())
        ]
        places = [self.place(name, k, size) for k, size in enumerate(sizes)]
        entries = [(place, k) for place, size in zip(places, sizes, strict=True) for k in range(size)]
        for value, (place, k) in zip(given, entries, strict=False):
            self.store(value, place, k)
        self.lines.append(f"  call void @{name}({', '.join(f'ptr {place}' for place in places)})")
        return [self.load(place, k) for place, k in entries[len(given) :]]

    def text(self, inputs: list[str], outputs: list[str]) -> str:
        readonly = [f"ptr noalias nocapture readonly {name}" for name in inputs]
        written = [f"ptr noalias nocapture {name}" for name in outputs]
        linkage = "internal " if "." in self.name else ""
        return "\n".join(
            [
                f"define {linkage}void @{self.name}({', '.join(readonly + written)}) nounwind {{",
                *self.places,
                *self.lines,
                "  ret void",
                "}\n",
            ]
        )


def _write(function: ca.Function, name: str, fused: str, texts: list[str], declared: set[str]) -> None:
    """Append the text of a function and of those that it calls."""
    function = _dense(function)
    code = _Function(name, fused)
    inputs = [f"%in.{function.name_in(k)}" for k in range(function.n_in())]
    outputs = [f"%out.{function.name_out(k)}" for k in range(function.n_out())]
    work: dict[int, str] = {}
    loaded: dict[tuple[int, int], str] = {}
    has_calls = any(function.instruction_id(k) == ca.OP_CALL for k in range(function.n_instructions()))
    symbols = function.instructions_sx() if has_calls else []
    for k in range(function.n_instructions()):
        operation, read, written = (
            function.instruction_id(k),
            function.instruction_input(k),
            function.instruction_output(k),
        )
        if operation == ca.OP_CONST:
            work[written[0]] = number(function.instruction_constant(k))
        elif operation == ca.OP_INPUT:
            argument, element = read
            if (argument, element) not in loaded:
                loaded[argument, element] = code.load(inputs[argument], element)
            work[written[0]] = loaded[argument, element]
        elif operation == ca.OP_OUTPUT:
            code.store(work[read[0]], outputs[written[0]], written[1])
        elif operation == ca.OP_CALL:
            results = code.call_inner(symbols[k].which_function(), [work[index] for index in read])
            work.update({index: value for index, value in zip(written, results, strict=True) if index >= 0})
        else:
            work[written[0]] = _rule(operation, name)(code, *(work[index] for index in read))
    texts.append(code.text(inputs, outputs))
    declared |= code.declared
    for inner, callee in code.inner.items():
        _write(callee, inner, fused, texts, declared)


def _rule(operation: int, function: str):
    name = NAMES.get(operation, f"operation {operation}")
    if name in RULES:
        return RULES[name]
    reason = REFUSED.get(name, "is unknown here")
    raise NotImplementedError(f"{function} cannot be made machine code: {name} {reason}")


def _dense(function: ca.Function) -> ca.Function:
    """As an SX function, all of whose arguments and results are dense."""
    expanded = function if function.is_a("SXFunction") else function.expand()
    shapes = [expanded.sparsity_in(k) for k in range(expanded.n_in())]
    shapes += [expanded.sparsity_out(k) for k in range(expanded.n_out())]
    if all(shape.is_dense() for shape in shapes):
        return expanded
    arguments = [ca.SX.sym(expanded.name_in(k), *expanded.size_in(k)) for k in range(expanded.n_in())]
    results = [ca.densify(value) for value in expanded.call(arguments, True, False)]
    names = expanded.name_in(), expanded.name_out()
    return ca.Function(expanded.name(), arguments, results, *names)
