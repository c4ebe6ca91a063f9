"""Contacts that share shafts, in runs: against one contact with the sum of their limits, and against time stepping.

The time stepping is J. J. Moreau's: over each step the impulses of friction are those within their limits that make the
kinetic energy of the end the least, found by a bounded least-squares solver. It knows no events and no modes, and
shares nothing with the engine.
"""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from actuator import Actuator, Load, Sine, Table, TorqueSource, find_orbit, simulate
from controllers import PID
from gear import Bearing, Coulomb, GivenPair, Linear, Mesh, Shaft, Transmission


def on_one_shaft(inertia, controller=None, **bearings):
    """A shaft on bearings, each with its sliding and breakaway torque."""
    found = {name: Bearing(shaft="s", coulomb=coulomb, breakaway=most) for name, (coulomb, most) in bearings.items()}
    gear = Transmission(shafts={"s": Shaft(inertia=inertia)}, bearings=found, input="s", output="s")
    return Actuator(motor=TorqueSource(), gear=gear, controller=controller)


@pytest.mark.parametrize(
    "load", [Sine(amplitude=9.9, frequency=0.25), Table(times=(0, 1, 3, 5), values=(0, 9.9, -9.9, 0))]
)
def test_bearings_side_by_side_hold_the_sum_of_their_limits_to_and_fro(load):
    plant = on_one_shaft(0.01, bearing=(5.0, 9.0), seal=(0.5, 1.0))
    run = simulate(plant, 5.0, inputs={"load_torque": load}, compiled=False)
    assert not run.changes
    assert not run["load_angle"].any()
    assert run["gear.bearings.bearing.friction"] == pytest.approx(9 * run["gear.bearings.seal.friction"])


@pytest.mark.parametrize(
    ("bearings", "values", "breaks"),
    [
        ({"a": (0.5, 0.6), "b": (0.6, 0.7)}, (0.0, 2.0), 1.3),
        ({"a": (0.1, 0.2), "b": (0.5, 1.0)}, (0.0, 1.15, -2.0), -1.2),
        ({"a": (0.2, 0.2), "b": (1.0, 1.0), "c": (0.1, 0.3)}, (0.0, 1.49, -1.4, 2.0), 1.5),
    ],
)
def test_a_group_lets_go_at_the_sum_of_its_limits_whatever_came_before(bearings, values, breaks):
    load = Table(times=tuple(10.0 * k for k in range(len(values))), values=values)
    run = simulate(on_one_shaft(1.0, **bearings), load.times[-1], inputs={"load_torque": load}, compiled=False)
    first = [change for change in run.changes if change.before == "stuck"][: len(bearings)]
    assert np.interp(first[0].time, load.times, load.values) == pytest.approx(breaks, abs=1e-8)
    assert {change.contact for change in first} == set(run.modes)
    assert len({change.time for change in first}) == 1


@pytest.mark.parametrize(
    "bearings",
    [
        {"both": (1.0, 1.5)},
        {"bearing": (0.9, 0.9), "seal": (0.1, 0.6)},
        {"bearing": (0.2, 0.2), "seal": (0.8, 1.3)},
    ],
)
def test_lumped_or_split_friction_gives_the_same_hunting(bearings):
    """Period and amplitude from matrix exponentials of the two motions between located events."""
    plant = on_one_shaft(1.0, PID(proportional=3.0, integral=4.0, derivative=6.0), **bearings)
    run = simulate(plant, 300.0, start={"s.angle": 1.0}, resolution=0.05)
    orbit = find_orbit(plant, run)
    assert orbit.period == pytest.approx(23.36927229308833, rel=1e-9)
    assert orbit.load_amplitude == pytest.approx(0.06724014692086697, rel=1e-8)


@pytest.mark.parametrize("duration", [3600.0, 86400.0])
@pytest.mark.parametrize(
    ("inertia", "bearings", "torque"),
    [
        (0.035, {"a": (5.0, 9.0)}, 5.0),
        (1e-6, {"a": (0.03, 0.05), "b": (0.02, 0.03)}, 0.0593),
        (1e-7, {"a": (0.03, 0.05), "b": (0.02, 0.03)}, 0.0593),
    ],
)
def test_what_is_stuck_stays_for_ever(inertia, bearings, torque, duration):
    plant = on_one_shaft(inertia, **bearings)
    run = simulate(plant, duration, inputs={"load_torque": torque}, resolution=duration / 200, compiled=False)
    assert not run["load_angle"].any()
    assert not run["load_speed"].any()


# -- against time stepping ------------------------------------------------------------------------------

INERTIA = np.array([1e-2, 3e-2])
RADII, ARMS, ANGLE = (0.02, 0.05), (0.004, 0.007), np.radians(20)
STIFFNESS, DAMPING, MU = 1e5, 300.0, 0.25


def two_shafts(stick_by, bearings):
    """Two wheels whose mesh rubs, and two bearings on each shaft."""
    pair = GivenPair(
        radius_a=RADII[0], radius_b=RADII[1], friction_arm_a=ARMS[0], friction_arm_b=ARMS[1], pressure_angle=ANGLE
    )
    mesh = Mesh(
        a="a",
        b="b",
        pair=pair,
        elasticity=Linear(stiffness=STIFFNESS, damping=DAMPING),
        friction=Coulomb(sliding=MU, static=MU),
        stick_by=stick_by,
    )
    gear = Transmission(
        shafts={"a": Shaft(inertia=INERTIA[0]), "b": Shaft(inertia=INERTIA[1])},
        meshes={"mesh": mesh},
        bearings={f"{s}{k}": Bearing(shaft=s, coulomb=most, breakaway=most) for s, k, most in bearings},
        input="a",
        output="b",
    )
    return Actuator(motor=TorqueSource(), gear=gear, load=Load())


def stepped(bearings, loads, duration, step):
    """Angles at every step, by Moreau's time stepping; friction along the speed it stops."""
    rows = [np.array([ARMS[0], -ARMS[1]])] + [np.eye(2)["ab".index(s)] for s, _, _ in bearings]
    torque, root = np.array(rows), np.sqrt(INERTIA)
    angle, speed, path = np.zeros(2), np.zeros(2), []
    for k in range(round(duration / step)):
        middle = angle + step / 2 * speed
        force = STIFFNESS * (middle @ RADII) + DAMPING * (speed @ RADII)
        outside = np.array([load((k + 0.5) * step) for load in loads]) - force * np.cos(ANGLE) * np.array(RADII)
        free = speed + step * outside / INERTIA
        limit = step * np.array([MU * abs(force), *(most for _, _, most in bearings)]) + 1e-15
        impulse = lsq_linear(torque.T / root[:, None], root * free, (-limit, limit), method="bvls", tol=1e-14).x
        speed = free - torque.T @ impulse / INERTIA
        angle = middle + step / 2 * speed
        path.append(angle)
    return np.array(path)


@pytest.mark.parametrize("split", [0.5, 0.9])
def test_a_train_with_redundant_bearings_moves_as_time_stepping_moves_it(split):
    """Loads turn round on both shafts; contacts hold, let go and hold again, alone and together."""
    bearings = [("a", 1, 0.3 * split), ("a", 2, 0.3 * (1 - split)), ("b", 1, 0.8 * split), ("b", 2, 0.8 * (1 - split))]
    motor, load = Sine(amplitude=1.1, frequency=3.0), Sine(amplitude=1.6, frequency=1.3)
    plant = two_shafts("conjugate speed", bearings)
    inputs = {"torque_reference": motor, "load_torque": load}
    run = simulate(plant, 1.0, inputs=inputs, resolution=1e-3, tolerance=1e-9, compiled=False)
    loads = [lambda t, s=s: s.amplitude * np.sin(2 * np.pi * s.frequency * t) for s in (motor, load)]
    errors = []
    for step in (4e-4, 1e-4):
        path = stepped(bearings, loads, 1.0, step)
        times = step * np.arange(1, len(path) + 1)
        ours = np.column_stack([np.interp(times, run.t, run[f"{side}_angle"]) for side in ("motor", "load")])
        errors.append(abs(path - ours).max() / abs(ours).max())
    stuck = {name: (mode == "stuck").mean() for name, mode in run.modes.items()}
    assert len(run.changes) > 20 and all(0 < part < 1 for part in stuck.values())
    assert errors[1] < 2e-3
    assert errors[1] < errors[0] / 2
