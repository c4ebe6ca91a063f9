"""The textbook of hunting: a unit mass on a guide that sticks, positioned by a PID.

Oracles: the cycle in closed form (matrix exponential of the slide, linear growth of the torque while stuck), which
gives period 23.3693 s, amplitude 0.067240 rad and a stick fraction of 0.780187; no cycle where breakaway is not above
sliding friction; the balance of energy; starts on, above and below the cycle.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from actuator import Actuator, TorqueSource, classify, simulate
from controllers import PID
from gear import Bearing, Shaft, Transmission

GUIDE = "gear.bearings.guide"
COULOMB, BREAKAWAY = 1.0, 1.5  # N m
PROPORTIONAL, INTEGRAL, DERIVATIVE = 3.0, 4.0, 6.0


class Cycle(NamedTuple):
    """One period of stick-slip motion, which is twice the same half with opposite sign."""

    amplitude: float  # rad
    slide: float  # s, of one half
    stick: float  # s, of one half

    @property
    def half(self):
        return self.slide + self.stick

    @property
    def stick_fraction(self):
        return self.stick / self.half


def motion(viscous):
    """Matrix of the slide: e' = -v,  v' = 3 e + z - (6 + viscous) v - coulomb,  z' = 4 e."""
    matrix = np.zeros((4, 4))
    matrix[0, 1] = -1.0
    matrix[1] = PROPORTIONAL, -DERIVATIVE - viscous, 1.0, -COULOMB
    matrix[2, 0] = INTEGRAL
    return matrix


def slide(error, viscous):
    """How long a slide from rest at `error` lasts [s]; position error and integral at its end."""
    start = np.array([error, 0.0, BREAKAWAY - PROPORTIONAL * error, 1.0])  # 3 e + z = breakaway
    step, state, steps = expm(0.05 * motion(viscous)), start, 0
    while state[1] > 0 or steps < 2:
        state, steps = step @ state, steps + 1
    stop = brentq(lambda time: (expm(time * motion(viscous)) @ start)[1], 0.05 * (steps - 1), 0.05 * steps, xtol=1e-13)
    left, _, integral, _ = expm(stop * motion(viscous)) @ start
    return stop, left, integral


@cache
def cycle(viscous=0.0):
    """The cycle: a slide that ends as far behind the reference as it began before it."""
    error = brentq(lambda e: slide(e, viscous)[1] + e, 0.01, 0.5, xtol=1e-13)
    duration, left, integral = slide(error, viscous)
    torque_at_stop = PROPORTIONAL * left + integral
    return Cycle(error, duration, (torque_at_stop + BREAKAWAY) / (INTEGRAL * error))


def mass(breakaway=BREAKAWAY, viscous=0.0):
    guide = Bearing(shaft="mass", coulomb=COULOMB, breakaway=breakaway, viscous=viscous)
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings={"guide": guide}, input="mass", output="mass")
    pid = PID(proportional=PROPORTIONAL, integral=INTEGRAL, derivative=DERIVATIVE)
    return Actuator(name="mass on a guide", motor=TorqueSource(), gear=gear, controller=pid)


MASS = mass()


def run_for(duration, plant=MASS, **options):
    return simulate(plant, duration, **({"inputs": {"reference": 1.0}, "compiled": False} | options))


def starting_at(error):
    """States just as the mass lets go forward, `error` before the reference."""
    return {"mass.angle": 1.0 - error, "controller.integral": BREAKAWAY - PROPORTIONAL * error}


def test_the_closed_form_gives_the_published_cycle():
    expected = cycle()
    assert 2 * expected.half == pytest.approx(23.3693, abs=5e-5)
    assert expected.amplitude == pytest.approx(0.067240, abs=5e-7)
    assert expected.stick_fraction == pytest.approx(0.780187, abs=5e-7)


@pytest.mark.parametrize("duration", [100.0, 150.0, 300.0])
def test_the_mass_hunts_with_the_period_amplitude_and_stick_fraction_of_the_closed_form(duration):
    hunting, expected = classify(run_for(duration)), cycle()
    assert hunting.verdict == "hunting"
    assert hunting.cycles
    assert hunting.period_s == pytest.approx(2 * expected.half, rel=1e-3)
    assert hunting.amplitude_rad == pytest.approx(expected.amplitude, rel=1e-3)
    assert hunting.motor_amplitude_rad == pytest.approx(expected.amplitude, rel=1e-3)
    assert hunting.stick_fraction == pytest.approx(expected.stick_fraction, rel=2e-3)


@pytest.mark.parametrize("viscous", [1.0, 5.0, 20.0])
def test_viscous_friction_slows_the_cycle_and_does_not_end_it(viscous):
    hunting, expected = classify(run_for(1000.0, mass(viscous=viscous), resolution=0.05)), cycle(viscous)
    assert hunting.verdict == "hunting"
    assert hunting.period_s == pytest.approx(2 * expected.half, rel=1e-3)
    assert hunting.amplitude_rad == pytest.approx(expected.amplitude, rel=1e-3)
    assert hunting.stick_fraction == pytest.approx(expected.stick_fraction, rel=2e-3)


@pytest.mark.parametrize(("viscous", "duration"), [(50.0, 300.0), (100.0, 400.0), (200.0, 700.0)])
def test_a_slow_way_into_the_cycle_is_not_called_rest(viscous, duration):
    # swings shrink here from the first step on, by less and less, until the cycle is met
    assert classify(run_for(2 * duration, mass(viscous=viscous))).verdict == "hunting"
    hunting = classify(run_for(duration, mass(viscous=viscous)))
    assert hunting.verdict == "irregular", hunting.reason


@pytest.mark.parametrize("duration", [10.0, 20.0, 30.0, 40.0, 60.0])
def test_a_run_too_short_to_show_the_cycle_is_undecided_or_irregular(duration):
    hunting = classify(run_for(duration))
    assert hunting.verdict == ("undecided" if duration < 60 else "irregular"), hunting.reason
    assert not hunting.decided
    assert "simulate longer" in hunting.reason
    assert not hunting.cycles
    assert np.isnan(hunting.period_s)


@pytest.mark.parametrize("duration", [150.0, 300.0])
def test_without_extra_breakaway_friction_the_mass_comes_to_rest(duration):
    assert classify(run_for(duration, mass(breakaway=COULOMB))).verdict == "rest"


def test_releases_and_stops_repeat_every_half_period():
    expected, run = cycle(), run_for(300.0)
    late = [change for change in run.changes if change.time > 150]
    assert {change.contact for change in late} == {GUIDE}
    assert [change.after for change in late[:4]] in (
        ["stuck", "forward", "stuck", "backward"],
        ["forward", "stuck", "backward", "stuck"],
        ["stuck", "backward", "stuck", "forward"],
        ["backward", "stuck", "forward", "stuck"],
    )
    for releases in (True, False):
        times = [change.time for change in late if (change.before == "stuck") == releases]
        np.testing.assert_allclose(np.diff(times), expected.half, rtol=0, atol=1e-6)


@pytest.mark.parametrize("share", [1.0, 2.0, 0.5], ids=["on", "above", "below"])
def test_the_cycle_does_not_depend_on_the_start(share):
    expected = cycle()
    run = run_for(300.0, start=starting_at(share * expected.amplitude))
    hunting = classify(run)
    assert hunting.amplitude_rad == pytest.approx(expected.amplitude, rel=1e-3)
    stops = [
        run["mass.angle"][np.searchsorted(run.t, change.time)] for change in run.changes if change.after == "stuck"
    ]
    distance = abs(np.array(stops) - 1.0)
    first, start = distance[0], share * expected.amplitude
    if share == 1.0:
        assert first == pytest.approx(start, abs=1e-6)
    else:
        assert (first < start) == (share > 1.0)
    np.testing.assert_allclose(distance[8:], expected.amplitude, rtol=0, atol=1e-6)


def test_the_work_of_the_controller_is_energy_and_friction_heat():
    run = run_for(100.0, resolution=0.005)
    loss, speed = run[f"{GUIDE}.friction_loss"], run["mass.speed"]
    work = np.trapezoid(run["motor_torque"] * speed, run.t)
    heat = np.trapezoid(loss, run.t)
    assert loss.min() >= 0
    assert heat == pytest.approx(COULOMB * np.trapezoid(abs(speed), run.t), rel=1e-9)
    assert work == pytest.approx(heat + run["mechanical_energy"][-1] - run["mechanical_energy"][0], rel=1e-4)
    assert heat > 1.0  # J


def test_a_stuck_mass_stands_exactly_still():
    run = run_for(100.0)
    stuck = run.modes[GUIDE] == "stuck"
    assert abs(run["mass.speed"][stuck]).max() == 0.0
    assert abs(run["mass.speed"][~stuck]).max() > 0.01
