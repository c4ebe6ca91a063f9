"""The contract of laws with memory: counts, and one short sample that goes where the rates point."""

import numpy as np
import pytest

from controllers import (
    DisturbanceObserver,
    Dither,
    FilteredDerivative,
    Knocker,
    LeadLag,
    LowPass,
    Memory,
    Notch,
    PositionObserver,
    RateAndAccelerationLimit,
    RateLimit,
    SecondOrderLowPass,
)

# law, inputs; all of them have both forms
BOTH_FORMS = (
    (LowPass(frequency=30.0), (0.4,)),
    (LeadLag(zero=10.0, pole=30.0), (0.4,)),
    (SecondOrderLowPass(frequency=30.0), (0.4,)),
    (Notch(frequency=30.0, damping=0.3, depth=0.1), (0.4,)),
    (DisturbanceObserver(inertia=0.1, bandwidth=50.0), (0.4, 3.0)),
    (FilteredDerivative(time=0.02), (0.4,)),
    (PositionObserver(bandwidth=30.0), (0.4,)),
    (Dither(amplitude=1.0, frequency=20.0), ()),
)
# a sampled one closes on its input at once, or has no continuous form
SAMPLED = (
    (RateLimit(rate=2.0), (0.4,)),
    (RateAndAccelerationLimit(rate=2.0, acceleration=5.0), (0.4,)),
    (Knocker(amplitude=1.0, width=0.1, interval=1.0), (0.4,)),
)


@pytest.mark.parametrize(("law", "inputs"), BOTH_FORMS + SAMPLED, ids=str)
def test_what_is_declared_is_what_is_advanced(law, inputs):
    declared = law.memory()
    assert all(isinstance(memory, Memory) and memory.unit and memory.nominal > 0 for memory in declared)
    assert len({memory.name for memory in declared}) == len(declared)
    start = [memory.initial for memory in declared]
    assert len(law.advance(start, *inputs, period=1e-3)) == len(declared)
    assert np.isfinite(law.output(start, *inputs, period=1e-3))


@pytest.mark.parametrize(("law", "inputs"), BOTH_FORMS, ids=str)
def test_a_short_sample_goes_where_the_rates_point(law, inputs):
    memory, period = [0.3, -0.2][: len(law.memory())], 1e-6
    moved = (np.array(law.advance(memory, *inputs, period=period)) - memory) / period
    assert moved == pytest.approx(law.rates(memory, *inputs), rel=1e-3, abs=1e-3)
    assert law.output(memory, *inputs, period=period) == pytest.approx(law.output(memory, *inputs), rel=1e-3, abs=1e-4)
