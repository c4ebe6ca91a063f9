"""Transmissions against ratios by hand (trains, Willis), action and reaction, and the gradient of the stored energy."""

import dataclasses
import math

import casadi as ca
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import PAPER_PAIR, in_symbols, numbers

from gear import Backlash, Bearing, Coulomb, Coupling, ExternalPair, GivenPair, Linear, Mesh, Shaft, Transmission

TEETH = Linear(stiffness=2e8, damping=0.0)
FRICTION = Coulomb(sliding=0.1, static=0.2)
PLANETS = (24, 36, 30, 30)  # teeth: sun, planet, second wheel of the planet, second sun


def mesh(a, b, teeth=(20, 60), carrier=None, **changes):
    pair = ExternalPair(teeth_a=teeth[0], teeth_b=teeth[1], module=1e-3)
    return Mesh(a=a, b=b, carrier=carrier, pair=pair, elasticity=TEETH, friction=FRICTION, **changes)


def train(stages, **changes):
    """A shaft, a mesh, a shaft, ... from s0 (input) to the last one (output)."""
    parts = {
        "shafts": {f"s{k}": Shaft(inertia=1e-4) for k in range(len(stages) + 1)},
        "meshes": {f"m{k}": mesh(f"s{k}", f"s{k + 1}", teeth) for k, teeth in enumerate(stages)},
        "input": "s0",
        "output": f"s{len(stages)}",
    }
    return Transmission(**parts | changes)


def planetary(**changes):
    """Two suns of their own around one planet shaft with two wheels, all meshes external."""
    sun, planet, second, fixed_sun = PLANETS
    parts = {
        "shafts": {name: Shaft(inertia=1e-4) for name in ("sun", "carrier", "planet", "fixed_sun")},
        "meshes": {
            "first": mesh("sun", "planet", (sun, planet), "carrier"),
            "second": mesh("planet", "fixed_sun", (second, fixed_sun), "carrier"),
        },
        "input": "sun",
        "output": "carrier",
        "fixed": ("fixed_sun",),
    }
    return Transmission(**parts | changes)


BRACED = train(
    [(20, 60), (25, 50)],
    meshes={
        "m0": mesh("s0", "s1", carrier="s2"),
        "m1": dataclasses.replace(mesh("s1", "s2"), elasticity=Backlash(gap=15e-6, law=TEETH)),
    },
    couplings={"soft": Coupling(a="s0", b="s2", stiffness=50.0, damping=0.0)},
)
SHAFTS = tuple(BRACED.shafts)
small_angles = st.tuples(*(numbers(-1e-3, 1e-3) for _ in SHAFTS))
speeds = st.tuples(*(numbers(-10, 10) for _ in SHAFTS))

# -- ratios -------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(stages=st.lists(st.tuples(st.integers(18, 40), st.integers(18, 120)), min_size=1, max_size=3))
def test_ratio_of_a_train_is_the_product_of_its_stages_each_turning_round(stages):
    ratios = [-b / a for a, b in stages]
    assert train(stages).ratio() == pytest.approx(math.prod(ratios), rel=1e-9)
    turns = train(stages).speed_ratios()
    assert list(turns.values()) == pytest.approx([math.prod(ratios[k:]) for k in range(len(stages) + 1)], rel=1e-9)


@settings(deadline=None, max_examples=20)
@given(stages=st.lists(st.tuples(st.integers(18, 40), st.integers(18, 120)), min_size=1, max_size=3))
def test_a_train_driven_from_its_other_end_has_the_inverse_ratio(stages):
    forth, back = train(stages), train(stages, input=f"s{len(stages)}", output="s0")
    assert forth.ratio() * back.ratio() == pytest.approx(1)


def test_a_coupling_and_a_single_shaft_turn_one_to_one():
    coupled = train([(20, 40)], meshes={}, couplings={"c": Coupling(a="s0", b="s1", stiffness=1.0, damping=0.0)})
    assert coupled.ratio() == pytest.approx(1)
    assert Transmission(shafts={"only": Shaft(inertia=1.0)}, input="only", output="only").ratio() == 1


def test_planetary_set_with_a_fixed_sun_follows_willis():
    """(w_sun - w_c) / (w_fixed - w_c) = (z2 z4) / (z1 z3), so w_sun / w_c = 1 - (z2 z4) / (z1 z3)."""
    z1, z2, z3, z4 = PLANETS
    turns = planetary().speed_ratios()
    assert turns["sun"] == pytest.approx(1 - z2 * z4 / (z1 * z3))
    assert turns["planet"] == pytest.approx(1 + z4 / z3)
    assert (turns["carrier"], turns["fixed_sun"]) == pytest.approx((1, 0))


def test_planetary_set_with_its_second_sun_driven_by_the_carrier_follows_willis():
    """A layshaft 20:60 and 30:30 turns the second sun k times as fast as the carrier: 1 + i0 (k - 1)."""
    z1, z2, z3, z4 = PLANETS
    differential = planetary(fixed=())
    power_split = planetary(
        fixed=(),
        shafts={**differential.shafts, "lay": Shaft(inertia=1e-4)},
        meshes={
            **differential.meshes,
            "up": mesh("carrier", "lay", (60, 20)),
            "down": mesh("lay", "fixed_sun", (30, 30)),
        },
    )
    k = (60 / 20) * (30 / 30)
    assert power_split.ratio() == pytest.approx(1 + z2 * z4 / (z1 * z3) * (k - 1))


# -- contacts -----------------------------------------------------------------------------------------


def bearings(*shafts):
    return {f"b_{shaft}": Bearing(shaft=shaft, coulomb=0.1, breakaway=0.2, viscous=0.01) for shaft in shafts}


@pytest.mark.parametrize(
    ("gear", "redundant"),
    [
        (train([(20, 60)]), False),
        (train([(20, 60)], bearings=bearings("s0")), False),
        (train([(20, 60)], bearings=bearings("s0", "s1")), True),
        (train([(20, 60), (20, 60)]), False),
        (train([(20, 60), (20, 60)], bearings=bearings("s1")), False),
        (train([(20, 60), (20, 60)], bearings=bearings("s0", "s2")), True),
        (train([(20, 60)], bearings={"front": bearings("s0")["b_s0"], "rear": bearings("s0")["b_s0"]}), True),
        (Transmission(shafts={"only": Shaft(inertia=1.0)}, input="only", output="only"), False),
    ],
)
def test_contacts_are_redundant_where_they_outnumber_what_they_can_lock(gear, redundant):
    assert bool(gear.redundant()) is redundant


def test_contacts_are_counted_along_the_train():
    gear = train([(20, 60), (25, 50)], bearings=bearings("s2", "s0"))
    assert [contact.name for contact in gear.contacts()] == ["bearings.b_s0", "meshes.m0", "meshes.m1", "bearings.b_s2"]


def test_friction_in_every_contact_opposes_its_own_slip():
    for contact in train([(20, 60), (25, 50)], bearings=bearings("s0", "s2")).contacts():
        assert sum(contact.slip[shaft] * contact.torque[shaft] for shaft in contact.slip) < 0


def test_friction_limits_are_coefficients_times_normal_force():
    gear = train([(20, 60)], bearings=bearings("s1"))
    motions = gear.motions({"s0": 0.0, "s1": 0.0}, {"s0": 0.0, "s1": 0.0})
    contacts = [contact.name for contact in gear.contacts()]
    limits = gear.friction_limits(motions, {"m0": -500.0}, dict.fromkeys(contacts, 0.3), dict.fromkeys(contacts, 1.0))
    assert limits == {"meshes.m0": pytest.approx((100, 50)), "bearings.b_s1": (0.2, 0.1)}


# -- torques and energy -------------------------------------------------------------------------------


def flanks_at(angle):
    motions = BRACED.motions(dict(zip(SHAFTS, angle, strict=True)), dict.fromkeys(SHAFTS, 0.0))
    return {
        "meshes.m0": 1.0,
        "couplings.soft": 1.0,
        "meshes.m1": math.copysign(1.0, motions["m1"].deflection) * (abs(motions["m1"].deflection) > 7.5e-6),
    }


def elastic_torques(gear, angle, speed, flank):
    angles, spins = (dict(zip(gear.shafts, values, strict=True)) for values in (angle, speed))
    normal = gear.normal_forces(gear.motions(angles, spins), flank)
    return gear.torques(spins, normal, gear.passed_torques(gear.twists(angles, spins), flank))


@settings(deadline=None, max_examples=50)
@given(angle=small_angles, speed=speeds)
def test_torques_inside_add_to_what_the_housing_of_one_mesh_holds(angle, speed):
    """Couplings, and meshes on a carrier, act between shafts; only the mesh without a carrier leans on the housing."""
    flank = flanks_at(angle)
    torque = elastic_torques(BRACED, angle, speed, flank)
    motions = BRACED.motions(dict(zip(SHAFTS, angle, strict=True)), dict(zip(SHAFTS, speed, strict=True)))
    arms = BRACED.meshes["m1"].torque_per_normal()
    outside = BRACED.normal_forces(motions, flank)["m1"] * sum(arms.values())
    assert sum(torque.values()) == pytest.approx(outside, rel=1e-9, abs=1e-6)


def test_a_coupling_turns_both_shafts_against_each_other():
    gear = train([(20, 40)], meshes={}, couplings={"c": Coupling(a="s0", b="s1", stiffness=50.0, damping=2.0)})
    torque = elastic_torques(gear, (0.3, 0.1), (1.0, 4.0), {"couplings.c": 1.0})
    assert torque == pytest.approx({"s0": -4.0, "s1": 4.0})


def test_viscous_drag_opposes_the_shaft():
    gear = train([(20, 60)], bearings=bearings("s1"))
    torque = gear.torques({"s0": 5.0, "s1": -3.0}, {"m0": 0.0}, {})
    assert torque == pytest.approx({"s0": 0.0, "s1": 0.03})


@settings(deadline=None, max_examples=50)
@given(angle=small_angles)
def test_elastic_torques_are_the_slope_of_the_stored_energy(angle):
    flank = flanks_at(angle)

    def slope(*symbols):
        named = dict(zip(SHAFTS, symbols, strict=True))
        motions = BRACED.motions(named, dict.fromkeys(SHAFTS, 0.0))
        return -ca.jacobian(BRACED.elastic_energy(motions, named, flank), ca.vertcat(*symbols)).T

    torque = elastic_torques(BRACED, angle, (0.0, 0.0, 0.0), flank)
    assert in_symbols(slope, *angle) == pytest.approx(list(torque.values()), rel=1e-9, abs=1e-6)


def test_stored_energy_of_a_mesh_counts_the_deflection_along_the_line_of_action():
    """delta on the pitch circle, F_n along the line of action: c cos(alpha) delta^2 / 2."""
    gear = train([(20, 60)])
    angle = {"s0": 1e-4, "s1": 0.0}  # 1 micrometer at 10 mm
    motions = gear.motions(angle, {"s0": 0.0, "s1": 0.0})
    assert gear.elastic_energy(motions, angle, {"meshes.m0": 1.0}) == pytest.approx(1e-4 * math.cos(math.radians(20)))


def test_equal_meshes_side_by_side_push_and_store_together():
    single, triple = (
        train([(20, 60)], meshes={"m0": dataclasses.replace(mesh("s0", "s1"), count=count)}) for count in (1, 3)
    )
    angle, rest = {"s0": 1e-4, "s1": 0.0}, {"s0": 0.0, "s1": 0.0}
    torque, energy = [], []
    for gear in (single, triple):
        torque.append(elastic_torques(gear, angle.values(), rest.values(), {"meshes.m0": 1.0})["s1"])
        energy.append(gear.elastic_energy(gear.motions(angle, rest), angle, {"meshes.m0": 1.0}))
    assert torque[1] == pytest.approx(3 * torque[0])
    assert energy[1] == pytest.approx(3 * energy[0])


# -- errors -------------------------------------------------------------------------------------------

SPARE = {"s0": Shaft(inertia=1.0), "s1": Shaft(inertia=1.0), "spare": Shaft(inertia=1.0)}
CLIMBING = GivenPair(radius_a=10e-3, radius_b=30e-3, friction_arm_a=1e-3, friction_arm_b=-2e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: train([(20, 60)], input="motor"), "Transmission.input names shaft 'motor'; the shafts are s0, s1"),
        (lambda: train([(20, 60)], output="s7"), "Transmission.output names shaft 's7'; the shafts are s0, s1"),
        (
            lambda: train([(20, 60)], bearings=bearings("s3")),
            "Transmission.bearings.b_s3.shaft names shaft 's3'; the shafts are s0, s1",
        ),
        (
            lambda: train([(20, 60)], meshes={"m0": mesh("s0", "s2")}),
            "Transmission.meshes.m0.b names shaft 's2'; the shafts are s0, s1",
        ),
        (
            lambda: train([(20, 60)], meshes={"m0": mesh("s0", "s1", carrier="arm")}),
            "Transmission.meshes.m0.carrier names shaft 'arm'; the shafts are s0, s1",
        ),
        (lambda: train([(20, 60)], fixed=("s9",)), "Transmission.fixed names shaft 's9'; the shafts are s0, s1"),
        (lambda: planetary(fixed=("sun",)), "Transmission.fixed names shaft 'sun', which is the input or output"),
        (lambda: train([(20, 60)], meshes={}), "shaft 's1' is not joined to the input 's0'"),
        (lambda: train([(20, 60)], shafts=SPARE), "shaft 'spare' is not joined to the input 's0'"),
        (lambda: planetary(fixed=()).ratio(), "'sun' .input. and 'carrier' .output. are not joined by one speed ratio"),
    ],
)
def test_transmissions_that_do_not_hang_together_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_mesh_whose_friction_would_drive_it_is_refused_by_mesh_speed_and_taken_by_conjugate_speed():
    shafts = {"s0": Shaft(inertia=1e-3), "s1": Shaft(inertia=1e-6)}
    climbing = dataclasses.replace(mesh("s0", "s1"), pair=CLIMBING)
    with pytest.raises(ValueError, match="mesh 'm0' cannot stick .* use stick_by='conjugate speed'"):
        train([(20, 60)], shafts=shafts, meshes={"m0": climbing})
    taken = train([(20, 60)], shafts=shafts, meshes={"m0": dataclasses.replace(climbing, stick_by="conjugate speed")})
    assert taken.ratio() == pytest.approx(-3)
    heavy = train([(20, 60)], shafts=shafts | {"s1": Shaft(inertia=1.0)}, meshes={"m0": climbing})
    assert heavy.ratio() == pytest.approx(-3)


# -- rigid teeth --------------------------------------------------------------------------------------


def test_rigid_teeth_reflect_inertia_by_the_square_of_the_ratio():
    rigid = Mesh(a="s0", b="s1", pair=PAPER_PAIR)
    gear = train([(20, 60)], meshes={"m0": rigid})
    inertia = gear.kinematics().solver({"s0": 2.0, "s1": 9.0})
    assert inertia.accelerations({"s0": 6.0}) == pytest.approx({"s0": 2.0, "s1": -2 / 3})
    assert inertia.accelerations({"s1": 9.0}) == pytest.approx({"s0": -1.0, "s1": 1 / 3})


def test_rigid_planetary_set_moves_as_willis_says():
    rigid = {name: dataclasses.replace(m, elasticity=None, friction=None) for name, m in planetary().meshes.items()}
    kinematics, turns = planetary(meshes=rigid).kinematics(), planetary().speed_ratios()
    (free,) = kinematics.independent
    assert kinematics.expand({free: turns[free]}) == pytest.approx(turns, abs=1e-12)
