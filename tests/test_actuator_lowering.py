"""CasADi functions as machine code.

Oracle: CasADi's own interpreter, over ordinary numbers, zeros of both signs, infinities and NaN.
"""

import itertools
import math

import casadi as ca
import numpy as np
import pytest

from actuator.lowering import machine
from actuator.lowering.function import NAMES, module
from actuator.lowering.machine import Library
from actuator.lowering.operations import REFUSED, RULES, STRUCTURE

VALUES = [0.0, -0.0, 1.0, -1.0, 0.3, -0.7, 2.5, -3.0, 7.0, 1e-3, 1e9, -1e-300, math.inf, -math.inf, math.nan]
UNITS_IN_LAST_PLACE = 2  # the C library of CasADi's build and the one at hand may differ by that


def compiled(function, exact=()):
    """The function as Python calls it: arrays to arrays."""
    library = Library(module([function], exact))
    call = library.function(function.name(), function.n_in() + function.n_out())

    def run(*arguments):
        given = [np.ascontiguousarray(np.asarray(value, float).ravel(order="F")) for value in arguments]
        results = [np.full(function.numel_out(k), 77.0) for k in range(function.n_out())]
        call(*(array.ctypes.data for array in (*given, *results)))
        return [r.reshape(function.size_out(k), order="F") for k, r in enumerate(results)]

    run.library = library
    return run


@pytest.fixture(autouse=True)
def own_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("ACTUATOR_CACHE", str(tmp_path / "cache"))


def expression(name, x, y):
    """The operation on symbols, as CasADi itself makes it."""
    code = getattr(ca, name)
    for make in (lambda: ca.SX.unary(code, x), lambda: ca.SX.binary(code, x, y)):
        try:
            return make()
        except Exception:  # noqa: BLE001, S112 - CasADi says in many ways that it has no such operation
            continue
    raise AssertionError(name)


@pytest.mark.parametrize("name", sorted(RULES))
def test_every_rule_agrees_with_the_interpreter(name):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    function = ca.Function("f", [x, y], [expression(name, x, y)])
    run = compiled(function)
    for a, b in itertools.product(VALUES, repeat=2):
        expected, found = float(function(a, b)), float(run(a, b)[0].item())
        if math.isnan(expected):
            assert math.isnan(found), (a, b)
        elif not math.isfinite(expected) or expected == 0:
            assert found == expected and math.copysign(1, found) == math.copysign(1, expected), (a, b)
        else:
            assert abs(found - expected) <= UNITS_IN_LAST_PLACE * np.spacing(abs(expected)), (a, b)


def test_every_operation_of_casadi_has_a_rule_or_a_refusal_and_not_both():
    known = [*RULES, *REFUSED, *STRUCTURE]
    assert sorted(known) == sorted(NAMES.values())


def test_an_operation_without_a_rule_is_refused_by_name_and_with_the_reason():
    x = ca.SX.sym("x")
    with pytest.raises(NotImplementedError, match="bell cannot be made machine code: OP_ERFINV is CasADi's own"):
        module([ca.Function("bell", [x], [ca.erfinv(x)])])


def test_matrices_sparse_and_dense_come_in_by_columns():
    x, y = ca.SX.sym("x", 3, 2), ca.SX.sym("y", ca.Sparsity.lower(3))
    function = ca.Function("f", [x, y], [y @ x, ca.diag(x[:, 0]), ca.SX(2, 2)])
    a, b = np.arange(6.0).reshape(3, 2), np.tril(np.arange(1.0, 10.0).reshape(3, 3))
    for found, expected in zip(compiled(function)(a, b), function(a, b), strict=True):
        np.testing.assert_array_equal(found, ca.DM(expected).full())


def test_functions_that_are_never_inlined_are_called_also_from_each_other():
    x, y = ca.SX.sym("x", 2), ca.SX.sym("y")
    deep = ca.Function("deep", [x, y], [ca.sin(x) * y, ca.dot(x, x)], {"never_inline": True})
    X, Y = ca.MX.sym("X", 2), ca.MX.sym("Y")
    first, second = deep(X, Y)
    mean = ca.Function("mean", [x, y], list(map(ca.SX, deep(x / 2, y + 1))), {"never_inline": True})
    middle = ca.Function("middle", [X, Y], [first + second, deep(first, second)[1] + mean(X, Y)[1]])
    a, b = middle(X, 2 * Y)
    c, d = middle(a, b)
    outer = ca.Function("outer", [X, Y], [ca.vertcat(a, b), c, d])
    expanded = outer.expand()
    text = module([expanded])
    assert text.count("define internal void") == 3  # deep, mean and the deep inside it
    for found, expected in zip(compiled(expanded)([0.3, -1.2], 0.7), outer([0.3, -1.2], 0.7), strict=True):
        np.testing.assert_allclose(found, ca.DM(expected).full(), rtol=1e-15)


def test_a_function_of_matrices_that_is_never_inlined_is_refused():
    x = ca.MX.sym("x", 2)
    inner = ca.Function("inner", [x], [x + 1], {"never_inline": True})
    with pytest.raises(NotImplementedError, match="inner works on matrices"):
        module([ca.Function("outer", [x], [inner(x)])])


def test_exact_functions_round_like_the_interpreter():
    x = ca.SX.sym("x", 3)
    function = ca.Function("f", [x], [x[0] * x[1] + x[2]])
    draws = np.random.default_rng(1).standard_normal((100, 3)) * [1, 1, -1]
    draws[:, 2] = -draws[:, 0] * draws[:, 1]  # all that is left is rounding: exactly none
    run = compiled(function, exact=["f"])
    assert all(run(row)[0].item() == float(function(row)) == 0 for row in draws)


def test_the_text_names_its_inputs_and_is_verified():
    x = ca.SX.sym("x")
    text = module([ca.Function("f", [x], [x + 1], ["speed"], ["torque"])])
    assert "%in.speed" in text and "%out.torque" in text
    with pytest.raises(RuntimeError, match="double"):
        machine.compile_text(text.replace("fadd contract double", "fadd contract i64"))


def test_objects_are_kept_by_content_and_a_damaged_one_is_made_anew(monkeypatch):
    x = ca.SX.sym("x")
    function, made = ca.Function("f", [x], [x + 1]), []
    original = machine.compile_text
    monkeypatch.setattr(machine, "compile_text", lambda text: made.append(1) or original(text))
    assert compiled(function)(1.0)[0] == 2
    assert compiled(function)(1.0)[0] == 2
    assert len(made) == 1
    (kept,) = machine.cache_folder().iterdir()
    kept.write_bytes(kept.read_bytes()[:100] + b"x" + kept.read_bytes()[101:])
    assert compiled(function)(1.0)[0] == 2
    assert len(made) == 2


def test_where_nothing_can_be_kept_it_goes_on_without(monkeypatch, tmp_path, caplog):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ACTUATOR_CACHE", str(tmp_path / "file"))
    machine._say_once.cache_clear()
    x = ca.SX.sym("x")
    assert compiled(ca.Function("f", [x], [x + 1]))(1.0)[0] == 2
    assert "cannot be kept" in caplog.text


def test_an_unknown_function_is_no_address_zero():
    x = ca.SX.sym("x")
    with pytest.raises(KeyError, match="no function 'g'"):
        compiled(ca.Function("f", [x], [x])).library.address("g")
