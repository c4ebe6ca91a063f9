"""Torque-speed curves against the steady state of the motors' own equations, brute search, and textbook corners."""

import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from actuator.parts.dc_motor import DCMotor
from actuator.parts.inverter import Inverter
from actuator.parts.pmsm import PMSM
from actuator.parts.rotor import Rotor, RotorDrag
from actuator.parts.saturation import Saturation
from actuator.parts.temperature import MotorTemperature, TemperatureDependence
from actuator.parts.torque_speed import torque_speed_curve

BRUSHED = DCMotor(resistance=0.299, inductance=8.2e-5, torque_constant=0.0302, inertia=1.42e-5)
SUPPLY = Inverter(dc_voltage=24.0, current_limit=30.0)
DRIVE = Inverter(dc_voltage=540.0, current_limit=9.1217)
INTERIOR = PMSM(pole_pairs=3, resistance=3.6, inductance_d=0.036, inductance_q=0.051, flux=0.545, inertia=0.015)
ROUND = replace(INTERIOR, inductance_q=0.036)
LOSSLESS = replace(INTERIOR, resistance=1e-9)


def settled(motor, voltages, speed):
    """Currents after a long time at constant voltage and speed, by integration."""
    run = solve_ivp(
        lambda _, i: motor.derivatives(list(i), voltages, speed),
        (0, 1.0),
        [0.0] * len(motor.axes),
        method="LSODA",
        rtol=1e-10,
        atol=1e-10,
    )
    return run.y[:, -1]


def voltages_for(motor, currents, speed):
    motion = motor.coupling_voltages(currents, speed)
    return [motor.resistance * current + emf for current, emf in zip(currents, motion, strict=True)]


def searched(motor, inverter, speed, points=401):
    """Largest torque over the allowed dq currents, id <= 0: a grid, and sequential quadratic programming from there."""
    limit, voltage = inverter.current_limit, inverter.dc_voltage / math.sqrt(3)

    def room(i):
        u, v = voltages_for(motor, [limit * i[0], limit * i[1]], speed)
        return [1 - i[0] ** 2 - i[1] ** 2, 1 - (u**2 + v**2) / voltage**2, -i[0]]

    grid = np.meshgrid(np.linspace(-1, 0, points), np.linspace(0, 1, points))
    torques = np.where(np.all(np.array(room(grid)) >= 0, axis=0), motor.torque([limit * grid[0], limit * grid[1]]), -1)
    best = np.unravel_index(torques.argmax(), torques.shape)
    polished = minimize(
        lambda i: -motor.torque(list(limit * i)),
        [grid[0][best], grid[1][best]],
        constraints={"type": "ineq", "fun": room},
        method="SLSQP",
        options={"ftol": 1e-12},
    )
    return torques.max(), -polished.fun


# -- steady states ------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [0.0, 200.0, 550.0, 700.0, 790.0])
def test_dc_motor_at_its_limit_is_the_steady_state_at_full_voltage(speed):
    curve = torque_speed_curve(BRUSHED, SUPPLY, [speed])
    (at_full_voltage,) = settled(BRUSHED, [24.0], speed)
    assert curve.torques[0] == pytest.approx(0.0302 * min(30.0, at_full_voltage), rel=1e-6)


def test_dc_motor_has_the_corners_of_its_data_sheet():
    """maxon RE 40 at 24 V without friction: 80.2 A and 2.42 N m at stall, no load at 317 rpm/V."""
    strong = replace(SUPPLY, current_limit=1000.0)
    no_load = 24 / 0.0302
    curve = torque_speed_curve(BRUSHED, strong, [0.0, no_load, 1.1 * no_load])
    assert curve.currents["current"][0] == pytest.approx(80.2, rel=2e-3)
    assert curve.torques == pytest.approx([2.42, 0.0, -0.1 * 2.42], rel=2e-3, abs=1e-12)
    corner = (24 - 30 * 0.299) / 0.0302
    around = torque_speed_curve(BRUSHED, SUPPLY, [0.0, corner - 1, corner + 1]).torques
    assert around[0] == around[1] == pytest.approx(0.906) and around[2] < 0.906


@pytest.mark.parametrize("motor", (ROUND, INTERIOR), ids=("round", "interior"))
@pytest.mark.parametrize("field_weakening", [False, True])
@pytest.mark.parametrize("speed", [0.0, 100.0, 150.0, 170.0, 185.0])
def test_synchronous_motor_settles_at_the_current_of_the_curve(motor, field_weakening, speed):
    curve = torque_speed_curve(motor, DRIVE, [speed], field_weakening=field_weakening)
    currents = [curve.currents[axis][0] for axis in motor.axes]
    voltages = voltages_for(motor, currents, speed)
    assert settled(motor, voltages, speed) == pytest.approx(currents, abs=1e-6)
    size, current = math.hypot(*voltages), math.hypot(*currents)
    assert size <= 540 / math.sqrt(3) * (1 + 1e-9)
    assert current <= DRIVE.current_limit * (1 + 1e-9)
    # largest: one of the limits is reached
    assert max(size * math.sqrt(3) / 540, current / DRIVE.current_limit) == pytest.approx(1, rel=1e-8)


@pytest.mark.parametrize("motor", (ROUND, INTERIOR, LOSSLESS), ids=("round", "interior", "lossless"))
@pytest.mark.parametrize("speed", [0.0, 120.0, 160.0, 200.0, 300.0, 450.0])
def test_no_allowed_current_has_more_torque_than_field_weakening(motor, speed):
    torque = torque_speed_curve(motor, DRIVE, [speed], field_weakening=True).torques[0]
    on_a_grid, polished = searched(motor, DRIVE, speed)
    assert on_a_grid <= torque * (1 + 1e-9)
    assert polished == pytest.approx(torque, rel=1e-7)


# -- textbook -----------------------------------------------------------------------------------------


def test_slow_interior_motor_has_maximum_torque_per_ampere():
    """id = (psi - sqrt(psi^2 + 8 (Lq - Ld)^2 I^2))/(4 (Lq - Ld)); Morimoto et al. (1990)."""
    current, difference = DRIVE.current_limit, 0.051 - 0.036
    direct = (0.545 - math.sqrt(0.545**2 + 8 * difference**2 * current**2)) / (4 * difference)
    curve = torque_speed_curve(INTERIOR, DRIVE, [50.0], field_weakening=True)
    assert curve.currents["current_d"][0] == pytest.approx(direct, abs=1e-5)
    assert curve.torques[0] == pytest.approx(INTERIOR.torque([direct, math.sqrt(current**2 - direct**2)]), rel=1e-9)


def test_round_motor_without_resistance_ends_where_the_back_emf_reaches_the_voltage():
    fastest = 540 / math.sqrt(3) / (3 * 0.545)
    motor = replace(ROUND, resistance=1e-9)
    assert torque_speed_curve(motor, DRIVE, [fastest]).torques[0] == pytest.approx(0, abs=1e-3)
    corner = 540 / math.sqrt(3) / (3 * math.hypot(0.545, 0.036 * DRIVE.current_limit))
    torques = torque_speed_curve(motor, DRIVE, [0.0, corner * 0.999, corner * 1.001]).torques
    assert torques[1] == torques[0] > torques[2]


def test_field_weakening_without_resistance_is_where_circle_and_ellipse_meet():
    """we^2 ((psi + Ld id)^2 + (Lq iq)^2) = V^2 with id^2 + iq^2 = I^2, a quadratic in id."""
    speed, current = 250.0, DRIVE.current_limit
    flux = 540 / math.sqrt(3) / (3 * speed)
    roots = np.roots([0.036**2 - 0.051**2, 2 * 0.036 * 0.545, 0.545**2 + (0.051 * current) ** 2 - flux**2])
    direct = next(root for root in roots if -current < root < 0)
    found = torque_speed_curve(LOSSLESS, DRIVE, [speed], field_weakening=True)
    assert found.currents["current_d"][0] == pytest.approx(direct, abs=1e-6)
    assert found.currents["current_q"][0] == pytest.approx(math.sqrt(current**2 - direct**2), abs=1e-6)


def test_torque_falls_with_speed_and_field_weakening_only_adds():
    speeds = np.linspace(0, 185, 60)
    plain, weakened = (torque_speed_curve(INTERIOR, DRIVE, speeds, field_weakening=yes) for yes in (False, True))
    assert (np.diff(plain.torques) <= 1e-9).all() and (np.diff(weakened.torques) <= 1e-6).all()
    assert (weakened.torques >= plain.torques - 1e-9).all()


# -- temperature, drag, picture, errors ---------------------------------------------------------------


def test_heat_and_drag_take_from_the_torque():
    warm = replace(BRUSHED, temperature_dependence=TemperatureDependence(copper=3.93e-3, magnet=-1.1e-3))
    hot = MotorTemperature(393.15, 353.15)
    constant, resistance = 0.0302 * (1 - 1.1e-3 * 60), 0.299 * 1.393
    torque = torque_speed_curve(warm, SUPPLY, [600.0], temperature=hot).torques[0]
    assert torque == pytest.approx(constant * (24 - constant * 600) / resistance)
    dragging = replace(BRUSHED, rotor=Rotor(drag=RotorDrag(viscous=1e-5)))
    assert torque_speed_curve(dragging, SUPPLY, [400.0]).torques[0] == pytest.approx(0.0302 * 30 - 1e-5 * 400)
    cold = replace(INTERIOR, temperature_dependence=TemperatureDependence())
    weak = torque_speed_curve(cold, DRIVE, [50.0], field_weakening=True, temperature=hot).torques[0]
    assert weak < torque_speed_curve(INTERIOR, DRIVE, [50.0], field_weakening=True).torques[0]


def test_curve_is_drawn_where_asked():
    _, ax = plt.subplots()
    curve = torque_speed_curve(BRUSHED, SUPPLY, [0.0, 100.0])
    assert curve.plot(ax) is ax
    assert ax.lines[0].get_ydata() == pytest.approx(curve.torques)
    plt.close("all")


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            lambda: torque_speed_curve(ROUND, DRIVE, [400.0]),
            "at 400 rad/s no current within 9.1217 A, the current",
        ),
        (
            lambda: torque_speed_curve(ROUND, replace(DRIVE, current_limit=0.01), [192.0]),
            "at 192 rad/s no current within 0.01 A, .* without direct current",
        ),
        (
            lambda: torque_speed_curve(BRUSHED, SUPPLY, [1200.0]),
            "at 1200 rad/s no current within 30 A, the current limit, holds the voltage at 24 V; ask for lower speeds",
        ),
        (
            lambda: torque_speed_curve(ROUND, DRIVE, [480.0], field_weakening=True),
            "at 480 rad/s .* with positive torque",
        ),
        (
            lambda: torque_speed_curve(ROUND, DRIVE, [5000.0], field_weakening=True),
            "holds the voltage at 311.769 V .peak, a phase. with field weakening; ask for lower speeds",
        ),
        (lambda: torque_speed_curve(BRUSHED, SUPPLY, [0.0, -3.0]), "speeds must be >= 0 rad/s, got -3 rad/s"),
        (
            lambda: torque_speed_curve(
                replace(INTERIOR, saturation=Saturation(lost_q=1e-3, current_d=5.0, current_q=5.0)), DRIVE, [0.0]
            ),
            "give the motor without saturation",
        ),
    ],
)
def test_what_has_no_steady_state_is_refused(ask, message):
    with pytest.raises(ValueError, match=message):
        ask()
