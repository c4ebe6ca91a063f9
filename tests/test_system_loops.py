"""The loops of a drive against what they were designed for.

Oracles: the pole a current loop was designed to have; the torque-speed curve in closed form; the recursion of plant
(zero-order hold, from `control.c2d`) and control laws, written out here tick by tick.
"""

from dataclasses import replace

import control
import numpy as np
import pytest

from actuator import (
    PMSM,
    Actuator,
    DCMotor,
    Inverter,
    Load,
    TorqueSource,
    linearize,
    simulate,
    torque_speed_curve,
    trim,
)
from controllers import PI, Cascade, P, Sampling
from gear import Bearing, Shaft, Transmission

BANDWIDTH, RESISTANCE, INDUCTANCE, CONSTANT = 3000.0, 0.3, 4e-4, 0.075
INERTIA, ROTOR = 1e-4, 2e-5
INVERTER = Inverter(dc_voltage=48.0, current_limit=30.0)
BRUSHED = DCMotor(resistance=RESISTANCE, inductance=INDUCTANCE, torque_constant=CONSTANT, inertia=ROTOR)
ROUND = PMSM(
    pole_pairs=4,
    resistance=RESISTANCE,
    inductance_d=INDUCTANCE,
    inductance_q=INDUCTANCE,
    flux=CONSTANT / 6,
    inertia=ROTOR,
)
MOTORS = pytest.mark.parametrize("motor", [BRUSHED, ROUND], ids=["DC motor", "PMSM"])
SPEED = PI.for_inertia(inertia=INERTIA + ROTOR, bandwidth=200.0, integral_bandwidth=40.0)
CURRENT = PI.for_winding(resistance=RESISTANCE, inductance=INDUCTANCE, bandwidth=BANDWIDTH)


def rotor(locked=False, viscous=0.0):
    bearing = Bearing(shaft="rotor", coulomb=0.0, breakaway=1e3 if locked else 0.0, viscous=viscous)
    bearings = {"lock": bearing} if locked or viscous else {}
    return Transmission(shafts={"rotor": Shaft(inertia=INERTIA)}, bearings=bearings, input="rotor", output="rotor")


def drive(motor, sampling=None, gear=None, load=None, **law):
    """A speed drive without a gear."""
    controller = Cascade(position=None, speed=SPEED, current=CURRENT, speed_limit=2000.0)
    source = isinstance(motor, TorqueSource)
    return Actuator(
        motor=motor,
        inverter=None if source else INVERTER,
        gear=gear or rotor(),
        load=load or Load(),
        controller=replace(controller, **({"current": None} if source else {}), **law),
        sampling=sampling,
    )


@MOTORS
def test_a_current_loop_has_the_pole_it_was_designed_for(motor):
    """The zero of the PI cancels R/L, which leaves T(s) = bandwidth/(s + bandwidth)."""
    point = trim(drive(motor, gear=rotor(locked=True)), "stuck")
    axis = motor.axes[-1]
    loop = linearize(point, ["inject.torque_reference"], [f"motor.{axis}"])
    kept = [k for k, name in enumerate(loop.state_labels) if name in (f"motor_{axis}", f"controller_{axis}_integral")]
    poles = np.sort(np.linalg.eigvals(loop.A[np.ix_(kept, kept)]).real)
    np.testing.assert_allclose(poles, [-BANDWIDTH, -RESISTANCE / INDUCTANCE], rtol=1e-9)
    s = 1j * np.logspace(1, 5, 30)
    np.testing.assert_allclose(loop(s) * CONSTANT, BANDWIDTH / (s + BANDWIDTH), rtol=1e-9)


SPEEDS = (50.0, 300.0, 560.0)


@MOTORS
@pytest.mark.parametrize("speed", SPEEDS)
def test_the_largest_torque_at_a_speed_takes_the_whole_voltage_or_the_whole_current(motor, speed):
    curve = torque_speed_curve(motor, INVERTER, [speed])
    torque = float(curve.torques[0])
    point = trim(
        drive(motor),
        "stuck",
        inputs={"speed_reference": speed, "load_torque": -torque},
        guess={"rotor.speed": speed},
        drifting=("rotor.angle",),
    )
    most = INVERTER.dc_voltage / (1 if motor is BRUSHED else np.sqrt(3))
    used = abs(point.outputs["current"]) / INVERTER.current_limit, point.outputs["voltage_magnitude"] / most
    assert point.states["rotor.speed"] == pytest.approx(speed, rel=1e-9)
    assert max(used) == pytest.approx(1.0, rel=1e-9)
    assert point.states[f"motor.{motor.axes[-1]}"] == pytest.approx(curve.currents[motor.axes[-1]][0], rel=1e-9)


@pytest.mark.parametrize("damping", [2e-2, 4e-3, 5e-4])
def test_a_dc_motor_asked_for_too_much_speed_ends_on_its_torque_speed_curve(damping):
    run = simulate(
        drive(BRUSHED, load=Load(damping=damping)),
        2.0,
        inputs={"speed_reference": 1500.0},
        resolution=1e-2,
        tolerance=1e-9,
        compiled=False,
    )
    speed = run["motor_speed"][-1]
    torque = torque_speed_curve(BRUSHED, INVERTER, [speed]).torques[0]
    assert damping * speed == pytest.approx(torque, rel=1e-6)


# -- sampled --------------------------------------------------------------------------------------------


def plant_of(a, b, period):
    system = control.c2d(control.ss(a, b, np.eye(len(a)), 0), period)
    return np.asarray(system.A), np.asarray(system.B)[:, 0]


@MOTORS
@pytest.mark.parametrize("delay", [0, 1])
def test_a_discrete_current_loop_is_its_recursion(motor, delay):
    period, ticks, asked = 1e-4, 60, 0.2
    sampling = Sampling(current=period, speed=5 * period, delay=delay)
    run = simulate(
        drive(motor, sampling, gear=rotor(locked=True)),
        ticks * period,
        inputs={"inject.torque_reference": asked},
        resolution=period,
        tolerance=1e-11,
        compiled=False,
    )
    (a,), (b,) = plant_of([[-RESISTANCE / INDUCTANCE]], [[1 / INDUCTANCE]], period)
    current, integral, pending, expected = 0.0, 0.0, [0.0] * delay, []
    for _ in range(ticks + 1):
        expected.append(current)
        error = asked / CONSTANT - current
        pending.append(CURRENT.proportional * error + integral)
        integral += period * CURRENT.integral * error
        current = a[0] * current + b * pending.pop(0)
    np.testing.assert_allclose(run[f"motor.{motor.axes[-1]}"], expected, rtol=0, atol=1e-9)
    assert expected[-1] == pytest.approx(asked / CONSTANT, rel=1e-2)


@pytest.mark.parametrize("delay", [0, 1])
def test_discrete_current_and_speed_loops_are_their_recursion(delay):
    """A DC motor on its inertia, the speed loop at every fifth tick, without decoupling."""
    period, every, ticks, asked = 1e-4, 5, 400, 20.0
    run = simulate(
        drive(BRUSHED, Sampling(current=period, speed=every * period, delay=delay), decoupling=False),
        ticks * period,
        inputs={"speed_reference": asked},
        resolution=period,
        tolerance=1e-11,
        compiled=False,
    )
    inertia = INERTIA + ROTOR
    a, b = plant_of(
        [[-RESISTANCE / INDUCTANCE, -CONSTANT / INDUCTANCE], [CONSTANT / inertia, 0]], [[1 / INDUCTANCE], [0]], period
    )
    x, integral, outer, pending, reference, expected = np.zeros(2), 0.0, 0.0, [0.0] * delay, 0.0, []
    for tick in range(ticks + 1):
        expected.append(x)
        if tick % every == 0:
            error = asked - x[1]
            reference = (SPEED.proportional * error + outer) / CONSTANT
            outer += every * period * SPEED.integral * error
        error = reference - x[0]
        pending.append(CURRENT.proportional * error + integral)
        integral += period * CURRENT.integral * error
        x = a @ x + b * pending.pop(0)
    expected = np.array(expected)
    assert abs(expected[:, 0]).max() < INVERTER.current_limit
    np.testing.assert_allclose(run["motor.current"], expected[:, 0], rtol=0, atol=1e-9 * INVERTER.current_limit)
    np.testing.assert_allclose(run["motor_speed"], expected[:, 1], rtol=0, atol=1e-9 * asked)


@pytest.mark.parametrize("delay", [0, 1])
def test_discrete_position_and_speed_loops_are_their_recursion(delay):
    period, every, ticks, asked = 1e-3, 2, 200, 0.5
    plant = drive(
        TorqueSource(), Sampling(speed=period, position=every * period, delay=delay), position=P.for_bandwidth(25.0)
    )
    run = simulate(
        plant, ticks * period, inputs={"reference": asked}, resolution=period, tolerance=1e-11, compiled=False
    )
    a, b = plant_of([[0, 1], [0, 0]], [[0], [1 / INERTIA]], period)
    x, integral, pending, wanted, expected = np.zeros(2), 0.0, [0.0] * delay, 0.0, []
    for tick in range(ticks + 1):
        expected.append(x[0])
        if tick % every == 0:
            wanted = 25.0 * (asked - x[0])
        error = wanted - x[1]
        pending.append(SPEED.proportional * error + integral)
        integral += period * SPEED.integral * error
        x = a @ x + b * pending.pop(0)
    np.testing.assert_allclose(run["load_angle"], expected, rtol=0, atol=1e-9)
