"""Whole systems with free play, end stops, jams and flexible mountings.

Oracles: free flight and half a period of a spring for every bounce; energy and momentum, which nothing takes away
without damping; a coupling without gap; static deflection by hand; natural frequencies in closed form and from the
mass and stiffness matrices.
"""

import math

import control
import numpy as np
import pytest
from scipy.linalg import eigh

from actuator import Actuator, Load, Sine, Step, TorqueSource, linearize, simulate, trim
from controllers import PID
from gear import Bearing, Coupling, EndStop, ExternalPair, GivenPair, Mesh, Shaft, Transmission, add_brake

pytestmark = pytest.mark.thorough

INERTIA, STIFFNESS, SPEED = 2.0, 1e4, 1.0
LOWER, UPPER = -0.3, 0.5
MARGIN = -1e-9  # of a margin that holds


def driven(gear, **options):
    return Actuator(motor=TorqueSource(torque_limit=1e3), gear=gear, **options)


def between_stops(damping=0.0, **options):
    stop = EndStop(shaft="mass", lower=LOWER, upper=UPPER, stiffness=STIFFNESS, damping=damping)
    gear = Transmission(
        shafts={"mass": Shaft(inertia=INERTIA)}, stops={"end": stop}, input="mass", output="mass", **options
    )
    return driven(gear)


def two_masses(gap=None, damping=0.0):
    gear = Transmission(
        shafts={"motor": Shaft(inertia=1.0), "load": Shaft(inertia=3.0)},
        couplings={"shaft": Coupling(a="motor", b="load", stiffness=STIFFNESS, damping=damping, gap=gap)},
        input="motor",
        output="load",
    )
    return driven(gear)


def flanks(run, path):
    """Flank at every output point."""
    return run.mode_values[run.system.modes.index(f"gear.{path}.flank")]


def crossings(time, values):
    """Times at which the values rise through zero, between the points by a straight line."""
    k = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    return time[k] - values[k] * (time[k + 1] - time[k]) / (values[k + 1] - values[k])


# -- bounces --------------------------------------------------------------------------------------------


def test_a_mass_bounces_between_its_stops_for_ever_with_the_period_of_flight_and_spring():
    run = simulate(between_stops(), 20.0, start={"mass.speed": SPEED}, tolerance=1e-8)
    period = 2 * ((UPPER - LOWER) / SPEED + math.pi * math.sqrt(INERTIA / STIFFNESS))
    times = crossings(run.t, run["load_angle"])
    np.testing.assert_allclose(np.diff(times), period, rtol=1e-6)
    assert run.statistics.events == 48  # on and off a stop, on two sides, in 11.84 periods from the middle
    energy = run["mechanical_energy"]
    np.testing.assert_allclose(energy, INERTIA * SPEED**2 / 2, rtol=1e-6)
    assert run.margins.min() >= MARGIN
    assert run.statistics.settled == 0
    deepest = run["load_angle"].max() - UPPER
    assert deepest == pytest.approx(SPEED * math.sqrt(INERTIA / STIFFNESS), rel=1e-3)


def test_a_damped_stop_takes_energy_and_never_pulls():
    run = simulate(between_stops(damping=40.0), 10.0, start={"mass.speed": SPEED})
    energy = run["mechanical_energy"]
    assert np.diff(energy).max() < 1e-6 * energy[0]
    assert energy[-1] < 0.8 * energy[0]
    assert run.margins.min() >= MARGIN
    outside = np.abs(run["load_angle"] - (UPPER + LOWER) / 2) < (UPPER - LOWER) / 2
    np.testing.assert_array_equal(flanks(run, "stops.end")[outside], 0)


def test_a_start_beyond_a_stop_begins_on_its_flank():
    run = simulate(between_stops(), 0.02, start={"mass.angle": LOWER - 0.01})
    assert flanks(run, "stops.end")[0] == -1
    assert run["mass.speed"][-1] == pytest.approx(0.01 * 70.71068 * math.sin(70.71068 * 0.02), rel=1e-5)


# -- free play ------------------------------------------------------------------------------------------


def test_two_masses_rattle_in_their_gap_and_keep_momentum_and_energy():
    gap = 0.02
    run = simulate(two_masses(gap), 3.0, start={"motor.speed": SPEED}, tolerance=1e-8)
    reduced = 1.0 * 3.0 / 4.0
    period = 2 * (gap / SPEED + math.pi * math.sqrt(reduced / STIFFNESS))
    twist = run["motor.angle"] - run["load.angle"]
    np.testing.assert_allclose(np.diff(crossings(run.t, twist)), period, rtol=1e-5)
    np.testing.assert_allclose(1.0 * run["motor.speed"] + 3.0 * run["load.speed"], SPEED, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run["mechanical_energy"], SPEED**2 / 2, rtol=1e-6)
    assert run.statistics.events > 100
    assert run.margins.min() >= MARGIN
    assert run.statistics.settled == 0


def test_without_free_play_the_coupling_is_the_plain_one():
    """A gap of zero has modes, the plain coupling has none; without damping the motion is the same."""
    start = {"motor.speed": SPEED}
    plain, closed = (simulate(two_masses(gap), 1.0, start=start, tolerance=1e-9) for gap in (None, 0.0))
    assert two_masses().system().modes == ()
    assert closed.margins.min() >= MARGIN
    ends = [run.state() for run in (plain, closed)]
    assert ends[1] == pytest.approx(ends[0], rel=1e-6, abs=1e-7)


def test_free_play_with_friction_and_stops_is_driven_to_and_fro_without_a_margin_lost():
    """A surface with free play, rubbing bearings and stops, moved across all of its range."""
    gear = Transmission(
        shafts={"motor": Shaft(inertia=1e-2), "surface": Shaft(inertia=5e-2)},
        couplings={"hinge": Coupling(a="motor", b="surface", stiffness=4e3, damping=2.0, gap=0.004)},
        bearings={
            "motor": Bearing(shaft="motor", coulomb=0.5, breakaway=0.8, viscous=0.05),
            "surface": Bearing(shaft="surface", coulomb=0.3, breakaway=0.5, viscous=0.02),
        },
        stops={"surface": EndStop(shaft="surface", lower=-0.1, upper=0.12, stiffness=2e4, damping=10.0)},
        input="motor",
        output="surface",
    )
    actuator = driven(gear, load=Load(stiffness=20.0))
    run = simulate(actuator, 5.0, inputs={"torque_reference": Sine(amplitude=30.0, frequency=1.3)})
    assert run.margins.min() >= MARGIN
    assert set(flanks(run, "couplings.hinge")) == {-1, 0, 1}
    assert set(flanks(run, "stops.surface")) == {-1, 0, 1}
    assert run.statistics.events > 50


def test_a_controller_stays_between_the_stops_and_misled_beyond_them_pushes_with_its_whole_torque():
    gear = Transmission(
        shafts={"surface": Shaft(inertia=0.05)},
        bearings={"hinge": Bearing(shaft="surface", coulomb=0.1, breakaway=0.1, viscous=1.0)},
        stops={"surface": EndStop(shaft="surface", lower=-0.5, upper=0.5, stiffness=1e4, damping=5.0)},
        input="surface",
        output="surface",
    )
    pid = PID(proportional=50.0, integral=20.0, derivative=3.0, limit=40.0)
    servo = driven(gear, controller=pid)
    assert flanks(simulate(servo, 3.0, inputs={"reference": Step(time=0.1, after=0.3)}), "stops.surface").any() == 0
    with pytest.raises(ValueError, match=r"reference goes from 0 rad to 2 rad, .* touches at -0.5 rad and 0.5 rad"):
        simulate(servo, 5.0, inputs={"reference": Step(time=0.1, after=2.0)})
    against = simulate(servo, 5.0, inputs={"inject.position": Step(time=0.1, after=-2.0)})
    # the motor's 40 N m are on the spring of the stop, but for what the bearing may hold
    assert against["load_angle"][-1] - 0.5 == pytest.approx(40.0 / 1e4, abs=0.11 / 1e4)


# -- linear models on each flank ------------------------------------------------------------------------


@pytest.mark.parametrize(("torque", "guess", "flank"), [(50.0, 0.51, 1), (-50.0, -0.31, -1), (0.0, 0.1, 0)])
def test_every_flank_has_its_own_linear_model(torque, guess, flank):
    point = trim(between_stops(), "stuck", inputs={"load_torque": torque}, guess={"mass.angle": guess})
    assert point.flanks == {"gear.stops.end": flank}
    expected = {1: UPPER + torque / STIFFNESS, -1: LOWER + torque / STIFFNESS, 0: guess}[flank]
    assert point.states["mass.angle"] == pytest.approx(expected, rel=1e-9)
    model = linearize(point, ["load_torque"], ["load_angle"])
    stiffness = STIFFNESS * abs(flank)
    np.testing.assert_allclose(model.A, [[0, 1], [-stiffness / INERTIA, 0]], rtol=1e-12, atol=1e-12)


def test_the_coupling_is_trimmed_on_the_flank_that_the_load_chooses():
    """Held by a bearing at the load, the motor's torque turns the coupling; the other way round, the other way."""
    gear = Transmission(
        shafts={"motor": Shaft(inertia=1.0), "load": Shaft(inertia=3.0)},
        couplings={
            "shaft": Coupling(a="motor", b="load", stiffness=STIFFNESS, damping=0.0, gap=0.02),
            "return": Coupling(a="load", stiffness=1e3, damping=0.0),
        },
        input="motor",
        output="load",
    )
    for torque in (7.0, -7.0):
        point = trim(driven(gear), "stuck", inputs={"torque_reference": torque})
        assert point.flanks == {"gear.couplings.shaft": math.copysign(1, torque)}
        twist = point.states["motor.angle"] - point.states["load.angle"]
        assert twist == pytest.approx(math.copysign(0.01, torque) + torque / STIFFNESS, rel=1e-6)
        poles = np.sort(np.abs(control.poles(linearize(point, ["load_torque"], ["load_angle"]))))
        squares = eigh([[11e3, -10e3], [-10e3, 10e3]], np.diag([3.0, 1.0]), eigvals_only=True)
        np.testing.assert_allclose(poles, np.sqrt(np.repeat(squares, 2)), rtol=1e-9)


# -- brakes and jams -----------------------------------------------------------------------------------------------


JAM = "gear.bearings.brake_load"


def with_jam(torque):
    return {f"{JAM}.torque": torque}


def test_a_load_jams_on_the_way():
    actuator = driven(add_brake(two_masses().gear, "load", 0.0))
    push = {"torque_reference": 2.0}
    free = simulate(actuator, 0.5, inputs=push)
    assert free["load.speed"][-1] == pytest.approx(2.0 * 0.5 / 4.0, rel=0.05)
    jammed = simulate(actuator, 0.5, inputs=push, start=free.state(), parameters=with_jam(500.0))
    assert jammed.modes[JAM][0] == "forward"
    assert jammed.modes[JAM][-1] == "stuck"
    assert np.ptp(jammed["load.angle"][-100:]) < 1e-12


@pytest.mark.parametrize(("torque", "holds"), [(3.99, False), (4.01, True)])
def test_a_jam_holds_up_to_its_torque(torque, holds):
    """A step of 2 N m swings up to twice that in the coupling."""
    actuator = driven(add_brake(two_masses().gear, "load", 0.0))
    run = simulate(actuator, 0.1, inputs={"torque_reference": 2.0}, parameters=with_jam(torque))
    assert (set(run.modes[JAM]) == {"stuck"}) == holds


# -- flexible mounting and flexible surface -------------------------------------------------------------


def test_a_gear_on_a_flexible_mounting_resonates_as_its_mass_matrix_says():
    """Rigid teeth: phi_B = (1 + n) phi_G - n phi_A with n = r_A/r_B; only the mounting has stiffness."""
    j_a, j_b, j_g, k = 1e-4, 2e-2, 0.3, 5e4
    gear = Transmission(
        shafts={"motor": Shaft(inertia=j_a), "wheel": Shaft(inertia=j_b), "housing": Shaft(inertia=j_g)},
        meshes={
            "m": Mesh(a="motor", b="wheel", carrier="housing", pair=ExternalPair(teeth_a=20, teeth_b=60, module=1e-3))
        },
        couplings={"mounting": Coupling(a="housing", stiffness=k, damping=0.0)},
        input="motor",
        output="wheel",
    )
    n = 1 / 3
    m_aa, m_ag, m_gg = j_a + n**2 * j_b, -n * (1 + n) * j_b, j_g + (1 + n) ** 2 * j_b
    expected = math.sqrt(k / (m_gg - m_ag**2 / m_aa))
    point = trim(driven(gear), "stuck")
    poles = control.poles(linearize(point, ["torque_reference"], ["load_angle"]))
    assert np.abs(poles.imag).max() == pytest.approx(expected, rel=1e-9)


def test_mounting_and_surface_both_flexible_are_the_eigenvalues_of_mass_and_stiffness():
    """Motor, wheel, surface and housing; elastic in the mounting and in the surface, teeth rigid."""
    j = {"motor": 1e-4, "wheel": 2e-2, "surface": 0.5, "housing": 0.3}
    pair = GivenPair(radius_a=10e-3, radius_b=30e-3, friction_arm_a=1e-3, friction_arm_b=2e-3)
    gear = Transmission(
        shafts={name: Shaft(inertia=inertia) for name, inertia in j.items()},
        meshes={"m": Mesh(a="motor", b="wheel", carrier="housing", pair=pair)},
        couplings={
            "mounting": Coupling(a="housing", stiffness=5e4, damping=0.0),
            "surface": Coupling(a="wheel", b="surface", stiffness=2e3, damping=0.0),
        },
        input="motor",
        output="surface",
    )
    assert gear.ratio() == pytest.approx(-3)
    point = trim(driven(gear), "stuck")
    poles = control.poles(linearize(point, ["torque_reference"], ["load_angle"]))
    # coordinates (motor, wheel, surface, housing) from the independent (wheel, surface, housing)
    shape = np.array([[-3, 0, 4], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    mass = shape.T @ np.diag(list(j.values())) @ shape
    stiffness = np.array([[2e3, -2e3, 0], [-2e3, 2e3, 0], [0, 0, 5e4]])
    expected = np.sqrt(np.clip(eigh(stiffness, mass, eigvals_only=True), 0, None))
    found = np.sort(poles.imag[poles.imag > 1.0])
    np.testing.assert_allclose(found, expected[1:], rtol=1e-9)
