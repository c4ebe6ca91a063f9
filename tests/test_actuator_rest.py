"""What stiction holds. Oracles: the mass on a guide by hand, and its simulation."""

import numpy as np
import pytest
from mass_on_guide import MassOnGuide

from actuator import Actuator, NotAtRest, TorqueSource, find_equilibrium_set, predict_breakaway, simulate
from actuator.system.contact_modes import find_standstill
from gear import Backlash, Bearing, Coulomb, ExternalPair, Linear, Mesh, Shaft, Transmission

MASS = MassOnGuide()


def standing(error, integral):
    """State of the mass at rest, `error` behind the reference 1."""
    return {"mass.angle": 1.0 - error, "controller.integral": integral}


@pytest.mark.parametrize(("error", "integral"), [(0.1, 0.5), (-0.1, 0.2), (0.05, -1.6), (-0.02, 1.2)])
def test_drift_time_of_the_mass_is_what_is_left_of_breakaway_over_the_rate_of_the_integral(error, integral):
    found = predict_breakaway(MASS.actuator(), standing(error, integral), inputs={"reference": 1.0}, compiled=False)
    torque, rate = 3 * error + integral, 4 * error
    expected = (1.5 - torque) / rate if rate > 0 else (1.5 + torque) / -rate
    assert found.drift_time == pytest.approx(expected, rel=1e-9)
    assert found.breaks == f"gear.bearings.guide {'upper' if error > 0 else 'lower'}"
    assert found.position_error == pytest.approx(error, abs=1e-12)
    assert found.holds["gear.bearings.guide"].reserve == pytest.approx(1 - abs(torque) / 1.5, abs=1e-9)


def test_a_mass_on_its_reference_stands_for_ever():
    found = predict_breakaway(MASS.actuator(), standing(0.0, 1.0), inputs={"reference": 1.0}, compiled=False)
    assert found.drift_time == float("inf")
    assert found.breaks == ""


def test_a_sliding_mass_is_not_at_rest():
    with pytest.raises(NotAtRest, match="stiction does not hold this state: gear.bearings.guide is forward"):
        predict_breakaway(MASS.actuator(), standing(0.0, 2.0), inputs={"reference": 1.0}, compiled=False)


def test_drift_time_is_that_of_a_simulation():
    plant, state = MASS.actuator(), standing(0.03, 0.9)
    found = predict_breakaway(plant, state, inputs={"reference": 1.0}, compiled=False)
    run = simulate(plant, 2 * found.drift_time, inputs={"reference": 1.0}, start=state, compiled=False)
    assert run.changes[0].time == pytest.approx(found.drift_time, rel=1e-6)


@pytest.mark.parametrize("load_torque", [0.0, 0.7, -3.0])
def test_the_rest_set_of_the_mass_is_breakaway_about_the_load(load_torque):
    found = find_equilibrium_set(MASS.actuator(), {"mass.angle": 0.3}, load_torque=load_torque)
    assert found.lower == pytest.approx(-1.5 - load_torque, abs=1e-6)
    assert found.upper == pytest.approx(1.5 - load_torque, abs=1e-6)
    assert found.static_errors(3.0) == pytest.approx((found.lower / 3, found.upper / 3))
    assert found.threshold(3.0) == pytest.approx(1.0, abs=1e-6)
    assert found.drift_time(0.5, 0.2) == pytest.approx((found.upper - 0.5) / 0.2)
    assert found.drift_time(0.5, 0.0) == float("inf")


def test_breakaway_is_a_parameter_of_the_rest_set():
    found = find_equilibrium_set(
        MASS.actuator(), {}, parameters={"gear.bearings.guide.breakaway": 2.0, "controller.integral": 9.0}
    )
    assert found.upper == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize("second", [0.5, 1.5])
def test_two_bearings_on_a_shaft_are_redundant_and_hold_together(second):
    guides = {
        "one": Bearing(shaft="mass", coulomb=1.0, breakaway=1.5),
        "two": Bearing(shaft="mass", coulomb=0.3, breakaway=second),
    }
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings=guides, input="mass", output="mass")
    plant = Actuator(name="two guides", motor=TorqueSource(), gear=gear)
    found = find_equilibrium_set(plant, {})
    assert found.redundant
    assert found.upper == pytest.approx(1.5 + second, abs=1e-6)
    assert not find_equilibrium_set(MASS.actuator(), {}).redundant
    for torque, moves in ((found.upper - 0.01, False), (found.upper + 0.01, True)):
        run = simulate(plant, 1.0, inputs={"torque_reference": torque}, compiled=False)
        assert (abs(run["load_angle"][-1]) > 1e-9) == moves


def in_the_gap(load_breakaway):
    """Two shafts with their teeth apart, the load on a bearing or not."""
    bearings = {"motor": Bearing(shaft="motor", coulomb=1.0, breakaway=1.5)}
    if load_breakaway:
        bearings["load"] = Bearing(shaft="load", coulomb=load_breakaway, breakaway=load_breakaway)
    mesh = Mesh(
        a="motor",
        b="load",
        pair=ExternalPair(teeth_a=20, teeth_b=60, module=1e-3),
        elasticity=Backlash(gap=1e-3, law=Linear(stiffness=1e7, damping=1e4)),
        friction=Coulomb(sliding=0.1, static=0.2),
    )
    gear = Transmission(
        shafts={"motor": Shaft(inertia=1e-3), "load": Shaft(inertia=9e-3)},
        meshes={"mesh": mesh},
        bearings=bearings,
        input="motor",
        output="load",
    )
    return Actuator(motor=TorqueSource(), gear=gear)


def test_a_mesh_in_its_gap_does_not_keep_what_sticks_from_resting():
    found = predict_breakaway(in_the_gap(2.0), {}, inputs={"torque_reference": 0.9}, compiled=False)
    assert set(found.holds) == {"gear.bearings.motor", "gear.bearings.load"}
    assert found.holds["gear.bearings.motor"].reserve == pytest.approx(1 - 0.9 / 1.5, abs=1e-9)
    held = find_equilibrium_set(in_the_gap(2.0), {}, load_torque=0.5)
    assert (held.lower, held.upper) == (pytest.approx(-1.5, abs=1e-6), pytest.approx(1.5, abs=1e-6))


def test_what_hangs_in_a_gap_is_not_at_rest():
    with pytest.raises(NotAtRest, match="shaft load moves"):
        predict_breakaway(in_the_gap(0.0), {}, inputs={"load_torque": 0.5}, compiled=False)
    with pytest.raises(NotAtRest, match="stiction holds this standstill at no motor torque"):
        find_equilibrium_set(in_the_gap(0.0), {}, load_torque=0.5)


def test_time_in_a_gap_is_no_standstill():
    stuck, free = np.array(["stuck", "stuck", "free"]), np.array(["free", "free", "free"])
    assert find_standstill({"one": stuck, "two": free}).tolist() == [True, True, False]
    assert find_standstill({"two": free}).tolist() == [False] * 3
