"""Gear sets as graphs.

Oracles: Willis' equation for every ratio; H. W. Mueller, "Epicyclic Drive Trains" (1982), ch. 3 (also VDI 2157), for
the efficiency of a planetary set from that of its train with the carrier at rest; power balance.
"""

import pytest

from actuator import Actuator, Load, Ramp, Sine, Sum, TorqueSource, simulate
from gear import Bearing, Coulomb, ExternalPair, InternalPair, Linear
from gear.arrangements import (
    MeshLaws,
    Planets,
    differential,
    planetary,
    ravigneaux,
    spur_pair,
    stepped_planetary,
    train,
    wolfrom,
)
from gear.drawing import draw, table
from gear.efficiency import balance, efficiency

LOSSY = MeshLaws(elasticity=Linear(stiffness=1e8, damping=2e4), friction=Coulomb(sliding=0.1, static=0.15))
LOSSLESS = MeshLaws(elasticity=Linear(stiffness=1e8, damping=2e4))
PLANETS = Planets(count=3, inertia=2e-6, mass=0.02)
INERTIAS = {name: 1e-5 for name in ("sun", "carrier", "ring", "output_ring", "small_sun", "large_sun")}
SUN, RING = 24, 72


def outside(a, b):
    return ExternalPair(teeth_a=a, teeth_b=b, module=1e-3)


def inside(a, b):
    return InternalPair(teeth_a=a, teeth_b=b, module=1e-3, addendum_b=0.7)


def simple(laws=LOSSLESS, **ends):
    return planetary(
        sun_planet=outside(SUN, 24), planet_ring=inside(24, RING), planets=PLANETS, inertias=INERTIAS, laws=laws, **ends
    )


def stepped(laws=LOSSLESS, **ends):
    return stepped_planetary(
        sun_planet=outside(20, 40), step_ring=inside(20, 80), planets=PLANETS, inertias=INERTIAS, laws=laws, **ends
    )


def wolfrom_set(laws=LOSSLESS):
    return wolfrom(
        sun_planet=outside(20, 22),
        planet_ring=inside(22, 64),
        step_ring=inside(24, 66),
        planets=PLANETS,
        inertias=INERTIAS,
        laws=laws,
    )


def ravigneaux_set(laws=LOSSLESS, **ends):
    return ravigneaux(
        small_sun=outside(24, 20),
        planets_between=outside(20, 20),
        large_sun=outside(30, 20),
        planet_ring=inside(20, 70),
        short_planets=PLANETS,
        long_planets=PLANETS,
        inertias=INERTIAS,
        laws=laws,
        **ends,
    )


def differential_set(laws=LOSSLESS, **ends):
    return differential(
        sun_planet=outside(30, 20),
        planets_between=outside(20, 20),
        planets=PLANETS,
        inertias=INERTIAS,
        laws=laws,
        **ends,
    )


RATIOS = (
    (spur_pair(outside(20, 60), 1e-5, 1e-4), -3),
    (spur_pair(inside(20, 60), 1e-5, 1e-4), 3),
    (train([outside(20, 60), outside(20, 50), outside(20, 40)], [1e-5] * 4), -3 * 2.5 * 2),
    (simple(), 1 + RING / SUN),
    (simple(fixed=("carrier",), output="ring"), -RING / SUN),
    (simple(fixed=("sun",), input="ring", output="carrier"), 1 + SUN / RING),
    (simple(fixed=("ring",), input="carrier", output="sun"), 1 / (1 + RING / SUN)),
    (stepped(), 1 + (40 * 80) / (20 * 20)),
    (wolfrom_set(), (1 + 64 / 20) / (1 - (64 * 24) / (22 * 66))),
    (ravigneaux_set(), 70 / 24),
    (ravigneaux_set(input="large_sun"), -70 / 30),
    (ravigneaux_set(input="small_sun", output="carrier", fixed=("ring",)), 1 - 70 / 24),
    (ravigneaux_set(input="large_sun", output="carrier", fixed=("ring",)), 1 + 70 / 30),
    (differential_set(fixed=("left_sun",)), 0.5),
    (differential_set(input="left_sun", fixed=("carrier",)), -1),
)
SETS = tuple(gear for gear, _ in RATIOS)


@pytest.mark.parametrize(("gear", "ratio"), RATIOS)
def test_ratios_are_those_of_willis(gear, ratio):
    assert gear.ratio() == pytest.approx(ratio, rel=1e-9)


@pytest.mark.parametrize("gear", SETS)
def test_a_lossless_set_passes_all_power_on(gear):
    point = balance(gear, output_torque=-10.0, output_speed=1.0)
    assert point.input_power(gear) == pytest.approx(-point.output_power(gear), rel=1e-9)
    assert sum(point.loss.values()) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("build", [simple, stepped, ravigneaux_set, wolfrom_set])
def test_losses_are_the_difference_of_the_powers(build):
    gear = build(LOSSY)
    point = balance(gear, output_torque=-10.0, output_speed=1.0)
    assert sum(point.loss.values()) == pytest.approx(point.input_power(gear) + point.output_power(gear), rel=1e-9)
    assert min(point.loss.values()) >= 0


def test_a_planetary_set_driven_by_its_sun_has_the_published_efficiency():
    """Mueller: eta = (1 - i0 eta0)/(1 - i0), i0 = -z_ring/z_sun, eta0 of the set with its carrier at rest."""
    standing = simple(LOSSY, fixed=("carrier",), output="ring")
    eta0 = efficiency(standing, torque=10.0, speed=-1.0)
    i0 = -RING / SUN
    found = efficiency(simple(LOSSY), torque=10.0, speed=1.0)
    assert found == pytest.approx((1 - i0 * eta0) / (1 - i0), abs=1e-9)


def test_a_planetary_set_driven_by_its_carrier_has_the_published_efficiency():
    """Mueller: eta = (1 - i0)/(1 - i0/eta0), with eta0 of the standing set driven by its ring."""
    standing = simple(LOSSY, fixed=("carrier",), output="ring")
    eta0 = efficiency(standing, torque=10.0, speed=-1.0, driving="output")
    i0 = -RING / SUN
    found = efficiency(simple(LOSSY), torque=10.0, speed=1.0, driving="output")
    assert found == pytest.approx((1 - i0) / (1 - i0 / eta0), abs=1e-9)


def test_a_planetary_set_with_a_free_ring_has_two_degrees_of_freedom():
    free = simple(fixed=())
    assert len(free.kinematics().independent) == 4
    with pytest.raises(ValueError, match=r"not joined by one speed ratio: with rigid teeth 2 speeds are free"):
        free.ratio()


def test_rigid_teeth_leave_one_degree_of_freedom():
    gear = simple(MeshLaws())
    assert gear.kinematics().independent == ["carrier"] or len(gear.kinematics().independent) == 1


def test_rigid_and_stiff_teeth_accelerate_alike():
    """With rigid teeth the inertia at the sun is the closed form J_s + sum of J_i turns_i^2."""
    gear = simple(MeshLaws())
    turns = gear.travel()
    turns = {name: value / turns["sun"] for name, value in turns.items()}
    inertia = sum(shaft.inertia * turns[name] ** 2 for name, shaft in gear.shafts.items())
    plant = Actuator(motor=TorqueSource(), gear=gear)
    run = simulate(plant, 0.1, inputs={"torque_reference": 0.01}, compiled=False)
    assert run["motor_speed"][-1] == pytest.approx(0.01 / inertia * 0.1, rel=1e-9)
    stiff = Actuator(motor=TorqueSource(), gear=simple(LOSSLESS))
    elastic = simulate(stiff, 0.1, inputs={"torque_reference": 0.01}, compiled=False)
    assert elastic["motor_speed"][-1] == pytest.approx(run["motor_speed"][-1], rel=1e-4)


def test_a_compound_planetary_that_sticks_everywhere_keeps_its_margins():
    gear = stepped(LOSSY)
    bearings = {name: Bearing(shaft=name, coulomb=0.005, breakaway=0.01) for name in ("sun", "carrier")}
    plant = Actuator(
        motor=TorqueSource(),
        gear=type(gear)(
            shafts=gear.shafts, meshes=gear.meshes, bearings=bearings, input="sun", output="carrier", fixed=("ring",)
        ),
        load=Load(inertia=1e-3, damping=0.05, stiffness=2.0),
    )
    run = simulate(
        plant,
        1.0,
        inputs={"torque_reference": Sine(amplitude=0.5, frequency=2.0), "load_torque": Sum(parts=(Ramp(slope=0.5),))},
        compiled=False,
    )
    assert run.margins.min() > -1e-9
    for contact, modes in run.modes.items():
        loss = run[f"{contact}.friction_loss"][1:] * (modes[1:] != "stuck")
        assert (loss * (run.t[1:] - run.t[:-1])).sum() >= 0
    assert {"stuck", "forward", "backward"} <= set(run.modes["gear.meshes.sun_planet"])


def test_the_table_and_the_drawing_name_every_shaft_and_mesh():
    gear = simple(LOSSY)
    text = table(gear, output_torque=-10.0)
    for name in (*gear.shafts, *gear.meshes, "3 x 24 : 72", "fixed", "input", "output"):
        assert name in text
    words = " ".join(item.get_text() for item in draw(gear).axes[0].texts)
    for name in (*gear.shafts, *gear.meshes):
        assert name in words


def test_pairs_on_one_carrier_need_one_center_distance():
    with pytest.raises(ValueError, match="the same center distance, got sun_planet 24 mm, planet_ring 23 mm"):
        planetary(sun_planet=outside(24, 24), planet_ring=inside(24, 70), planets=PLANETS, inertias=INERTIAS)


def test_a_train_needs_an_inertia_per_shaft():
    with pytest.raises(ValueError, match="2 stages need 3 inertias, got 2"):
        train([outside(20, 60), outside(20, 60)], [1e-5, 1e-5])
