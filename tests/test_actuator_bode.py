"""The numbers of Bode plots against closed forms."""

import math

import control
import numpy as np
import pytest

from actuator.linear.bode import bode_of, passes, phase_of, to_db


def test_a_factor_of_ten_is_20_db_and_nothing_is_minus_infinity():
    assert to_db(10.0) == 20
    assert to_db(0.0) == -math.inf
    np.testing.assert_array_equal(to_db(np.array([0.1, 1.0, 0.0])), [-20, 0, -math.inf])


def test_phase_starts_between_minus_270_and_90_deg_and_has_no_jumps():
    phases = np.radians([-170.0, -190.0, -350.0])
    np.testing.assert_allclose(phase_of(np.exp(1j * phases)), phases)


@pytest.mark.parametrize(("first", "shown"), [(90.0, 90.0), (91.0, -269.0), (180.0, -180.0), (-89.0, -89.0)])
def test_the_first_phase_is_above_minus_270_and_at_most_90_deg(first, shown):
    response = np.exp(1j * np.radians([first, first - 1]))
    np.testing.assert_allclose(np.degrees(phase_of(response)), [shown, shown - 1])


def test_phase_is_nan_where_nothing_moves_or_a_simulation_failed():
    response = np.array([1.0, np.nan, 1j, 1.0])
    phases = phase_of(response, np.array([False, True, True, True]))
    np.testing.assert_allclose(phases, [np.nan, np.nan, np.pi / 2, 0.0])
    assert np.isnan(phase_of(response, np.zeros(4, bool))).all()


@pytest.mark.parametrize("step", [0.0, 1e-5])
def test_two_integrators_lag_by_180_deg_in_continuous_and_discrete_time(step):
    a = np.array([[0.0, 1.0], [0.0, 0.0]])
    a, b = (np.eye(2) + step * a, [[0.0], [step]]) if step else (a, [[0.0], [1.0]])
    frequencies = np.array([0.1, 1.0, 10.0])
    gain, phase = bode_of(control.ss(a, b, [[1.0, 0.0]], [[0.0]], step), frequencies)
    np.testing.assert_allclose(gain, frequencies**-2.0, rtol=1e-6)
    np.testing.assert_allclose(np.degrees(phase), -180, atol=0.01)


def test_a_model_of_rounding_passes_nothing():
    assert passes(control.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]]))
    assert not passes(control.ss([[-1.0]], [[1.0]], [[1e-9]], [[0.0]]))
