"""Filters: continuous against control.TransferFunction, sampled against control's Tustin rule and its time response."""

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from oracles import in_symbols, numbers

from controllers import LeadLag, LowPass, Notch, SecondOrderLowPass

# law, its transfer function, the frequency it is exact at
FILTERS = (
    (LowPass(frequency=300.0), control.tf([300.0], [1, 300.0]), 300.0),
    (LowPass(frequency=300.0, prewarp=50.0), control.tf([300.0], [1, 300.0]), 50.0),
    (LeadLag(zero=100.0, pole=900.0), control.tf([1 / 100, 1], [1 / 900, 1]), 300.0),
    (LeadLag(zero=700.0, pole=20.0, prewarp=60.0), control.tf([1 / 700, 1], [1 / 20, 1]), 60.0),
    (
        SecondOrderLowPass(frequency=400.0),
        control.tf([400.0**2], [1, math.sqrt(2) * 400.0, 400.0**2]),
        400.0,
    ),
    (
        SecondOrderLowPass(frequency=400.0, damping=0.1, prewarp=700.0),
        control.tf([400.0**2], [1, 0.2 * 400.0, 400.0**2]),
        700.0,
    ),
    (Notch(frequency=500.0, damping=0.2), control.tf([1, 0, 500.0**2], [1, 200.0, 500.0**2]), 500.0),
    (
        Notch(frequency=500.0, damping=0.5, depth=0.1, prewarp=200.0),
        control.tf([1, 50.0, 500.0**2], [1, 500.0, 500.0**2]),
        200.0,
    ),
)
every_filter = pytest.mark.parametrize(("law", "transfer", "exact"), FILTERS, ids=lambda value: type(value).__name__)
PERIOD = 1e-3


def realization(law, period=None):
    """A, B, C, D of a filter, from its methods at the unit vectors."""
    count = len(law.memory())
    step = law.rates if period is None else lambda memory, signal: law.advance(memory, signal, period=period)
    rows = [
        (*step(list(unit[:-1]), unit[-1]), law.output(list(unit[:-1]), unit[-1], period=period))
        for unit in np.eye(count + 1)
    ]
    matrix = np.array(rows, dtype=float).T
    return matrix[:-1, :-1], matrix[:-1, -1:], matrix[-1:, :-1], matrix[-1:, -1:]


@every_filter
def test_continuous_filter_is_its_transfer_function(law, transfer, exact):
    s = 1j * np.geomspace(1, 1e5, 60)
    assert control.ss(*realization(law))(s) == pytest.approx(transfer(s), abs=1e-12)


@every_filter
def test_sampled_filter_is_tustins_rule_prewarped(law, transfer, exact):
    sampled = control.sample_system(control.ss(transfer), PERIOD, "tustin", prewarp_frequency=exact)
    z = np.exp(1j * np.linspace(0.001, math.pi, 60))
    assert control.ss(*realization(law, PERIOD), PERIOD)(z) == pytest.approx(sampled(z), abs=1e-12)


@every_filter
def test_the_recursion_is_controls_time_response(law, transfer, exact):
    sampled = control.sample_system(control.ss(transfer), PERIOD, "tustin", prewarp_frequency=exact)
    signal = np.random.default_rng(1).normal(size=300)
    expected = control.forced_response(sampled, inputs=signal).outputs
    memory, found = [0.0] * len(law.memory()), []
    for value in signal:
        found.append(law.output(memory, value, period=PERIOD))
        memory = law.advance(memory, value, period=PERIOD)
    assert np.ptp(found) > 0.1
    assert found == pytest.approx(expected, abs=1e-12)


@every_filter
def test_sampled_filter_is_exact_at_its_prewarp_frequency(law, transfer, exact):
    sampled = control.ss(*realization(law, PERIOD), PERIOD)
    assert sampled(np.exp(1j * exact * PERIOD)) == pytest.approx(transfer(1j * exact), abs=1e-12)


@every_filter
@settings(deadline=None, max_examples=20)
@given(signal=numbers(-10, 10), period=numbers(1e-6, 2e-3))
def test_both_forms_rest_with_the_same_memory(law, transfer, exact, signal, period):
    a, b, c, d = realization(law)
    memory = list((-np.linalg.solve(a, b) * signal).ravel())
    assert law.output(memory, signal) == pytest.approx(signal * (c @ -np.linalg.solve(a, b) + d).item(), abs=1e-9)
    assert law.advance(memory, signal, period=period) == pytest.approx(memory, abs=1e-9)


@every_filter
def test_filters_are_the_same_in_numbers_and_in_symbols(law, transfer, exact):
    memory = [0.3, -0.2][: len(law.memory())]

    def split(method):
        return lambda *values: method(list(values[: len(memory)]), *values[len(memory) :])

    for method, values in ((law.output, (0.7,)), (law.output, (0.7, PERIOD)), (law.rates, (0.7,)),
                           (law.advance, (0.7, PERIOD))):  # fmt: skip
        assert in_symbols(split(method), *memory, *values) == pytest.approx(split(method)(*memory, *values), abs=1e-12)


def test_memory_takes_the_unit_of_the_signal():
    assert [(m.unit, m.nominal) for m in Notch(frequency=5.0, damping=0.1).memory("A", 2.0)] == [("A", 2.0)] * 2
    assert [m.unit for m in LowPass(frequency=5.0).memory("N m")] == ["N m"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LowPass(frequency=0.0), "LowPass.frequency must be > 0 rad/s, got 0 rad/s"),
        (lambda: Notch(frequency=1.0, damping=0.1, depth=1.0), "Notch.depth must be < 1, got 1"),
        (lambda: LeadLag(zero=1.0, pole=-1.0), "LeadLag.pole must be > 0 rad/s, got -1 rad/s"),
        (lambda: SecondOrderLowPass(frequency=1.0, damping=0.0), "SecondOrderLowPass.damping must be > 0, got 0"),
        (
            lambda: Notch(frequency=4000.0, damping=0.1).output([0.0, 0.0], 1.0, period=1e-3),
            "filter: 4000 rad/s needs more than two samples a cycle, a period below 0.000785398 s, got 0.001 s",
        ),
    ],
)
def test_filters_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
