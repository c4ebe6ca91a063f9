"""Exact periodic orbits of a mass on a guide.

Oracles: the published numbers of the textbook case (23.369272293088 s), a closed form of its own by matrix exponentials
for other gains, viscous friction and dead bands (`mass_on_guide.py`), and the exact trivial multiplier.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from mass_on_guide import MassOnGuide

from actuator import Actuator, Load, NoOrbit, TorqueSource, classify, continue_orbit, find_orbit, simulate
from actuator.orbits.flow import flow_map
from actuator.orbits.sampled import SampledOrbit
from actuator.orbits.segments import passage
from controllers import PID, Sampling
from gear import GivenPair, Linear, Mesh, Shaft, Stribeck, Transmission

pytestmark = pytest.mark.thorough

GUIDE = "gear.bearings.guide"
CASES = {
    "viscous": MassOnGuide(viscous=5.0),
    "little breakaway": MassOnGuide(breakaway=1.05),
    "stiff": MassOnGuide(kp=8.0, ki=10.0, kd=5.0),
    "dead band": MassOnGuide(dead=0.02),
    "wide dead band": MassOnGuide(dead=0.04, viscous=0.5),
}


@cache
def hunting(mass, duration=400.0):
    """The mass and a run in which it hunts, begun near the cycle."""
    plant, amplitude = mass.actuator(), mass.cycle(low=mass.dead + 1e-4).amplitude
    start = {"mass.angle": 1 - 1.2 * amplitude, "controller.integral": mass.breakaway - mass.kp * 1.2 * amplitude}
    return plant, simulate(plant, duration, inputs={"reference": 1.0}, start=start, resolution=0.02, compiled=False)


def orbit_of(mass, **options):
    plant, run = hunting(mass, 2000.0 if mass.breakaway < 1.1 else 400.0)
    return find_orbit(plant, run, compiled=False, **options)


def test_the_published_orbit():
    orbit = orbit_of(MassOnGuide())
    assert orbit.period == pytest.approx(23.369272293088, abs=1e-9)
    assert orbit.load_amplitude == pytest.approx(0.06724014692, abs=1e-10)
    assert orbit.motor_amplitude == pytest.approx(0.06724014692, abs=1e-10)
    assert orbit.stick_fraction == pytest.approx(0.780186658, abs=1e-9)
    assert orbit.multipliers[0] == pytest.approx(0.00785460599, abs=1e-10)
    assert abs(orbit.multipliers[1:]).max() < 1e-10
    assert orbit.trivial_error < 1e-9
    assert orbit.residual < 1e-9
    assert orbit.stable


@pytest.mark.parametrize("mass", CASES.values(), ids=CASES)
def test_orbits_are_those_of_the_closed_form(mass):
    orbit, expected = orbit_of(mass), mass.cycle(low=mass.dead + 1e-4)
    assert orbit.period == pytest.approx(expected.period, rel=1e-9)
    assert orbit.load_amplitude == pytest.approx(expected.amplitude, rel=1e-9)
    assert orbit.stick_fraction == pytest.approx(expected.stick_fraction, abs=1e-9)
    assert orbit.multipliers[0] == pytest.approx(expected.multiplier, abs=1e-8)
    assert orbit.trivial_error < 1e-8


@pytest.mark.parametrize("segments", [2, 3, 4])
def test_an_orbit_does_not_depend_on_the_number_of_arcs(segments):
    one, many = orbit_of(MassOnGuide()), orbit_of(MassOnGuide(), segments=segments)
    assert many.period == pytest.approx(one.period, abs=1e-9)
    np.testing.assert_allclose(many.multipliers, one.multipliers, rtol=0, atol=1e-9)


def test_the_events_of_the_orbit_are_those_of_the_cycle():
    orbit = orbit_of(MassOnGuide())
    way, back = ("forward", "backward") if orbit.modes == (1,) else ("backward", "forward")
    assert [(event.contact, event.before, event.after) for event in orbit.events] == [
        (GUIDE, way, "stuck"),
        (GUIDE, "stuck", back),
        (GUIDE, back, "stuck"),
        (GUIDE, "stuck", way),
    ]
    slide = MassOnGuide().slide(orbit.load_amplitude)[0]
    assert [event.time for event in orbit.events] == pytest.approx(
        [slide, orbit.period / 2, orbit.period / 2 + slide, orbit.period], abs=1e-8
    )
    assert orbit.sequence in (((1,), (0,), (-1,), (0,)), ((-1,), (0,), (1,), (0,)))


def test_corners_of_a_dead_band_are_cut_out_of_the_segments():
    orbit = orbit_of(CASES["dead band"])
    assert len(orbit.sequence) == 4
    assert len(orbit.segments) == 8  # each slide enters and leaves the dead band
    x, m, u, p = orbit.starts[1], orbit.segments[1].modes, orbit.u, orbit.p
    error = 1 - x[[state.name for state in orbit.system.states].index("mass.angle")]
    assert abs(error) == pytest.approx(0.02, abs=1e-12)
    assert np.isfinite(orbit.map.rate(x, m, u, p)).all()


def test_parameters_other_than_those_of_the_run():
    plant, run = hunting(MassOnGuide())
    orbit = find_orbit(plant, run, parameters={"controller.integral": 5.0}, compiled=False)
    expected = MassOnGuide(ki=5.0).cycle()
    assert orbit.period == pytest.approx(expected.period, abs=1e-8)
    assert orbit.multipliers[0] == pytest.approx(expected.multiplier, abs=1e-8)


def test_derivatives_of_the_return_map_by_parameters_are_those_of_difference_quotients():
    orbit = orbit_of(MassOnGuide(), tolerance=1e-11)
    names = [parameter.name for parameter in orbit.system.parameters]
    column = np.zeros((len(names), 1))
    column[names.index("controller.integral")] = 1
    through = passage(orbit.map, orbit.x0, orbit.segments, orbit.u, orbit.p, np.zeros((orbit.x0.size, 1)), column)
    ends = []
    for step in (1e-4, -1e-4):
        ends.append(passage(orbit.map, orbit.x0, orbit.segments, orbit.u, orbit.p + step * column.ravel()))
    assert (ends[0].duration - ends[1].duration) / 2e-4 == pytest.approx(through.delayed[0], rel=1e-6)
    np.testing.assert_allclose((ends[0].end - ends[1].end) / 2e-4, through.moved[:, 0], rtol=1e-6, atol=1e-8)


def test_without_extra_breakaway_friction_there_is_no_orbit():
    plant = MassOnGuide(breakaway=1.0).actuator()
    run = simulate(plant, 150.0, inputs={"reference": 1.0}, compiled=False)
    with pytest.raises(NoOrbit, match="does not end in a cycle but in 'rest'"):
        find_orbit(plant, run, compiled=False)


def test_a_cycle_is_not_followed_to_parameters_at_which_it_does_not_exist():
    plant, run = hunting(MassOnGuide())
    with pytest.raises(NoOrbit, match=r"mass on a guide: .*\d"):
        find_orbit(plant, run, parameters={"gear.bearings.guide.breakaway": 1.0}, compiled=False)


def test_more_arcs_than_segments_are_refused():
    plant, run = hunting(MassOnGuide())
    with pytest.raises(ValueError, match="segments must be 1 to 4 on this orbit, got 9"):
        find_orbit(plant, run, segments=9, compiled=False)


def test_a_plot_shows_the_period_and_the_multipliers():
    orbit = orbit_of(MassOnGuide())
    figure = orbit.plot()
    assert [axes.get_xlabel() for axes in figure.axes][-2:] == ["time in s", "real"]
    with pytest.raises(KeyError, match="no output named 'load_angel'; did you mean load_angle"):
        orbit.plot(["load_angel"])


def test_the_flow_map_is_built_once_per_system():
    system = hunting(MassOnGuide())[0].system()
    assert flow_map(system, 1e-10, False) is flow_map(system, 1e-10, False)


def test_a_sampled_system_has_a_sampled_orbit():
    plant = replace(MassOnGuide().actuator(), sampling=Sampling(position=5e-2))
    run = simulate(plant, 150.0, start={"mass.angle": 0.1}, resolution=1e-2, tolerance=1e-9, compiled=False)
    orbit = find_orbit(plant, run, compiled=False)
    assert isinstance(orbit, SampledOrbit)
    assert orbit.period == pytest.approx(23.369, rel=0.05)
    with pytest.raises(ValueError, match="segments must be 1 for mass on a guide, which is sampled, got 2"):
        find_orbit(plant, run, segments=2, compiled=False)
    with pytest.raises(ValueError, match="continue_orbit: controller.integral = .* must lie between its bounds 5, 6"):
        continue_orbit(orbit, "controller.integral", (5.0, 6.0), upward=True)
    signals = orbit.signals(["load_angle"])
    assert orbit.times[-1] == pytest.approx(orbit.period)
    assert np.ptp(signals["load_angle"]) / 2 == orbit.load_amplitude


def test_a_mass_with_a_stribeck_law_has_an_orbit():
    pair = GivenPair(radius_a=1.0, radius_b=1.0, friction_arm_a=1.0, friction_arm_b=0.0, pressure_angle=1e-9)
    guide = Mesh(
        a="mass",
        b="weight",
        pair=pair,
        elasticity=Linear(stiffness=1e6, damping=0.2),
        friction=Stribeck(static=1.5, coulomb=1.0, stribeck_speed=0.02),
        stick_by="conjugate speed",
    )
    shafts = {"mass": Shaft(inertia=1.0), "weight": Shaft(inertia=1e-8)}
    plant = Actuator(
        motor=TorqueSource(),
        load=Load(bias=1.0),  # presses the mass on its guide
        controller=PID(proportional=3.0, integral=10.0, derivative=6.0),
        gear=Transmission(shafts=shafts, meshes={"guide": guide}, input="mass", output="weight"),
    )
    start = {"mass.angle": 0.06, "weight.angle": -0.06, "controller.integral": -1.0}
    run = simulate(plant, 200.0, start=start, resolution=0.02)
    orbit = find_orbit(plant, run)
    assert orbit.period == pytest.approx(classify(run).period_s, rel=1e-3)
    assert orbit.trivial_error < 1e-6
