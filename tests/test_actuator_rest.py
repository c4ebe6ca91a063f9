"""What stiction holds. Oracles: the mass on a guide by hand, and its simulation."""

import pytest
from mass_on_guide import MassOnGuide

from actuator import Actuator, NotAtRest, TorqueSource, rest, rest_set, simulate
from gear import Bearing, Shaft, Transmission

MASS = MassOnGuide()


def standing(error, integral):
    """State of the mass at rest, `error` behind the reference 1."""
    return {"mass.angle": 1.0 - error, "controller.integral": integral}


@pytest.mark.parametrize(("error", "integral"), [(0.1, 0.5), (-0.1, 0.2), (0.05, -1.6), (-0.02, 1.2)])
def test_drift_time_of_the_mass_is_what_is_left_of_breakaway_over_the_rate_of_the_integral(error, integral):
    found = rest(MASS.actuator(), standing(error, integral), inputs={"reference": 1.0}, compiled=False)
    torque, rate = 3 * error + integral, 4 * error
    expected = (1.5 - torque) / rate if rate > 0 else (1.5 + torque) / -rate
    assert found.drift_time == pytest.approx(expected, rel=1e-9)
    assert found.breaks == f"gear.bearings.guide {'upper' if error > 0 else 'lower'}"
    assert found.position_error == pytest.approx(error, abs=1e-12)
    assert found.holds["gear.bearings.guide"].reserve == pytest.approx(1 - abs(torque) / 1.5, abs=1e-9)


def test_a_mass_on_its_reference_stands_for_ever():
    found = rest(MASS.actuator(), standing(0.0, 1.0), inputs={"reference": 1.0}, compiled=False)
    assert found.drift_time == float("inf")
    assert found.breaks == ""


def test_a_sliding_mass_is_not_at_rest():
    with pytest.raises(NotAtRest, match="stiction does not hold this state: gear.bearings.guide is forward"):
        rest(MASS.actuator(), standing(0.0, 2.0), inputs={"reference": 1.0}, compiled=False)


def test_drift_time_is_that_of_a_simulation():
    plant, state = MASS.actuator(), standing(0.03, 0.9)
    found = rest(plant, state, inputs={"reference": 1.0}, compiled=False)
    run = simulate(plant, 2 * found.drift_time, inputs={"reference": 1.0}, start=state, compiled=False)
    assert run.changes[0].time == pytest.approx(found.drift_time, rel=1e-6)


@pytest.mark.parametrize("load_torque", [0.0, 0.7, -3.0])
def test_the_rest_set_of_the_mass_is_breakaway_about_the_load(load_torque):
    found = rest_set(MASS.actuator(), {"mass.angle": 0.3}, load_torque=load_torque)
    assert found.lower == pytest.approx(-1.5 - load_torque, abs=1e-6)
    assert found.upper == pytest.approx(1.5 - load_torque, abs=1e-6)
    assert found.static_errors(3.0) == pytest.approx((found.lower / 3, found.upper / 3))
    assert found.threshold(3.0) == pytest.approx(1.0, abs=1e-6)
    assert found.drift_time(0.5, 0.2) == pytest.approx((found.upper - 0.5) / 0.2)
    assert found.drift_time(0.5, 0.0) == float("inf")


def test_breakaway_is_a_parameter_of_the_rest_set():
    found = rest_set(MASS.actuator(), {}, parameters={"gear.bearings.guide.breakaway": 2.0, "controller.integral": 9.0})
    assert found.upper == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize("second", [0.5, 1.5])
def test_two_bearings_on_a_shaft_are_redundant_and_hold_together(second):
    guides = {
        "one": Bearing(shaft="mass", coulomb=1.0, breakaway=1.5),
        "two": Bearing(shaft="mass", coulomb=0.3, breakaway=second),
    }
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings=guides, input="mass", output="mass")
    plant = Actuator(name="two guides", motor=TorqueSource(), gear=gear)
    found = rest_set(plant, {})
    assert found.redundant
    assert found.upper == pytest.approx(1.5 + second, abs=1e-6)
    assert not rest_set(MASS.actuator(), {}).redundant
    for torque, moves in ((found.upper - 0.01, False), (found.upper + 0.01, True)):
        run = simulate(plant, 1.0, inputs={"torque_reference": torque}, compiled=False)
        assert (abs(run["load_angle"][-1]) > 1e-9) == moves
