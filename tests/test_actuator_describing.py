"""Describing functions. Oracles: closed forms (relay, a spring and an inertia), and an exactly known limit cycle."""

import control
import numpy as np
import pytest
from mass_on_guide import MassOnGuide
from test_actuator_orbit import hunting

from actuator import Actuator, Load, TorqueSource, find_orbit
from actuator.describing.check import check_describing_function
from actuator.describing.describing import backlash, coulomb_friction, harmonics_of, predict_cycles, stage_response
from gear import Bearing, Shaft, Transmission

pytestmark = pytest.mark.thorough


def guide(coulomb=0.0, breakaway=0.0, viscous=2.0):
    bearing = Bearing(shaft="mass", coulomb=coulomb, breakaway=breakaway, viscous=viscous)
    gear = Transmission(shafts={"mass": Shaft(inertia=0.5)}, bearings={"guide": bearing}, input="mass", output="mass")
    return Actuator(name="mass on a guide", motor=TorqueSource(), gear=gear, load=Load())


def test_harmonics_of_a_square_wave_are_odd_and_fall_like_one_over_their_number():
    time = np.linspace(0, 2.0, 200001)
    found = harmonics_of(time, np.sign(np.sin(np.pi * time)), 0.5)
    expected = [4 / (np.pi * k) if k % 2 else 0.0 for k in range(1, 10)]
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_friction_is_a_relay():
    assert coulomb_friction(2.0)(0.5, 1.0) == pytest.approx(4 * 2.0 / (np.pi * 0.5))


def test_backlash_lags_and_passes_nothing_inside_the_gap():
    describing = backlash(0.2)
    assert describing(0.09, 1.0) == 0
    value = describing(0.2, 1.0)
    assert 0 < value.real < 1
    assert value.imag < 0
    assert describing(1e3, 1.0) == pytest.approx(1.0, abs=1e-3)


def test_a_linear_gear_has_its_transfer_function_at_every_amplitude():
    for amplitude in (0.1, 10.0):
        found = stage_response(guide(), amplitude, 1.5, compiled=False)
        assert found.function == pytest.approx(1 / (2.0 + 0.5j * 2 * np.pi * 1.5), rel=1e-3)
        assert found.distortion < 1e-2


def test_friction_swallows_small_torques_and_distorts_large_ones_less():
    plant = guide(coulomb=1.0, breakaway=1.2)
    assert stage_response(plant, 1.1, 1.0, compiled=False).function == 0
    small, large = (stage_response(plant, amplitude, 1.0, compiled=False) for amplitude in (1.5, 20.0))
    free = stage_response(guide(), 1.0, 1.0, compiled=False)
    assert abs(small.function) < abs(large.function) < abs(free.function)
    assert large.distortion < small.distortion


def test_a_bias_at_the_load_weakens_the_answer():
    plant = guide(coulomb=1.0, breakaway=1.2)
    free, loaded = (stage_response(plant, 1.5, 1.0, load_torque=bias, compiled=False) for bias in (0.0, 0.5))
    assert abs(free.function - loaded.function) > 0.05 * abs(free.function)
    assert loaded.bias == 0.5


def test_a_controlled_actuator_has_no_torque_to_shake():
    with pytest.raises(ValueError, match="mass on a guide has a controller"):
        stage_response(MassOnGuide().actuator(), 1.0, 1.0)


def test_a_relay_in_a_loop_of_third_order():
    # L = 6/(s (s+1) (s+2)): phase crossover at sqrt(2) rad/s with |L| = 1, so N = 1 and A = 4/pi
    loop = control.ss(control.tf([6.0], [1.0, 3.0, 2.0, 0.0]))
    found = predict_cycles(loop, coulomb_friction(1.0), np.geomspace(0.1, 10, 30), np.geomspace(0.3, 6, 31))
    assert len(found) == 1
    assert found[0].amplitude == pytest.approx(4 / np.pi, rel=1e-6)
    assert found[0].period == pytest.approx(2 * np.pi / np.sqrt(2), rel=1e-6)
    assert found[0].stable
    assert found[0].trusted


def test_the_pid_on_a_sticking_mass_is_predicted_not_to_cycle():
    # from friction torque to speed, with the loop closed: s^2 / (s^3 + 6 s^2 + 3 s + 4); Coulomb friction alone
    loop = control.ss(control.tf([1.0, 0.0, 0.0], [1.0, 6.0, 3.0, 4.0]))
    assert predict_cycles(loop, coulomb_friction(1.0), np.geomspace(1e-4, 10, 40), np.geomspace(0.01, 100, 41)) == []


def test_what_is_predicted_for_the_sticking_mass_is_not_trusted_beside_its_orbit():
    mass = MassOnGuide()
    plant, run = hunting(mass)
    found = check_describing_function(plant, find_orbit(plant, run, compiled=False))
    assert found.coulomb == pytest.approx(1.0, rel=1e-9)
    assert complex(found.loop(2j)) == pytest.approx(-4 / (6 * -4 + 3 * 2j - 8j + 4), rel=1e-9)
    assert found.cycles == ()  # with breakaway left out there is none
    assert found.distortion > 1
    assert not found.trusted
    assert "predict no cycle, the exact orbit has 23.37 s" in found.reason
    assert len(found.plot().axes) == 2
