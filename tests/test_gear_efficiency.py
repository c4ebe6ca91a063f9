"""Steady answers of a transmission.

Oracles: the torque balance of one mesh by hand, T_A = -F l_A - s e_A, T_B = -F l_B + s e_B; a steady simulation;
power balance.
"""

import math

import casadi as ca
import numpy as np
import pytest

from actuator import Actuator, Load, TorqueSource, linearize, simulate, trim
from controllers import PID
from gear import (
    Backlash,
    Bearing,
    Coulomb,
    EfficiencyPoint,
    ExternalPair,
    GivenPair,
    Linear,
    Mesh,
    Shaft,
    TabulatedEfficiency,
    Transmission,
)
from gear.arrangements import spur_pair, train
from gear.balance import balance
from gear.breakout import breakout, scale_friction
from gear.efficiency import efficiency, efficiency_map, mesh_efficiencies, plot_efficiency
from gear.planets import MeshLaws
from gear.shafts import Drag

PAIR = ExternalPair(teeth_a=20, teeth_b=60, module=1e-3)
LAWS = MeshLaws(elasticity=Linear(stiffness=1e7, damping=1e3), friction=Coulomb(sliding=0.1, static=0.15))
GEAR = spur_pair(PAIR, 1e-5, 1e-4, LAWS)


def by_hand(pair, mu, a_drives):
    """Efficiency of one mesh; friction takes from the driving and from the driven wheel."""
    cosine = math.cos(pair.working_angle)
    a, b = mu * pair.friction_arm_a / pair.radius_a, mu * pair.friction_arm_b / pair.radius_b
    return (cosine - b) / (cosine + a) if a_drives else (cosine - a) / (cosine + b)


@pytest.mark.parametrize("speed", [2.0, -2.0])
@pytest.mark.parametrize("driving", ["input", "output"])
def test_one_mesh_has_the_efficiency_of_its_torque_balance(speed, driving):
    found = efficiency(GEAR, torque=5.0, speed=speed, driving=driving)
    assert found == pytest.approx(by_hand(PAIR, 0.1, driving == "input"), rel=1e-12)


def test_the_efficiency_of_a_train_is_the_product_of_its_meshes():
    gear = train([PAIR, PAIR, PAIR], [1e-5] * 4, LAWS)
    assert efficiency(gear, torque=5.0, speed=1.0) == pytest.approx(by_hand(PAIR, 0.1, True) ** 3, rel=1e-10)
    assert list(mesh_efficiencies(gear, torque=5.0, speed=1.0).values()) == pytest.approx(
        [by_hand(PAIR, 0.1, True)] * 3, rel=1e-10
    )


GIVEN = GivenPair(radius_a=0.01, radius_b=0.03, friction_factor=0.84, friction_arm_a=9.2e-3, friction_arm_b=15e-3)


@pytest.mark.parametrize("pair", [PAIR, GIVEN])
@pytest.mark.parametrize("tabulated", [0.98, 0.9, 0.7, 0.5])
@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_a_mesh_has_the_efficiency_that_its_table_says(pair, tabulated, speed):
    table = TabulatedEfficiency(points=(EfficiencyPoint(speed=0.0, a_drives=tabulated, b_drives=tabulated),))
    gear = train([pair, pair], [1e-5] * 3, MeshLaws(elasticity=Linear(stiffness=1e8, damping=1.0), friction=table))
    assert list(mesh_efficiencies(gear, torque=5.0, speed=speed).values()) == pytest.approx([tabulated] * 2, rel=1e-10)


def test_a_steady_run_has_the_efficiency_of_the_balance():
    gear = Transmission(
        shafts=GEAR.shafts,
        meshes=GEAR.meshes,
        bearings={"seal": Bearing(shaft="wheel_a", coulomb=0.02, breakaway=0.03, viscous=1e-4, load_arm=1e-4)},
        drags={"oil": Drag(shaft="wheel_b", speeds=(0.0, 1.0, 10.0), torques=(0.0, 0.01, 0.2))},
        input="wheel_a",
        output="wheel_b",
    )
    plant = Actuator(motor=TorqueSource(), gear=gear, load=Load(damping=2.0))
    run = simulate(plant, 3.0, inputs={"torque_reference": 1.0}, compiled=False)
    speed = run["load_speed"][-1]
    point = balance(gear, output_torque=-2.0 * speed, output_speed=speed)
    assert point.input_torque == pytest.approx(1.0, rel=1e-6)
    assert sum(point.loss.values()) == pytest.approx(point.input_power(gear) + point.output_power(gear), rel=1e-9)


def test_breakout_is_the_balance_with_static_friction():
    start = breakout(GEAR, torque=6.0)
    assert start.input_torque == pytest.approx(6.0 / 3 / by_hand(PAIR, 0.15, True), rel=1e-12)
    assert start.output_torque == 0.0  # nothing but the mesh resists, and that scales with the load
    assert not start.self_locking


def test_seals_set_the_torque_that_drives_a_gear_backward():
    gear = Transmission(
        shafts=GEAR.shafts,
        meshes=GEAR.meshes,
        bearings={"seal": Bearing(shaft="wheel_a", coulomb=0.0, breakaway=0.5)},
        input="wheel_a",
        output="wheel_b",
    )
    assert breakout(gear, torque=1.0).output_torque == pytest.approx(0.5 * 3 / by_hand(PAIR, 0.15, False), rel=1e-9)


def test_a_gear_locks_itself_where_its_friction_is_that_many_times_larger():
    margin = breakout(GEAR, torque=1.0).locking_margin
    # driven by B, wheel A gives nothing where mu e_A = r_A cos(alpha)
    expected = math.cos(PAIR.working_angle) * PAIR.radius_a / PAIR.friction_arm_a / 0.15
    assert margin == pytest.approx(expected, rel=1e-9)
    locked = breakout(scale_friction(GEAR, 1.01 * margin), torque=1.0)
    assert locked.self_locking
    assert locked.output_torque == math.inf


def test_efficiency_over_load_speed_and_temperature_is_a_labelled_dataset():
    gears = {218.15: scale_friction(GEAR, 2.0), 293.15: GEAR}
    data = efficiency_map(gears, torques=[1.0, 2.0, 4.0], speeds=[0.5, 1.0])
    assert dict(data.sizes) == {"temperature": 2, "torque": 3, "speed": 2}
    assert data.torque.attrs["units"] == "N m"
    assert float(data.forward.sel(temperature=293.15, torque=2.0, speed=1.0)) == pytest.approx(by_hand(PAIR, 0.1, True))
    assert (data.forward.sel(temperature=218.15) < data.forward.sel(temperature=293.15)).all()
    assert [axes.get_title() for axes in plot_efficiency(data).axes[:2]] == [
        "forward at -55 degC",
        "backward at -55 degC",
    ]


def test_backlash_does_not_change_a_steady_balance():
    mesh = Mesh(
        a="wheel_a",
        b="wheel_b",
        pair=PAIR,
        elasticity=Backlash(gap=1e-5, law=Linear(stiffness=1e7, damping=1e3)),
        friction=Coulomb(sliding=0.1, static=0.15),
    )
    gear = Transmission(
        shafts={"wheel_a": Shaft(inertia=1e-5), "wheel_b": Shaft(inertia=1e-4)},
        meshes={"mesh": mesh},
        input="wheel_a",
        output="wheel_b",
    )
    assert efficiency(gear, torque=5.0, speed=1.0) == pytest.approx(efficiency(GEAR, torque=5.0, speed=1.0), rel=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: efficiency(GEAR, torque=-1.0, speed=1.0), "torque must be > 0 N m, got -1.0 N m"),
        (lambda: balance(GEAR, output_torque=1.0, output_speed=0), "output_speed must not be 0 rad/s"),
        (lambda: Drag(shaft="a", speeds=(0.0, 1.0), torques=(0.1, 1.0)), "torques must begin with 0 N m"),
        (lambda: Drag(shaft="a", speeds=(0.0, 0.0), torques=(0.0, 1.0)), "speeds must increase from 0 rad/s"),
    ],
)
def test_what_cannot_be_answered_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


DRAG = Drag(shaft="a", speeds=(0.0, 2.0, 10.0, 30.0), torques=(0.0, 0.1, 0.2, 0.1))


def test_a_drag_is_its_table_turned_against_the_motion_on_both_sides():
    speeds = np.concatenate([np.linspace(-40, 40, 801), [1e-12, -1e-12]])
    found = [float(DRAG.torque(speed)) for speed in speeds]
    expected = -np.sign(speeds) * np.interp(abs(speeds), DRAG.speeds, DRAG.torques)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-25)


def test_the_slope_of_a_drag_has_no_corner_at_standstill():
    speed = ca.SX.sym("speed")
    slope = ca.Function("slope", [speed], [ca.jacobian(DRAG.torque(speed), speed)])
    assert [float(slope(v)) for v in (-1e-12, 0.0, 1e-12, 1.0)] == [-0.05] * 4


@pytest.mark.parametrize("reference", [0.0, 0.1, 0.3, 0.7])
def test_a_linear_model_at_rest_has_the_slope_of_the_drag(reference):
    drag = Drag(shaft="s", speeds=(0.0, 1000.0), torques=(0.0, 20.0))
    gear = Transmission(shafts={"s": Shaft(inertia=0.01)}, drags={"d": drag}, input="s", output="s")
    rotor = Actuator(motor=TorqueSource(), gear=gear, controller=PID(proportional=3.0, integral=4.0, derivative=0.6))
    model = linearize(trim(rotor, {}, inputs={"reference": reference}), ["load_torque"], ["load_angle"])
    assert model.A[-1, -1] == pytest.approx(-(0.6 + 20.0 / 1000.0) / 0.01, rel=1e-12)
