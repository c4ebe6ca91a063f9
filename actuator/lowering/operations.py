"""What each operation of CasADi is in LLVM's language: a table, one line an operation, and the list of refusals.

A truth is a number in CasADi, zero for false and anything else, NaN too, for true; each rule agrees with CasADi's own
interpreter on zeros of both signs, infinities and NaN.
"""

import struct
from collections.abc import Callable
from typing import Protocol


class Code(Protocol):
    """The function that is being written."""

    @property
    def fused(self) -> str:
        """The flag of LLVM under which a product and a sum may become one operation; empty where they may not."""
        ...

    def let(self, text: str) -> str:
        """Give a new name to the result of an instruction."""
        ...

    def call(self, name: str, *arguments: str) -> str:
        """The result of a function of numbers known to LLVM or to the C library."""
        ...


Rule = Callable[..., str]  # (code, operands) -> the name of the result


def number(value: float) -> str:
    """A constant, to the last bit."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


ZERO, ONE = number(0.0), number(1.0)


def _arithmetic(instruction: str) -> Rule:
    return lambda code, a, b: code.let(f"{instruction} {code.fused}double {a}, {b}")


def _function(name: str) -> Rule:
    return lambda code, *operands: code.call(name, *operands)


def _comparison(condition: str) -> Rule:
    return lambda code, a, b: _number_of(code, code.let(f"fcmp {condition} double {a}, {b}"))


def _logic(instruction: str) -> Rule:
    return lambda code, a, b: _number_of(code, code.let(f"{instruction} i1 {_truth(code, a)}, {_truth(code, b)}"))


def _truth(code: Code, a: str) -> str:
    return code.let(f"fcmp une double {a}, {ZERO}")


def _number_of(code: Code, bit: str) -> str:
    return code.let(f"select i1 {bit}, double {ONE}, double {ZERO}")


def _sign(code: Code, a: str) -> str:
    """A zero keeps its sign, and NaN is NaN."""
    up, down = (code.let(f"fcmp {condition} double {a}, {ZERO}") for condition in ("ogt", "olt"))
    below = code.let(f"select i1 {down}, double {number(-1.0)}, double {a}")
    return code.let(f"select i1 {up}, double {ONE}, double {below}")


def _extreme(condition: str) -> Rule:
    """The smaller or larger of two; a NaN loses against any number, and of two zeros the first is taken."""

    def rule(code: Code, a: str, b: str) -> str:
        other = code.let(f"fcmp {condition} double {b}, {a}")
        chosen = code.let(f"select i1 {other}, double {b}, double {a}")
        return code.let(f"select i1 {code.let(f'fcmp uno double {a}, {a}')}, double {b}, double {chosen}")

    return rule


RULES: dict[str, Rule] = {
    "OP_ASSIGN": lambda code, a: a,
    "OP_ADD": _arithmetic("fadd"),
    "OP_SUB": _arithmetic("fsub"),
    "OP_MUL": _arithmetic("fmul"),
    "OP_DIV": _arithmetic("fdiv"),
    "OP_NEG": lambda code, a: code.let(f"fneg double {a}"),
    "OP_SQ": lambda code, a: code.let(f"fmul {code.fused}double {a}, {a}"),
    "OP_TWICE": lambda code, a: code.let(f"fadd {code.fused}double {a}, {a}"),
    "OP_INV": lambda code, a: code.let(f"fdiv {code.fused}double {ONE}, {a}"),
    "OP_SQRT": _function("llvm.sqrt.f64"),
    "OP_FABS": _function("llvm.fabs.f64"),
    "OP_FLOOR": _function("llvm.floor.f64"),
    "OP_CEIL": _function("llvm.ceil.f64"),
    "OP_COPYSIGN": _function("llvm.copysign.f64"),
    "OP_SIGN": _sign,
    "OP_FMIN": _extreme("olt"),
    "OP_FMAX": _extreme("ogt"),
    "OP_EXP": _function("llvm.exp.f64"),
    "OP_LOG": _function("llvm.log.f64"),
    "OP_POW": _function("llvm.pow.f64"),
    "OP_CONSTPOW": _function("llvm.pow.f64"),
    "OP_SIN": _function("llvm.sin.f64"),
    "OP_COS": _function("llvm.cos.f64"),
    "OP_TAN": _function("tan"),
    "OP_ASIN": _function("asin"),
    "OP_ACOS": _function("acos"),
    "OP_ATAN": _function("atan"),
    "OP_ATAN2": _function("atan2"),
    "OP_SINH": _function("sinh"),
    "OP_COSH": _function("cosh"),
    "OP_TANH": _function("tanh"),
    "OP_ASINH": _function("asinh"),
    "OP_ACOSH": _function("acosh"),
    "OP_ATANH": _function("atanh"),
    "OP_ERF": _function("erf"),
    "OP_LOG1P": _function("log1p"),
    "OP_EXPM1": _function("expm1"),
    "OP_HYPOT": _function("hypot"),
    "OP_FMOD": _function("fmod"),
    "OP_REMAINDER": _function("remainder"),
    "OP_LT": _comparison("olt"),
    "OP_LE": _comparison("ole"),
    "OP_EQ": _comparison("oeq"),
    "OP_NE": _comparison("une"),
    "OP_NOT": lambda code, a: _number_of(code, code.let(f"fcmp oeq double {a}, {ZERO}")),
    "OP_AND": _logic("and"),
    "OP_OR": _logic("or"),
    "OP_IF_ELSE_ZERO": lambda code, a, b: code.let(f"select i1 {_truth(code, a)}, double {b}, double {ZERO}"),
}

STRUCTURE = ("OP_CONST", "OP_INPUT", "OP_OUTPUT", "OP_CALL")  # of a function; `function` writes them itself

_MATRICES = """ADDNONZEROS ADDNONZEROS_PARAM BILIN BSPLINE CONVEXIFY DETERMINANT DIAGCAT DIAGSPLIT DOT EINSTEIN FIND
GETNONZEROS GETNONZEROS_PARAM HORZCAT HORZREPMAT HORZREPSUM HORZSPLIT INVERSE KRON KRON_CONTRACT LOGSUMEXP LOW MAP MMAX
MMIN MTIMES NORM1 NORM2 NORMF NORMINF PROJECT RANK1 RESHAPE SETNONZEROS SETNONZEROS_PARAM SOLVE SPARSITY_CAST SUBASSIGN
SUBREF TRANSPOSE VERTCAT VERTSPLIT""".split()
REFUSED: dict[str, str] = {
    **{f"OP_{name}": "works on matrices: expand the function to SX first" for name in _MATRICES},
    "OP_PARAMETER": "is a symbol that is no input of the function",
    "OP_ERFINV": "is CasADi's own approximation, which no library has",
    "OP_LIFT": "tells solvers something and computes nothing",
    "OP_PRINTME": "prints",
    "OP_MONITOR": "prints",
    "OP_DUMP": "writes files",
    "OP_ASSERTION": "raises, which machine code cannot",
}
