"""Gear sets as graphs.

Oracles: Willis' equation for every ratio; H. W. Mueller, "Epicyclic Drive Trains" (1982), ch. 3 (also VDI 2157), for
the efficiency of a planetary set from that of its train with the carrier at rest; power balance.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import null_space

from actuator import Actuator, Load, Sine, TorqueSource, simulate
from gear import (
    Backlash,
    Bearing,
    Coulomb,
    ErrorHarmonic,
    ExternalPair,
    InternalPair,
    Linear,
    TransmissionError,
)
from gear.arrangements import (
    differential,
    planetary,
    ravigneaux,
    spur_pair,
    stepped_planetary,
    train,
    wolfrom,
)
from gear.balance import balance
from gear.drawing import draw, table
from gear.efficiency import efficiency
from gear.planets import MeshLaws, Planets, separate
from studies.checks.paper import compound_planetary, compound_planetary_inputs

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
    turns = gear.speed_ratios()
    turns = {name: value / turns["sun"] for name, value in turns.items()}
    inertia = sum(shaft.inertia * turns[name] ** 2 for name, shaft in gear.shafts.items())
    plant = Actuator(motor=TorqueSource(), gear=gear)
    run = simulate(plant, 0.1, inputs={"torque_reference": 0.01}, compiled=False)
    assert run["motor_speed"][-1] == pytest.approx(0.01 / inertia * 0.1, rel=1e-9)
    stiff = Actuator(motor=TorqueSource(), gear=simple(LOSSLESS))
    elastic = simulate(stiff, 0.1, inputs={"torque_reference": 0.01}, compiled=False)
    assert elastic["motor_speed"][-1] == pytest.approx(run["motor_speed"][-1], rel=1e-4)


def test_a_compound_planetary_that_sticks_everywhere_keeps_its_margins_and_creates_no_energy():
    """Ten seconds back and forth under load: what goes in is stored or becomes heat, and heat only grows."""
    run = simulate(compound_planetary(), 10.0, inputs=compound_planetary_inputs(), resolution=1e-3, compiled=False)
    assert run.margins.min() > -1e-9
    for contact in ("gear.meshes.sun_planet", "gear.meshes.planet_ring", "gear.bearings.sun"):
        assert {"stuck", "forward", "backward"} <= set(run.modes[contact])
    power = run["motor_torque"] * run["motor_speed"] + run["total_load_torque"] * run["load_speed"]
    stored = run["mechanical_energy"] - run["mechanical_energy"][0]
    lost = cumulative_trapezoid(power, run.t, initial=0.0) - stored
    assert np.diff(lost).min() > -1e-5 * lost[-1]  # the trapezoidal rule, at a reversal
    friction = sum(run[f"{contact}.friction_loss"] for contact in run.modes)
    assert friction.min() > -1e-9
    assert lost[-1] == pytest.approx(np.trapezoid(friction, run.t), rel=1e-4)  # teeth damp a little, too


# -- separate planets ---------------------------------------------------------------------------------

LOAD = Load(inertia=1e-3, damping=0.05, stiffness=2.0)
TOOTH = 1e8  # N/m, of every mesh but the odd one
BACK_AND_FORTH = {"torque_reference": Sine(amplitude=0.5, frequency=2.0), "load_torque": 0.2}


def run_of(gear, inputs, duration):
    plant = Actuator(motor=TorqueSource(), gear=gear, load=LOAD)
    return simulate(plant, duration, inputs=inputs, compiled=False, resolution=1e-3)


def separated(laws, **odd):
    """Three planets of their own, with another elasticity in the meshes named."""
    gear = separate(simple(laws), "planets")
    return replace(gear, meshes=gear.meshes | {m: replace(gear.meshes[m], elasticity=law) for m, law in odd.items()})


def test_equal_planets_apart_are_the_lumped_ones():
    lumped, apart = simple(LOSSY), separated(LOSSY)
    assert apart.ratio() == pytest.approx(lumped.ratio())
    one, other = (balance(gear, output_torque=-10.0, output_speed=1.0) for gear in (lumped, apart))
    assert other.input_torque == pytest.approx(one.input_torque, rel=1e-9)
    assert [other.normal[f"sun_planet_{k}"] for k in (1, 2, 3)] == pytest.approx([one.normal["sun_planet"] / 3] * 3)


def test_equal_planets_apart_stick_and_slip_as_the_lumped_ones():
    lumped, apart = (run_of(gear, BACK_AND_FORTH, 1.0) for gear in (simple(LOSSY), separated(LOSSY)))
    assert apart["motor_angle"] == pytest.approx(lumped["motor_angle"], abs=1e-6)
    for name in ("sun_planet", "planet_ring"):
        times, modes = changes(lumped, name)
        assert {"stuck", "forward", "backward"} <= set(modes)
        for k in (1, 2, 3):
            normal = apart[f"gear.meshes.{name}_{k}.normal_force"]
            assert 3 * normal == pytest.approx(lumped[f"gear.meshes.{name}.normal_force"], abs=1e-3)
            assert changes(apart, f"{name}_{k}") == (pytest.approx(times, abs=1e-8), modes)


def changes(run, mesh):
    """Times and modes, as the mesh went through them."""
    found = [change for change in run.changes if change.contact == f"gear.meshes.{mesh}"]
    return [change.time for change in found], [change.after for change in found]


SOFT = Linear(stiffness=0.3 * TOOTH, damping=2e4)
GAP = Backlash(gap=2e-7, law=Linear(stiffness=TOOTH, damping=2e4))
PIN_BEARING = Bearing(shaft="planets", coulomb=0.01, breakaway=0.02)
PIN = TransmissionError(
    law=Linear(stiffness=TOOTH, damping=2e4), harmonics={"pin": ErrorHarmonic(wheel="b", order=1, amplitude=1e-7)}
)


@pytest.mark.parametrize(
    ("mesh", "law", "share"),
    [
        ("sun_planet_2", SOFT, lambda bend, turn: 2 / (1 / 0.3 + 1)),
        ("planet_ring_2", GAP, lambda bend, turn: 1 - 1e-7 / bend),  # the others are bent by half the gap first
        ("planet_ring_2", PIN, lambda bend, turn: 1 - 1e-7 * math.cos(turn) / bend),  # it stands back on this flank
    ],
    ids=["stiffness", "backlash", "position"],
)
def test_unequal_planets_share_the_load_by_their_springs(mesh, law, share):
    """Without friction every planet is two springs in series between sun and ring, and all are bent alike."""
    gear = separated(LOSSLESS, **{mesh: law})
    run = run_of(gear, {"torque_reference": 0.5}, 2.0)
    sun, ring = (
        np.array([run[f"gear.meshes.{name}_{k}.normal_force"][-1] for k in (1, 2, 3)])
        for name in ("sun_planet", "planet_ring")
    )
    assert sun == pytest.approx(-ring, rel=1e-5)
    pair = gear.meshes[mesh].pair
    assert sun.sum() * gear.meshes["sun_planet_1"].pair.radius_a * math.cos(pair.working_angle) == pytest.approx(0.5)
    bend = 2 * sun[0] / TOOTH
    assert sun / sun[0] == pytest.approx([1, share(bend, run["carrier.angle"][-1]), 1], rel=1e-4)


@pytest.mark.parametrize(("mesh", "law"), [("sun_planet_2", SOFT), ("planet_ring_2", GAP), ("planet_ring_2", PIN)])
def test_unequal_planets_keep_their_contact_laws_through_stick_and_slip(mesh, law):
    gear = separated(LOSSY, **{mesh: law})
    assert gear.redundant()
    run = run_of(gear, BACK_AND_FORTH, 1.0)
    assert run.margins.min() > -1e-9
    for contact, modes in run.modes.items():
        assert {"stuck", "forward", "backward"} <= {change.after for change in run.changes if change.contact == contact}
        assert run[f"{contact}.friction_loss"].min() > -1e-9
        assert abs(run[f"{contact}.slip_speed"][modes == "stuck"]).max(initial=0.0) < 1e-12


def test_six_stuck_meshes_of_five_shafts_share_the_smallest_friction_that_holds():
    """G s = demand has many solutions; the one with the smallest sum of G_kk s_k^2 is normal to what G cannot see."""
    gear = separated(LOSSY, sun_planet_2=SOFT)
    run = run_of(gear, {"torque_reference": 0.5}, 4.0)
    contacts = [contact.name for contact in gear.contacts()]
    assert len(contacts) == 6 and all(run.modes[f"gear.{name}"][-1] == "stuck" for name in contacts)
    free = [name for name in gear.shafts if name not in gear.fixed]
    slip = np.array([[float(contact.slip.get(name, 0.0)) for name in free] for contact in gear.contacts()])
    inertia = np.array([gear.shafts[name].inertia + (LOAD.inertia if name == "carrier" else 0.0) for name in free])
    weights = np.diag(slip / inertia @ slip.T)
    unseen = null_space(slip.T).T
    assert len(unseen) == 6 - 4  # turning so that all roll is no slip
    scalars = np.array([run[f"gear.{name}.friction"][-1] for name in contacts])
    assert np.linalg.norm(scalars) > 0.1
    assert unseen @ (weights * scalars) == pytest.approx([0.0, 0.0], abs=1e-6 * np.linalg.norm(weights * scalars))
    assert abs(np.array([run[f"{name}.speed"][-1] for name in free])).max() < 1e-9  # and nothing creeps


def test_planets_of_every_set_can_be_taken_apart():
    for gear, shafts in (
        (wolfrom_set(), ["planets"]),
        (stepped(), ["planets"]),
        (ravigneaux_set(), ["short_planets", "long_planets"]),
        (differential_set(fixed=("left_sun",)), ["left_planets", "right_planets"]),
    ):
        apart = separate(gear, *shafts)
        assert apart.ratio() == pytest.approx(gear.ratio(), rel=1e-9)
        assert len(apart.meshes) == 3 * len(gear.meshes)
        total = sum(shaft.inertia for shaft in gear.shafts.values())
        assert sum(shaft.inertia for shaft in apart.shafts.values()) == pytest.approx(total)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: separate(simple(), "planet"),
            "must be those of equally many lumped planets, got meshes with count none",
        ),
        (lambda: separate(simple(), "planets", "wheel"), "must be those of equally many lumped planets"),
        (
            lambda: separate(replace(simple(), bearings={"pin": PIN_BEARING}), "planets"),
            "separate: bearings.pin is that of all planets together; add it to the separate ones instead",
        ),
    ],
)
def test_what_cannot_be_taken_apart_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


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
