"""Periodic orbits under sampled control.

Oracles: the sampled mass in closed form, tick by tick (a constant torque moves it by a parabola until it stops), which
must return to where an orbit starts, and whose finite differences give the multipliers; the continuous cycle in the
limit of fast sampling; bisection by simulation for the boundary.
"""

import numpy as np
import pytest

from actuator import Actuator, TorqueSource, classify, simulate
from actuator.continuation.bisection import bisect_by_simulation
from actuator.continuation.continuation import continue_orbit
from actuator.orbits.find import find_orbit
from actuator.orbits.flow import NoOrbit
from controllers import PID, Sampling
from gear import Bearing, Shaft, Transmission

pytestmark = pytest.mark.thorough

KP, KI, KD, COULOMB, BREAKAWAY = 3.0, 4.0, 6.0, 1.0, 1.5
CONTINUOUS = 23.369272293088, 0.06724014692, 0.780186658  # period s, amplitude rad, stick fraction


def mass(period, delay=0):
    """The unit mass on a guide under a sampled PID."""
    guide = {"guide": Bearing(shaft="mass", coulomb=COULOMB, breakaway=BREAKAWAY)}
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings=guide, input="mass", output="mass")
    pid = PID(proportional=KP, integral=KI, derivative=KD)
    sampling = Sampling(position=period, delay=delay)
    return Actuator(name="sampled mass", motor=TorqueSource(), gear=gear, controller=pid, sampling=sampling)


def cycle(plant, duration=150.0, **parameters):
    return simulate(
        plant,
        duration,
        inputs={"reference": 0.0},
        start={"mass.angle": 0.1},
        parameters=parameters,
        resolution=1e-2,
        tolerance=1e-9,
    )


def parabola(position, speed, torque, time):
    """Position and speed of the mass after `time` under a constant torque, through every stop."""
    while True:
        if speed == 0:
            if abs(torque) <= BREAKAWAY:
                return position, 0.0
            acceleration = torque - np.sign(torque) * COULOMB
        else:
            acceleration = torque - np.sign(speed) * COULOMB
        stops = -speed / acceleration if speed * acceleration < 0 else np.inf
        if stops >= time:
            return position + speed * time + acceleration * time**2 / 2, speed + acceleration * time
        position, speed, time = position + speed * stops / 2, 0.0, time - stops


def after(x, period, delay, ticks):
    """(position, speed, integral, pending torque) that many ticks later."""
    position, speed, integral, pending = x
    for _ in range(ticks):
        torque = -KP * position + integral - KD * speed
        integral -= period * KI * position
        torque, pending = (pending, torque) if delay else (torque, torque)
        position, speed = parabola(position, speed, torque, period)
    return np.array([position, speed, integral, pending])


def reduced(orbit):
    """The state of an orbit as the oracle has it."""
    x = dict(zip([state.name for state in orbit.system.states], orbit.x0, strict=True))
    pending = x.get("controller.torque_reference.pending_1", x["controller.torque_reference"])
    return np.array([x["mass.angle"], x["mass.speed"], x["controller.integral"], pending])


@pytest.mark.parametrize(("period", "delay"), [(5e-2, 0), (5e-2, 1)])
def test_an_orbit_is_one_of_the_mass_in_closed_form(period, delay):
    plant = mass(period, delay)
    orbit = find_orbit(plant, cycle(plant), compiled=False)
    x = reduced(orbit)
    assert orbit.residual < 1e-8
    np.testing.assert_allclose(after(x, period, delay, orbit.ticks), x, atol=1e-9)
    assert orbit.period == pytest.approx(orbit.ticks * period, rel=1e-12)
    # its multipliers are those of the map in closed form; what stands still has none
    moving, step = [0, 2, 3], 1e-6
    differences = np.zeros((3, 3))
    for k, row in enumerate(moving):
        shifted = [after(x + sign * step * np.eye(4)[row], period, delay, orbit.ticks) for sign in (1, -1)]
        differences[:, k] = ((shifted[0] - shifted[1]) / (2 * step))[moving]
    expected = sorted(abs(np.linalg.eigvals(differences)), reverse=True)
    found = sorted([abs(orbit.clock_multiplier), *abs(orbit.multipliers)], reverse=True)
    np.testing.assert_allclose(found[:2], expected[:2], rtol=1e-5)
    assert max(found[2:]) < 1e-4


def test_the_cycle_persists_and_jitters_against_the_clock():
    plant = mass(5e-2)
    run = cycle(plant, 400.0)
    orbit = find_orbit(plant, run, compiled=False)
    assert orbit.stable
    assert orbit.jitters
    slips = np.array([change.time for change in run.changes if change.before == "stuck"])
    half = np.diff(slips[2:])
    assert np.ptp(half) > 5e-2  # the simulation does not close
    assert half.mean() == pytest.approx(orbit.period / 2, abs=5e-2)
    assert {(event.before, event.after) for event in orbit.events} == {
        ("stuck", "forward"),
        ("forward", "stuck"),
        ("stuck", "backward"),
        ("backward", "stuck"),
    }


def test_fast_sampling_leads_to_the_continuous_cycle():
    errors = []
    for period in (5e-2, 2e-2):
        plant = mass(period)
        orbit = find_orbit(plant, cycle(plant), compiled=False)
        found = orbit.period, orbit.load_amplitude, orbit.stick_fraction
        errors.append(max(abs(a / b - 1) for a, b in zip(found, CONTINUOUS, strict=True)))
    assert errors[1] < 0.02
    assert errors[1] < errors[0] / 2


def test_a_family_ends_where_simulations_stop_hunting():
    # the cycle ends where it no longer sticks; stuck for one tick or two, no whole number of ticks closes any more
    plant = mass(5e-2)
    name, bounds = "controller.integral", (15.0, 18.0)
    orbit = find_orbit(plant, cycle(plant, 200.0, **{name: 15.0}), compiled=False)
    branch = continue_orbit(orbit, name, bounds, upward=True, compiled=False)
    options = {"inputs": {"reference": 0.0}, "start": {"mass.angle": 0.1}, "duration": 300.0, "compiled": False}
    bisection = bisect_by_simulation(plant, name, bounds, **options)
    assert branch.end.value == pytest.approx(bisection.value, rel=0.02)
    assert branch.orbits[-1].stick_fraction < 0.05


def test_a_run_that_rests_has_no_orbit():
    plant = mass(2e-2)
    run = cycle(plant, 60.0, **{"gear.bearings.guide.breakaway": 1.0})
    assert not classify(run).cycles
    with pytest.raises(NoOrbit, match="does not end in a cycle but in"):
        find_orbit(plant, run)
