"""The joint decision of the contacts as a CasADi function, for all that calls it as one of a model's functions.

It is machine code already. Where there is a C compiler it stands behind a shim in C, so that generated code can call
it; else CasADi calls it through Python. What is decided has no derivative: the modes are whole numbers.
"""

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import casadi as ca
import numba
import numpy as np

from gear.stiction.decision import decide_vector

SHIM = """
typedef void (*kernel)(const double*, double*, long long, long long);
static kernel kernel_in_use;
void {name}_use(kernel given) {{ kernel_in_use = given; }}
int {name}(const double** arg, double** res, long long* iw, double* w, int mem) {{
  kernel_in_use(arg[0], res[0], {shafts}, {count}); return 0;
}}
static const long long before[] = {{{size}, 1, 1}}, after[] = {{{count} + 1, 1, 1}};
long long {name}_n_in(void) {{ return 1; }}
long long {name}_n_out(void) {{ return 1; }}
const long long* {name}_sparsity_in(long long i) {{ return before; }}
const long long* {name}_sparsity_out(long long i) {{ return after; }}
static const long long none[{size} + 3] = {{{count} + 1, {size}}};
int jac_{name}(const double** arg, double** res, long long* iw, double* w, int mem) {{ return 0; }}
long long jac_{name}_n_in(void) {{ return 2; }}
long long jac_{name}_n_out(void) {{ return 1; }}
const long long* jac_{name}_sparsity_in(long long i) {{ return i ? after : before; }}
const long long* jac_{name}_sparsity_out(long long i) {{ return none; }}
"""


@numba.cfunc("void(CPointer(double), CPointer(double), int64, int64)")
def _kernel(problem, result, shafts, count):
    size = shafts * (shafts + 1) + count * (2 * shafts + 5)
    found = numba.carray(result, count + 1)  # type: ignore[attr-defined]
    found[count] = decide_vector(numba.carray(problem, size), shafts, found[:count])  # type: ignore[attr-defined]


@cache
def decision_function(shafts: int, count: int) -> ca.Function:
    """(problem vector) -> motion of each contact, and the fault below."""
    size = shafts * (shafts + 1) + count * (2 * shafts + 5)
    name = f"decide_{shafts}_{count}"
    library = _shim(name, SHIM.format(name=name, shafts=shafts, count=count, size=size))
    if library is not None:
        loaded = ctypes.CDLL(library, ctypes.RTLD_GLOBAL)
        getattr(loaded, f"{name}_use")(ctypes.c_void_p(_kernel.address))
        return ca.external(name, library)
    return _Called(name, shafts, count, size)


class _Called(ca.Callback):
    """The decision, called by CasADi through Python."""

    def __init__(self, name: str, shafts: int, count: int, size: int) -> None:
        ca.Callback.__init__(self)
        self.shafts, self.count, self.size = shafts, count, size
        self.construct(name, {})

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.size)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.count + 1)

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inputs: list[str], outputs: list[str], options: dict) -> ca.Function:
        known = [ca.MX.sym("problem", self.size), ca.MX.sym("decided", self.count + 1)]
        return ca.Function(name, known, [ca.MX(self.count + 1, self.size)], inputs, outputs, options)

    def eval(self, arguments: list[ca.DM]) -> list[ca.DM]:
        result = np.zeros(self.count + 1)
        result[self.count] = decide_vector(arguments[0].full().ravel(), self.shafts, result[: self.count])
        return [ca.DM(result)]


def _shim(name: str, source: str) -> str | None:
    """Path of the compiled shim, or None without a compiler."""
    found = next((path for path in map(shutil.which, ("cc", "gcc", "clang")) if path), None)
    if found is None:
        return None
    key = hashlib.sha256(source.encode()).hexdigest()[:16]
    library = Path(tempfile.gettempdir()) / f"geared-actuator-{os.getuid()}" / f"{name}-{key}.so"
    if not library.exists():
        library.parent.mkdir(mode=0o700, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=library.parent) as work:
            text, target = Path(work) / "shim.c", Path(work) / "shim.so"
            text.write_text(source, encoding="utf-8")
            subprocess.run([found, "-O1", "-fPIC", "-shared", str(text), "-o", str(target)], check=True)
            os.replace(target, library)
    return str(library)
