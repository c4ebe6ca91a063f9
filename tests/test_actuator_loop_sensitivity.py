"""Sensitivities and their peaks.

Oracles: the closed form of a PID on a mass; S and T as models of their own, which add up to one; the peak that
`margins` finds; the gain of a mass on a spring at resonance; of a sampled loop with several values in a period, the
peak that `lifted_margins` finds.
"""

import math

import control
import numpy as np
import pytest

from actuator import (
    Actuator,
    Load,
    TorqueSource,
    complementary_sensitivity,
    lifted_margins,
    loop_transfer,
    margins,
    sensitivity,
    trim,
)
from actuator.linear.margins.sensitivity import peak_of, sensitivities, values_of
from controllers import PID, Sampling
from gear import Shaft, Transmission

INERTIA, PROPORTIONAL, INTEGRAL, DERIVATIVE = 0.2, 30.0, 40.0, 1.0
LOOP = "torque_reference"


def point(sampling=None):
    """Operating point of a PID on a mass."""
    plant = Actuator(
        motor=TorqueSource(),
        gear=Transmission(shafts={"arm": Shaft(inertia=INERTIA)}, input="arm", output="arm"),
        load=Load(),
        controller=PID(proportional=PROPORTIONAL, integral=INTEGRAL, derivative=DERIVATIVE),
        sampling=sampling,
    )
    return trim(plant, "forward")


def initial_gains(frequencies):
    s = 1j * frequencies
    return (PROPORTIONAL + INTEGRAL / s + DERIVATIVE * s) / (INERTIA * s**2)


def test_s_and_t_are_those_of_the_closed_form():
    found = sensitivities(loop_transfer(point(), LOOP))
    loop = initial_gains(found.frequencies)
    np.testing.assert_allclose(found.sensitivity, abs(1 / (1 + loop)), rtol=1e-6)
    np.testing.assert_allclose(found.complementary, abs(loop / (1 + loop)), rtol=1e-6)
    fine = initial_gains(np.geomspace(1, 100, 1_000_000))
    assert found.sensitivity_peak.value == pytest.approx(abs(1 / (1 + fine)).max(), rel=1e-7)
    assert found.complementary_peak.value == pytest.approx(abs(fine / (1 + fine)).max(), rel=1e-7)


def test_the_peak_of_s_is_that_of_the_margins():
    loop = loop_transfer(point(), LOOP)
    found, expected = sensitivities(loop).sensitivity_peak, margins(loop)
    assert found.value == pytest.approx(expected.peak_sensitivity, rel=1e-7)
    assert found.frequency == pytest.approx(expected.sensitivity_frequency, rel=1e-3)


@pytest.mark.parametrize("sampling", [None, Sampling(position=5e-3, delay=1)])
def test_s_and_t_are_models_of_their_own_that_add_up_to_one(sampling):
    at = point(sampling)
    found = sensitivities(loop_transfer(at, LOOP))
    s, t = (values_of(of(at, LOOP), found.frequencies)[:, 0, 0] for of in (sensitivity, complementary_sensitivity))
    np.testing.assert_allclose(s + t, 1, atol=1e-6)
    np.testing.assert_allclose(found.sensitivity, abs(s), rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(found.complementary, abs(t), rtol=1e-5, atol=1e-9)


def test_of_a_loop_of_several_values_s_is_the_largest_gain():
    a, b = np.array([[0.7, 0.2], [-0.1, 0.5]]), np.array([[0.3, 0.0], [0.1, 0.4]])
    loop = control.StateSpace(a, b, np.eye(2), np.zeros((2, 2)), 1e-3)
    found = sensitivities(loop)
    assert found.sensitivity_peak.value == pytest.approx(
        lifted_margins(loop).peak_sensitivity, rel=1e-4
    )  # it has a grid
    assert found.frequencies.max() < math.pi / 1e-3


def test_nothing_passes_a_loop_that_is_cut():
    assert sensitivities(control.StateSpace([[-1.0]], [[1e-9]], [[1.0]], [[0.0]])) is None


def test_a_mass_on_a_spring_yields_most_at_resonance():
    damping, stiffness = 0.05, 30.0
    compliance = control.tf2ss([1.0], [INERTIA, damping, stiffness])
    ratio = damping / (2 * math.sqrt(INERTIA * stiffness))
    found = peak_of(compliance)
    assert found.value == pytest.approx(1 / (2 * stiffness * ratio * math.sqrt(1 - ratio**2)), rel=1e-6)
    assert found.frequency == pytest.approx(math.sqrt(stiffness / INERTIA * (1 - 2 * ratio**2)), rel=1e-3)
