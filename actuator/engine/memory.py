# pyright: reportRedeclaration=false, reportAttributeAccessIssue=false, reportArgumentType=false, reportCallIssue=false
"""How kernels are compiled, and the few helpers that touch addresses: everything else sees arrays.

A run has one table of whole numbers (`layout`): addresses of the model's functions, counts, and an address and a length
for each of its vectors. With NUMBA_DISABLE_JIT=1 all kernels run as plain Python, some thousand times slower.
"""

import contextlib
import ctypes
import hashlib
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, njit, types
from numba.core import caching, cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from actuator.engine.layout import MULTIPLY
from actuator.lowering.machine import cache_folder

COMPILED = not config.DISABLE_JIT
# products and sums may be fused; a division by zero gives infinity
OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": {"contract"}, "error_model": "numpy"}
LEVEL = 1  # of LLVM's optimization: 2 and 3 compile half as long again, for kernels that are 3 % faster
INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def kernel(function: Callable) -> Callable:
    """A function that only other kernels call."""
    return njit(**OPTIONS, **INNER)(function)


class _Locator(caching._CacheLocator):  # noqa: SLF001 - the only way to say what a kernel depends on
    """Compiled kernels stand in the same folder as models, and are stale where any file of the engine has changed."""

    def __init__(self, function: Callable, file: str) -> None:
        self._name = function.__qualname__

    def get_cache_path(self) -> str:  # noqa: D102
        return str(cache_folder() / "kernels")

    def get_source_stamp(self) -> str:  # noqa: D102
        texts = [path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py"))]
        return hashlib.sha256(b"".join(texts)).hexdigest()

    def get_disambiguator(self) -> str:  # noqa: D102
        return self.get_source_stamp()[:16]

    @classmethod
    def from_function(cls, function: Callable, file: str) -> "_Locator | None":  # noqa: D102
        locator = cls(function, file)
        try:
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator


class _Implementation(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012 - as numba has it


class _Cache(caching.FunctionCache):
    _impl_class = _Implementation


def entry(signature: str) -> Callable[[Callable], Callable]:
    """A kernel that Python calls: compiled at its first call, or loaded from where they are kept."""

    def decorated(function: Callable) -> Callable:
        if not COMPILED:
            return function
        dispatcher = njit(**OPTIONS)(function)
        lock = threading.Lock()

        def run(*arguments: Any) -> Any:
            if not dispatcher.signatures:
                with lock:
                    if not dispatcher.signatures:
                        with contextlib.suppress(RuntimeError, OSError):  # no place to keep anything
                            setattr(dispatcher, "_cache", _Cache(function))  # noqa: B010 - numba has no other way
                        usual, config.OPT = config.OPT, LEVEL
                        try:
                            dispatcher.compile(signature)
                        finally:
                            config.OPT = usual
            return dispatcher(*arguments)

        return run

    return decorated


if COMPILED:
    _DOUBLE = ir.DoubleType().as_pointer()
    _VECTOR, _MATRIX = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")

    def _loaded(context, builder, table, w, k):
        """The entry k of the table."""
        entries = make_array(table)(context, builder, w).data
        return builder.load(builder.gep(entries, [k]))

    def _array(context, builder, kind, address, shape):
        """An array of numbers at an address, that owns nothing."""
        array, size = make_array(kind)(context, builder), context.get_constant(types.intp, 8)
        strides = [size] if len(shape) == 1 else [builder.mul(size, shape[1]), size]
        data = builder.inttoptr(address, _DOUBLE)
        populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
        return array._getvalue()

    def _pointers(context, builder, kinds, values):
        return [make_array(kind)(context, builder, value).data for kind, value in zip(kinds, values, strict=True)]

    @intrinsic
    def vec(typing, w, k):
        """The vector k of the table, as an array that owns nothing."""

        def code(context, builder, signature, args):
            table, place = args
            length = builder.add(place, context.get_constant(types.intp, 1))
            first, size = (_loaded(context, builder, signature.args[0], table, index) for index in (place, length))
            return _array(context, builder, _VECTOR, first, [size])

        return _VECTOR(w, types.intp), code

    @intrinsic
    def row(typing, w, k, index, size):
        """Row `index` of the vector k, in rows of so many numbers."""

        def code(context, builder, signature, args):
            table, place, number, length = args
            first = _loaded(context, builder, signature.args[0], table, place)
            skipped = builder.mul(builder.mul(number, length), context.get_constant(types.intp, 8))
            return _array(context, builder, _VECTOR, builder.add(first, skipped), [length])

        return _VECTOR(w, types.intp, types.intp, types.intp), code

    @intrinsic
    def square(typing, w, k, index, n):
        """Square matrix `index` of those in the vector k; its first index is the column."""

        def code(context, builder, signature, args):
            table, place, number, n = args
            first = _loaded(context, builder, signature.args[0], table, place)
            size = builder.mul(builder.mul(n, n), context.get_constant(types.intp, 8))
            return _array(context, builder, _MATRIX, builder.add(first, builder.mul(number, size)), [n, n])

        return _MATRIX(w, types.intp, types.intp, types.intp), code

    @intrinsic
    def call(typing, w, k, arrays):
        """Call function k of the model with the places of its arguments and results."""

        def code(context, builder, signature, args):
            given = _pointers(context, builder, tuple(signature.args[2]), cgutils.unpack_tuple(builder, args[2]))
            kind = ir.FunctionType(ir.VoidType(), [_DOUBLE] * len(given))
            address = _loaded(context, builder, signature.args[0], *args[:2])
            builder.call(builder.inttoptr(address, kind.as_pointer()), given)
            return context.get_dummy_value()

        return types.void(w, types.intp, arrays), code

    @intrinsic
    def multiply(typing, w, a, v, s, y, o):
        """Makes o = y + s a v, with the square matrix a by columns; o may be y or v."""

        def code(context, builder, signature, args):
            kinds = [signature.args[k] for k in (1, 2, 4, 5)]
            a, v, y, o = _pointers(context, builder, kinds, [*args[1:3], *args[4:]])
            kind = ir.FunctionType(ir.VoidType(), [_DOUBLE, _DOUBLE, ir.DoubleType(), _DOUBLE, _DOUBLE])
            index = context.get_constant(types.intp, MULTIPLY)
            address = _loaded(context, builder, signature.args[0], args[0], index)
            builder.call(builder.inttoptr(address, kind.as_pointer()), [a, v, args[3], y, o])
            return context.get_dummy_value()

        return types.void(w, a, v, types.float64, y, o), code

    @intrinsic
    def copy(typing, target, source):
        """As many entries of one array into another as that has."""

        def code(context, builder, signature, args):
            to, given = _pointers(context, builder, signature.args, args)
            count = make_array(signature.args[0])(context, builder, args[0]).nitems
            cgutils.raw_memcpy(builder, to, given, count, context.get_constant(types.intp, 8))
            return context.get_dummy_value()

        return types.void(target, source), code

    @intrinsic
    def clear(typing, target):
        """All entries zero."""

        def code(context, builder, signature, args):
            array = make_array(signature.args[0])(context, builder, args[0])
            size = builder.mul(array.nitems, context.get_constant(types.intp, 8))
            cgutils.memset(builder, array.data, size, 0)
            return context.get_dummy_value()

        return types.void(target), code

else:

    def _at(address: int, length: int) -> np.ndarray:
        return np.frombuffer((ctypes.c_double * int(length)).from_address(int(address)))

    def vec(w: np.ndarray, k: int) -> np.ndarray:
        """The vector k of the table."""
        return _at(w[k], w[k + 1])

    def row(w: np.ndarray, k: int, index: int, size: int) -> np.ndarray:
        """Row `index` of the vector k, in rows of so many numbers."""
        return _at(w[k] + 8 * size * index, size)

    def square(w: np.ndarray, k: int, index: int, n: int) -> np.ndarray:
        """Square matrix `index` of those in the vector k; its first index is the column."""
        return _at(w[k] + 8 * n * n * index, n * n).reshape(int(n), int(n))

    def call(w: np.ndarray, k: int, arrays: tuple) -> None:
        """Call function k of the model with the places of its arguments and results."""
        pointers = [array.ctypes.data for array in arrays]
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(pointers))(int(w[k]))(*pointers)

    def multiply(w: np.ndarray, a: np.ndarray, v: np.ndarray, s: float, y: np.ndarray, o: np.ndarray) -> None:  # noqa: PLR0913, PLR0917
        """O = y + s a v, with the square matrix a by columns; o may be y or v."""
        kinds = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
        first, second, third, fourth = (array.ctypes.data for array in (a, v, y, o))
        ctypes.CFUNCTYPE(None, *kinds)(int(w[MULTIPLY]))(first, second, s, third, fourth)

    def copy(target: np.ndarray, source: np.ndarray) -> None:
        """The entries of one array into another."""
        target[:] = source[: target.size]

    def clear(target: np.ndarray) -> None:
        """All entries zero."""
        target[:] = 0.0
