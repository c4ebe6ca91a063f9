"""Loads: rotational and linear, gravity, gusts.

Oracles: the pendulum; the geometry of link and lever; derivatives by CasADi; the balance of power; the time of a
turn by quadrature; the accelerations of a nut on an inclined thread by hand.
"""

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from oracles import gradient_in_symbols, in_symbols, numbers
from scipy.integrate import quad
from scipy.special import ellipk

from actuator import (
    Actuator,
    Gravity,
    Gust,
    HybridSystem,
    Lever,
    LinearLoad,
    Load,
    Rack,
    Screw,
    TorqueSource,
    simulate,
)
from actuator.simulation.signals import Ramp, Sine, Step, Sum, bounds, break_points, piece_at
from actuator.system.contacts import ContactMechanics
from actuator.system.hybrid import Quantity
from actuator.system.parameters import parameterize
from gear import Bearing, Coulomb, EndStop, Linear, Mesh, ScrewPair, Shaft, Transmission
from studies import load_case

MECHANISMS = (
    Rack(radius=0.02),
    Screw(lead=5e-3),
    Lever(radius=0.1),
    Lever(radius=0.1, angle=0.4, link=0.35, offset=0.08),
)
LOADS = tuple(
    LinearLoad(mass=8.0, stiffness=300.0, damping=40.0, force=-70.0, mechanism=mechanism) for mechanism in MECHANISMS
)

angles, speeds, pushes = numbers(-3.0, 3.0), numbers(-20.0, 20.0), numbers(-500.0, 500.0)


# -- laws -----------------------------------------------------------------------------------------------


@given(angle=angles, speed=speeds)
def test_a_balanced_load_has_no_more_than_its_derivatives(angle, speed):
    load = Load(inertia=0.3, stiffness=40.0, damping=0.2, bias=8.0)
    assert load.torque(angle, speed) == 8.0 - 40.0 * angle - 0.2 * speed
    assert (load.inertia_at(angle), load.kinetic(angle, speed)) == (0.3, 0.3 * speed**2 / 2)


def test_weight_pulls_toward_the_hanging_angle():
    weight = Gravity(moment=12.0, hanging_angle=-0.5)
    assert weight.torque(-0.5) == 0
    assert weight.torque(-0.5 + math.pi / 2) == pytest.approx(-12.0)
    assert weight.torque(-0.5 - math.pi / 6) == pytest.approx(6.0)


@pytest.mark.parametrize("mechanism", MECHANISMS)
@settings(deadline=None)
@given(angle=angles)
def test_slope_and_curvature_are_derivatives_of_the_travel(mechanism, angle):
    travel = mechanism.travel(angle)
    first = gradient_in_symbols(lambda x: mechanism.travel(x).position, angle).item()
    second = gradient_in_symbols(lambda x: ca.SX(mechanism.travel(x).slope), angle).item()
    assert (travel.slope, travel.curvature) == pytest.approx((first, second), rel=1e-9, abs=1e-15)
    assert mechanism.travel(0.0).position == 0
    assert in_symbols(lambda x: mechanism.travel(x).position, angle).item() == pytest.approx(travel.position, abs=1e-15)


@given(angle=angles)
def test_the_link_of_a_lever_keeps_its_length(angle):
    lever = MECHANISMS[-1]
    theta = angle + lever.angle
    neutral = lever.radius * math.sin(lever.angle) + math.sqrt(
        lever.link**2 - (lever.radius * math.cos(lever.angle) - lever.offset) ** 2
    )
    rod = np.array([lever.travel(angle).position + neutral, lever.offset])
    end = lever.radius * np.array([math.sin(theta), math.cos(theta)])
    assert np.linalg.norm(rod - end) == pytest.approx(lever.link, rel=1e-12)


def test_a_screw_and_a_rack_are_a_rotational_load_of_the_same_size():
    h = 5e-3 / (2 * math.pi)
    same = Load(inertia=8.0 * h**2, stiffness=300.0 * h**2, damping=40.0 * h**2, bias=-70.0 * h)
    for load in (LOADS[1], LinearLoad(mass=8.0, stiffness=300.0, damping=40.0, force=-70.0, mechanism=Rack(radius=h))):
        assert load.inertia_at(0.7) == pytest.approx(same.inertia)
        assert load.torque(0.7, -3.0) == pytest.approx(same.torque(0.7, -3.0))
        assert load.kinetic(0.7, -3.0) == pytest.approx(same.kinetic(0.7, -3.0))


@pytest.mark.parametrize("load", LOADS)
@settings(deadline=None)
@given(angle=angles, speed=speeds, outside=pushes, drive=pushes)
def test_power_at_the_shaft_is_power_at_the_rod(load, angle, speed, outside, drive):
    """What a torque on the shaft puts in beside the rod's forces goes into kinetic energy, all of it."""
    inertia = 0.05 + load.inertia_at(angle)
    acceleration = (drive + load.torque(angle, speed, outside)) / inertia
    by_angle, by_speed = gradient_in_symbols(lambda q, w: 0.05 * w**2 / 2 + load.kinetic(q, w), angle, speed)
    gained = by_angle * speed + by_speed * acceleration
    x, v = load.position(angle), load.speed(angle, speed)
    on_rod = -70.0 - 300.0 * x - 40.0 * v + outside
    size = abs(drive * speed) + abs(on_rod * v) + abs(by_angle * speed) + 1.0
    assert gained == pytest.approx(drive * speed + on_rod * v, abs=1e-9 * size)
    # the mechanism's force on the rod, seen from the shaft
    felt = drive - 0.05 * acceleration
    force = load.rod_force(angle, speed, acceleration, outside)
    assert force * load.mechanism.travel(angle).slope == pytest.approx(felt, rel=1e-9, abs=1e-9 * size)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Lever(radius=0.1, link=0.15, offset=-0.05), "Lever.link must be > radius .* = 0.15 m, got 0.15 m"),
        (lambda: LinearLoad(mass=-1.0, mechanism=MECHANISMS[0]), "LinearLoad.mass must be >= 0 kg, got -1 kg"),
        (lambda: Gravity(moment=-1.0), "Gravity.moment must be >= 0 N m, got -1 N m"),
        (lambda: Gust(amplitude=1.0, duration=0.0), "Gust.duration must be > 0 s, got 0 s"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_gust_rises_and_falls_once_as_one_minus_cosine():
    gust = Gust(amplitude=30.0, duration=0.4, time=1.0, offset=5.0)
    time = np.array([0.5, 1.0, 1.1, 1.2, 1.3, 1.4, 2.0])
    values = [piece_at(gust, t)(0.0) for t in time]
    np.testing.assert_allclose(values, [5.0, 5.0, 20.0, 35.0, 20.0, 5.0, 5.0], atol=1e-12)
    assert break_points(gust) == [1.0, 1.4]


@pytest.mark.parametrize(
    ("signal", "expected"),
    [
        (Gust(amplitude=-30.0, duration=0.4, time=1.0, offset=5.0), (-25.0, 5.0)),
        (Gust(amplitude=-30.0, duration=0.4, time=3.0, offset=5.0), (5.0, 5.0)),
        (Step(time=0.5, before=-1.0, after=3.0), (-1.0, 3.0)),
        (Ramp(time=1.0, start=1.0, slope=-2.0), (-1.0, 1.0)),
        (Sum(parts=(Sine(amplitude=2.0, frequency=1.0), Step(time=0.5, after=3.0))), (-2.0, 5.0)),
    ],
)
def test_bounds_of_a_signal_hold_all_of_its_values(signal, expected):
    assert bounds(signal, 2.0) == pytest.approx(expected)
    values = [piece_at(signal, time)(0.0) for time in np.linspace(0, 2, 401)]
    assert min(values) >= expected[0] - 1e-9
    assert max(values) <= expected[1] + 1e-9


# -- in motion ------------------------------------------------------------------------------------------


def test_an_unbalanced_load_swings_as_a_pendulum():
    gear = Transmission(shafts={"arm": Shaft(inertia=0.5)}, input="arm", output="arm")
    load = Load(gravity=Gravity(moment=12.0, hanging_angle=0.3))
    amplitude = 2.0
    period = 4 * math.sqrt(0.5 / 12.0) * ellipk(math.sin(amplitude / 2) ** 2)
    servo = Actuator(motor=TorqueSource(torque_limit=1.0), gear=gear, load=load)
    run = simulate(servo, period, start={"arm.angle": 0.3 + amplitude}, tolerance=1e-9)
    assert run["load_angle"][-1] == pytest.approx(0.3 + amplitude, abs=1e-7)
    assert run["load_angle"].min() == pytest.approx(0.3 - amplitude, abs=1e-5)


def on_one_shaft(load, **gear):
    """A hybrid system of one shaft with a load whose inertia depends on the angle."""
    numbers_of = Transmission(shafts={"arm": Shaft(inertia=0.05)}, input="arm", output="arm", **gear)
    train, of_train = parameterize(numbers_of, "gear")
    load, of_load = parameterize(load, "load")
    parameters = (*of_train, *of_load)
    x, torque, force = ca.SX.sym("x", 2), ca.SX.sym("torque"), ca.SX.sym("force")
    angle, speed = {"arm": x[0]}, {"arm": x[1]}
    inertia = {"arm": train.shafts["arm"].inertia + load.inertia_at(x[0])}
    contacts = ContactMechanics(train, False, numbers_of.kinematics(train), inertia, {})
    m = ca.SX.sym("m", len(contacts.mode_variables()))
    modes = contacts.modes(m)
    on_shaft = {"arm": torque + load.torque(x[0], x[1], force)}
    forces = contacts.forces(angle, speed, on_shaft, modes)
    arguments = [x, m, ca.vertcat(torque, force), ca.vertcat(*(parameter.symbol for parameter in parameters))]
    energy = train.shafts["arm"].inertia * x[1] ** 2 / 2 + load.kinetic(x[0], x[1])
    energy += train.elastic_energy(forces.motions, angle, modes.flank)
    fired = ca.SX.sym("fired", len(contacts.events()))
    settle = contacts.reset_function("settle", arguments, fired, angle, speed, on_shaft, m)
    inputs = [ca.MX.sym(f"input{i}", settle.size1_in(i)) for i in range(5)]
    after, settled, fault = settle(*inputs)
    return HybridSystem(
        name="arm",
        states=(Quantity("angle", "rad", 1e-4), Quantity("speed", "rad/s", 0.1)),
        mode_variables=tuple(contacts.mode_variables()),
        inputs=(Quantity("torque", "N m"), Quantity("load_force", "N")),
        outputs=(Quantity("energy", "J"), Quantity("rod", "m")),
        events=tuple(contacts.events()),
        parameters=parameters,
        contacts=tuple(contacts.records({f"gear.{contact.name}": 1 for contact in contacts.contacts})),
        flow=ca.Function("flow", arguments, [ca.vertcat(x[1], forces.acceleration["arm"])]),
        margins=ca.Function("margins", arguments, [contacts.margins(forces, modes)]),
        reset=ca.Function("reset", inputs, [ca.vertcat(inputs[1][0], after), settled, fault]),
        outputs_function=ca.Function("outputs", arguments, [ca.vertcat(energy, load.position(x[0]))]),
    )


def test_a_mass_on_a_turning_lever_speeds_up_and_slows_down_with_its_ratio():
    """Free of force the energy stays, so the speed is that of the inertia at each angle: the turn is a quadrature."""
    mass, radius, speed = 8.0, 0.1, 10.0
    system = on_one_shaft(LinearLoad(mass=mass, mechanism=Lever(radius=radius)))
    energy = (0.05 + mass * radius**2) * speed**2 / 2
    turn, _ = quad(lambda q: math.sqrt((0.05 + mass * (radius * math.cos(q)) ** 2) / (2 * energy)), 0, 2 * math.pi)
    run = simulate(system, turn, start={"speed": speed}, tolerance=1e-9)
    assert run["angle"][-1] == pytest.approx(2 * math.pi, rel=1e-7)
    np.testing.assert_allclose(run["energy"], energy, rtol=1e-7)
    assert run["speed"].max() == pytest.approx(speed * math.sqrt(0.13 / 0.05), rel=1e-5)


def test_a_lever_between_stops_keeps_its_energy_at_every_bounce():
    stops = {"end": EndStop(shaft="arm", lower=-0.6, upper=0.9, stiffness=2e3)}
    run = simulate(on_one_shaft(LOADS[3], stops=stops), 2.0, start={"speed": 8.0}, parameters=FREE, tolerance=1e-8)
    np.testing.assert_allclose(run["energy"], run["energy"][0], rtol=1e-6)
    assert run.statistics.events >= 10
    assert run.margins.min() >= -1e-9


FREE = {"load.stiffness": 0.0, "load.damping": 0.0, "load.force": 0.0}


def test_a_rod_held_by_friction_moves_when_the_force_through_its_ratio_exceeds_it():
    """A square lever turns 50 N at 0.1 m into 5 N m; at 60 degrees the same force is half of that."""
    bearing = {"hinge": Bearing(shaft="arm", coulomb=3.0, breakaway=4.0)}
    system = on_one_shaft(LinearLoad(mass=8.0, mechanism=Lever(radius=0.1)), bearings=bearing)
    for angle, moves in ((0.0, True), (math.pi / 3, False)):
        run = simulate(system, 0.05, inputs={"load_force": 50.0}, start={"angle": angle})
        assert (run.modes["gear.bearings.hinge"][-1] == "forward") == moves
        assert run.margins.min() >= -1e-9
    slowed = simulate(system, 1.0, start={"speed": 5.0})
    assert np.diff(slowed["energy"]).max() <= 1e-9
    assert slowed.modes["gear.bearings.hinge"][-1] == "stuck"
    # friction alone takes the energy, over the angle that was traveled
    assert slowed["energy"][0] == pytest.approx(3.0 * slowed["angle"][-1], rel=1e-5)


# -- a screw with friction ------------------------------------------------------------------------------

RADIUS, LEAD, WEIGHT = 10e-3, 10e-3, 2e3
TURN = LEAD / (2 * math.pi)


def screw_jack(sliding):
    """A weight on a nut; the nut's travel is an angle, so that it is a shaft."""
    thread = Mesh(
        a="spindle",
        b="nut",
        pair=ScrewPair(mean_radius=RADIUS, lead=LEAD),
        elasticity=Linear(stiffness=1e9, damping=1e6),
        friction=Coulomb(sliding=sliding, static=sliding),
        stick_by="conjugate speed",
    )
    gear = Transmission(
        shafts={"spindle": Shaft(inertia=1e-4), "nut": Shaft(inertia=200.0 * TURN**2)},
        meshes={"screw": thread},
        input="spindle",
        output="nut",
    )
    return Actuator(motor=TorqueSource(torque_limit=100.0), gear=gear, load=Load(bias=-WEIGHT * TURN))


def test_a_screw_with_much_friction_holds_its_load_and_one_with_little_runs_down_as_on_a_slope():
    slope = LEAD / (2 * math.pi * RADIUS)  # tan(lambda) = 0.159
    held = simulate(screw_jack(1.05 * slope), 0.2)
    assert held.modes["gear.meshes.screw"][-1] == "stuck"
    assert abs(held["load_speed"][-1]) < 1e-9
    mu = 0.5 * slope
    run = simulate(screw_jack(mu), 0.2)
    lead_angle = math.atan(slope)
    # nut: 200 h w' = N cos + s sin - W;  spindle: J w' = -N r sin + s r cos, with s = mu N against sliding down
    push = RADIUS * (mu * math.cos(lead_angle) - math.sin(lead_angle))
    lift = math.cos(lead_angle) + mu * math.sin(lead_angle)
    normal = WEIGHT / (lift - 200.0 * TURN * push / 1e-4)
    acceleration = push * normal / 1e-4
    assert run["load_speed"][-1] == pytest.approx(acceleration * 0.2, rel=1e-3)
    assert run.margins.min() >= -1e-9


# -- files ----------------------------------------------------------------------------------------------


def test_stops_free_play_gravity_and_gusts_come_from_files(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(
        """
        base = "aileron"

        [load.gravity]
        moment = 3.0
        hanging_angle_deg = -90

        [gear.stops.end]
        shaft = "surface"
        lower_deg = -25
        upper_deg = 20
        stiffness = 2e4

        [gear.couplings.mounting]
        a = "surface"
        stiffness = 10.0
        damping = 0.1
        gap_deg = 2

        [scenario.inputs.load_torque]
        type = "Gust"
        amplitude = 12.0
        duration_ms = 300
        time = 0.5
        """
    )
    case = load_case(path)
    actuator = case.actuator
    assert actuator.load.gravity == Gravity(moment=3.0, hanging_angle=-math.pi / 2)
    assert actuator.gear.output_range() == pytest.approx((math.radians(-25), math.radians(20)))
    assert actuator.gear.couplings["mounting"].gap == pytest.approx(math.radians(2))
    assert {"gear.stops.end.flank", "gear.couplings.mounting.flank"} <= set(actuator.system().modes)
    assert case.inputs["load_torque"] == Gust(amplitude=12.0, duration=0.3, time=0.5)
